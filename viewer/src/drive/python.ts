/** A recording as a controller in Python, which the client of client-py runs: the start of a program of one's own. */
import { printable } from '../ui/format';
import type { Action } from './messages';
import type { Entry, ActionRecording } from './action_recording';

/** Text and numbers as Python writes them: JSON is that, for strings and finite numbers. */
const literal = (value: unknown): string => JSON.stringify(value);
const tuple = (values: readonly number[]): string => `(${values.map(literal).join(', ')}${values.length === 1 ? ',' : ''})`;
/** Text within a comment or a docstring. */
const plain = (text: string): string => printable(text).replaceAll('\\', '/').replaceAll('"', "'");

function baseOf(action: Action): string {
  const { base } = action;
  if (!base) return 'None';
  return 'position' in base ? `pose(${tuple(base.position)}, ${tuple(base.quat_xyzw)})` : `twist(${tuple(base.linear)}, ${tuple(base.angular)})`;
}

function lineOf(entry: Entry): string {
  switch (entry.kind) {
    case 'step': return `    (${entry.ticks}, ${baseOf(entry.action)}, ${entry.action.hand ? tuple(entry.action.hand) : 'None'}),`;
    case 'push': return `    Push(${literal(entry.push.link)}, ${tuple(entry.push.force)}, ${tuple(entry.push.torque)}, ${literal(entry.push.duration_s)}),`;
    case 'gap': return `    # ${entry.ticks} ticks were not recorded here.`;
  }
}

/** The lines of ACTIONS, with a comment where something happened. */
function actionLines(recording: ActionRecording): string[] {
  const lines: string[] = [];
  let tick = 0;
  let next = 0;
  for (const entry of recording.entries) {
    lines.push(lineOf(entry));
    if (entry.kind !== 'push') tick += entry.ticks;
    for (let event = recording.events[next]; event && event.tick <= tick; event = recording.events[next]) {
      lines.push(`    # tick ${event.tick}: ${event.name === null ? '' : `${plain(event.name)} `}${plain(event.kind)}`);
      next += 1;
    }
  }
  return lines;
}

/** What the file says of the run that it came from. */
function told(recording: ActionRecording): { docs: string[]; driven: string } {
  const { result, run } = recording;
  const docs = [
    `Driven by hand: task ${plain(run.task)}, hand ${plain(run.hand)}, seed ${run.seed}, ${recording.ticks} ticks of ${run.tick_s} s.`,
    '',
    '    python driven.py --url http://127.0.0.1:8080',
    '',
    'It sends to a practice server what was sent then, number by number, and the run ends as it did.',
  ];
  if (recording.pushed) docs.push('The hand was pushed (Push): only practice servers take that.');
  if (!recording.whole) docs.push('Recording was off for a while, so this run is another than the one that was driven.');
  if (!result) docs.push('The run was not finished when this was saved: what it scores is not known.');
  const known = result && recording.whole;
  return { docs, driven: known ? `{"ticks": ${result.ticks}, "score": ${literal(result.score)}, "state_hash": ${literal(result.state_hash)}}` : 'None' };
}

/** The whole file. */
export function pythonOf(recording: ActionRecording): string {
  const { run } = recording;
  const { docs, driven } = told(recording);
  return `"""${docs.join('\n')}

Where to begin: ACTIONS is what was done. Change a line, take some out, or repeat some in a loop of your own.
Then let decide() look at each observation and say what comes next, instead of reading from the list.
"""

import argparse
import sys
from typing import NamedTuple

import palmares
from palmares import pose, twist

TASK = ${literal(run.task)}
HAND = ${literal(run.hand)}
SEED = ${literal(run.seed)}
DRIVEN = ${driven}
"""How the run ended that was driven by hand; None where that is not known"""


class Push(NamedTuple):
    """A wrench on a link of the hand from the next tick on, about the link's origin, world frame; practice only."""

    link: str
    force: tuple[float, float, float]  # N
    torque: tuple[float, float, float]  # N·m
    duration_s: float


# Ticks; where the base goes or how it moves; how far each motor is closed, from 0 to 1. None: as before.
ACTIONS = [
${actionLines(recording).join('\n')}
]


def decide(step, observation):
    """Return the next step, or None to stop. Here it is the next of ACTIONS, whatever is observed.

    A controller that looks would use observation.truth.objects, observation.hand and observation.score.
    """
    return ACTIONS[step] if step < len(ACTIONS) else None


def play(client):
    """Play one run and return its result."""
    observation = client.reset(TASK, HAND, seed=SEED)
    most = client.welcome.limits.repeat
    step = 0
    while not observation.done and (todo := decide(step, observation)) is not None:
        step += 1
        if isinstance(todo, Push):
            client.perturb(todo.link, todo.force, todo.torque, todo.duration_s)
            continue
        ticks, base, hand = todo
        while ticks > 0 and not observation.done:
            observation = client.step(base=base, hand=hand, repeat=min(ticks, most))
            ticks -= most
            base = hand = None  # The targets stand.
    return client.stop()


def main():
    """Play the run, and say how it ended."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--url", default="http://127.0.0.1:8080", help="where the server listens")
    parser.add_argument("--team", default=${literal(recording.team)}, help="name on a practice server's leaderboard")
    args = parser.parse_args()
    with palmares.Client(args.url, team=args.team) as client:
        result = play(client)
    print(f"score {result.score:g}, {result.ticks} ticks, state {result.state_hash} ({result.reason})")
    if DRIVEN is not None:
        same = all(getattr(result, name) == value for name, value in DRIVEN.items())
        print("as it was driven" if same else f"another run than was driven: {DRIVEN}")


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(str(error))
`;
}
