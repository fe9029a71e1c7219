/** Writes a recording as a Python program for the client in client-py, as a start for one's own controller. */
import { printable } from '../ui/format';
import type { Entry, ActionRecording } from './action_recording';
import type { Action } from '../wire/messages';

/** A Python literal: for strings and finite numbers it equals JSON. */
const literal = (value: unknown): string => JSON.stringify(value);
const tuple = (values: readonly number[]): string => `(${values.map(literal).join(', ')}${values.length === 1 ? ',' : ''})`;
/** Text for a comment or docstring. */
const plain = (text: string): string => printable(text).replaceAll('\\', '/').replaceAll('"', "'");

function baseOf(action: Action): string {
  const { base } = action;
  if (!base) return 'None';
  if ('joints' in base) return `palmares.joints(${tuple(base.joints)})`;
  return 'position' in base
    ? `pose(${tuple(base.position)}, ${tuple(base.quat_xyzw)})`
    : `twist(${tuple(base.linear)}, ${tuple(base.angular)})`;
}

function lineOf(entry: Entry): string {
  switch (entry.kind) {
    case 'step':
      return `    (${entry.ticks}, ${baseOf(entry.action)}, ${entry.action.hand ? tuple(entry.action.hand) : 'None'}),`;
    case 'push':
      return `    Push(${literal(entry.push.link)}, ${tuple(entry.push.force)}, ${tuple(entry.push.torque)}, ${literal(entry.push.duration_s)}),`;
    case 'gap':
      return `    # ${entry.ticks} ticks were not recorded here.`;
  }
}

/** The lines of ACTIONS, with events as comments. */
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

/** The docstring, and the result of the recorded run. */
function describe(recording: ActionRecording): { docs: string[]; driven: string } {
  const { result, run } = recording;
  const docs = [
    `Driven by hand: task ${plain(run.task)}, hand ${plain(run.hand)}, seed ${run.seed}, ${recording.ticks} ticks of ${run.tick_s} s.`,
    '',
    '    python driven.py --url http://127.0.0.1:8080',
    '',
    'It sends the same numbers to a practice server, and the run ends in the same state.',
  ];
  if (recording.pushed) docs.push('The hand was pushed (Push): only practice servers allow this.');
  if (!recording.whole) docs.push('Recording was off for a while, so this run differs from the one that was driven.');
  if (!result) docs.push('The run was not finished when this was saved: its score is unknown.');
  const known = result && recording.whole;
  return {
    docs,
    driven: known ? `{"ticks": ${result.ticks}, "score": ${literal(result.score)}, "state_hash": ${literal(result.state_hash)}}` : 'None',
  };
}

/** The whole file. */
export function pythonOf(recording: ActionRecording): string {
  const { run } = recording;
  const { docs, driven } = describe(recording);
  return `"""${docs.join('\n')}

How to start: ACTIONS has the recorded actions. Change a line, remove some, or repeat some in your own loop.
Then let decide() choose the next action from the observation instead of from the list.
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
"""Result of the run that was driven by hand; None if unknown"""


class Push(NamedTuple):
    """A wrench on a link of the hand from the next tick on, about the link's origin, world frame; practice only."""

    link: str
    force: tuple[float, float, float]  # N
    torque: tuple[float, float, float]  # N·m
    duration_s: float


# Ticks; target pose or velocity of the base; target of each motor, 0 (open) to 1 (closed). None: unchanged.
ACTIONS = [
${actionLines(recording).join('\n')}
]


def decide(step, observation):
    """Return the next step, or None to stop. This version returns the next of ACTIONS and ignores the observation.

    A real controller would use observation.truth.objects, observation.hand and observation.score.
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
            base = hand = None  # The targets stay.
    return client.stop()


def main():
    """Play the run and print its result."""
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("--url", default="http://127.0.0.1:8080", help="address of the server")
    parser.add_argument("--team", default=${literal(recording.team)}, help="name on a practice server's leaderboard")
    args = parser.parse_args()
    with palmares.Client(args.url, team=args.team) as client:
        result = play(client)
    print(f"score {result.score:g}, {result.ticks} ticks, state {result.state_hash} ({result.reason})")
    if DRIVEN is not None:
        same = all(getattr(result, name) == value for name, value in DRIVEN.items())
        print("the same result as when it was driven" if same else f"a different result; when driven: {DRIVEN}")


if __name__ == "__main__":
    try:
        main()
    except palmares.PalmaresError as error:
        sys.exit(str(error))
`;
}
