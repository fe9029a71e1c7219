/** Panels next to the ranking: each task with a drawing, how to connect, and the legend. */
import { clock } from '../ui/format';
import { button, copyText, el, name } from '../ui/elements';
import ballsDrawing from './pictures/balls.svg';
import graspDrawing from './pictures/grasp.svg';
import shelfDrawing from './pictures/shelf.svg';
import type { CompetitionResponse, TaskInfo } from '../wire/messages';

const DRAWINGS: Record<string, [string, string]> = {
  balls: [ballsDrawing, 'Balls in box A, and an arrow to box B.'],
  shelf: [shelfDrawing, 'Objects on a shelf, and an arrow into a box.'],
  grasp: [graspDrawing, 'Fingers hold an object above a table.'],
};

/** A card for each task. */
export function taskCards(tasks: readonly TaskInfo[]): HTMLElement[] {
  return tasks.map((task) => {
    const drawing = DRAWINGS[task.name];
    return el(
      'section',
      { class: 'panel task' },
      drawing === undefined ? null : el('img', { src: drawing[0], alt: drawing[1], width: 320, height: 150 }),
      el('h3', {}, name(task.name)),
      el('p', {}, task.description),
      el(
        'p',
        { class: 'soft' },
        `Time limit of a run: ${clock(task.time_limit_s)} of simulated time. Tick: ${Math.round(task.tick_s * 1000)} ms.`,
      ),
    );
  });
}

/** The panel about connecting a program. */
export function connect(info: CompetitionResponse): HTMLElement {
  const official = info.mode === 'official';
  const socket = `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/v1/control`;
  // A team has the wheel, or the sources.
  const lines = [
    'pip install palmares-*.whl',
    '# in the sources: pip install -e client-py',
    ...(official ? ['export PALMARES_TOKEN=plm_…   # your team’s'] : []),
    `python -m palmares.examples.balls_softhand --url ${location.origin}`,
  ];
  return el(
    'section',
    { class: 'panel' },
    el('h3', {}, 'Connect'),
    official &&
      el(
        'p',
        {},
        'Your team needs its token, which the organizers give you. Do not write it into programs or addresses; the client reads it from the environment:',
      ),
    !official && el('p', {}, 'No token is needed. With the Python client:'),
    el('pre', { tabindex: 0 }, lines.join('\n')),
    el('p', {}, el('a', { href: '/docs/teams' }, 'How to write a controller')),
    el(
      'p',
      {},
      'Or with any WebSocket program: subprotocol ',
      el('code', {}, 'palmares.v1.json'),
      ', address ',
      el('code', {}, socket),
      official ? ', and the token in the header Authorization.' : '.',
    ),
    button('Copy the address', () => void copyText(socket), { class: 'small' }),
  );
}

/** The meaning of the columns and status marks. */
export function legend(info: Pick<CompetitionResponse, 'mode' | 'phase'>): HTMLElement {
  const official = info.mode === 'official';
  return el(
    'p',
    {},
    'Each task counts with the best score. With equal totals the earlier team is first. Sensors: rank among the teams that used only sensor readings, never the true state. ',
    official &&
      el(
        'span',
        {},
        el('b', {}, '✓ verified'),
        ': the server has replayed the run and confirmed its score. ',
        el('b', {}, '… provisional'),
        ': not replayed yet; the score may still change. ',
      ),
    official && info.phase !== 'revealed' ? 'Replays become public when the competition is over. ' : 'Click a score to see its replay. ',
  );
}
