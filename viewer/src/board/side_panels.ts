/** Beside the ranking: each task's rules in words with a picture, and how to connect. */
import type { CompetitionInfo, TaskInfo } from './model';
import { clock } from '../ui/format';
import { button, copyText, el, name } from '../ui/elements';
import balls from './pictures/balls.svg';
import grasp from './pictures/grasp.svg';
import shelf from './pictures/shelf.svg';

const PICTURES: Record<string, [string, string]> = {
  balls: [balls, 'Balls in box A, an arrow to box B.'],
  shelf: [shelf, 'Objects in a shelf, an arrow into a box.'],
  grasp: [grasp, 'An object, lifted off a table and held by fingers.'],
};

/** A card for each task. */
export function taskCards(tasks: readonly TaskInfo[]): HTMLElement[] {
  return tasks.map((task) => {
    const picture = PICTURES[task.name];
    return el('section', { class: 'panel task' },
      picture === undefined ? null : el('img', { src: picture[0], alt: picture[1], width: 320, height: 150 }),
      el('h3', {}, name(task.name)),
      el('p', {}, task.description),
      el('p', { class: 'soft' }, `A run lasts at most ${clock(task.time_limit_s)} of simulated time, a tick ${Math.round(task.tick_s * 1000)} ms.`));
  });
}

/** How a program gets in. */
export function connect(info: CompetitionInfo): HTMLElement {
  const official = info.mode === 'official';
  const socket = `${location.protocol === 'https:' ? 'wss' : 'ws'}://${location.host}/v1/control`;
  const lines = official
    ? ['export PALMARES_TOKEN=plm_…   # your team’s', `python -m palmares.examples.balls_softhand --url ${location.origin}`]
    : ['pip install ./client-py', `python -m palmares.examples.balls_softhand --url ${location.origin}`];
  return el('section', { class: 'panel' },
    el('h3', {}, 'Connect'),
    official && el('p', {}, 'A team needs its token: the organizers make it and give it to the team. Keep it out of programs and addresses; the client reads it from the environment:'),
    !official && el('p', {}, 'No token is needed. With the Python client:'),
    el('pre', { tabindex: 0 }, lines.join('\n')),
    el('p', {}, 'Or any program that speaks WebSocket, subprotocol ', el('code', {}, 'palmares.v1.json'), ', to ', el('code', {}, socket),
      official ? ' with the token in the header Authorization.' : '.'),
    button('Copy the address', () => { void copyText(socket); }, { class: 'small' }));
}

/** What the marks mean. */
export function legend(info: Pick<CompetitionInfo, 'mode' | 'phase'>): HTMLElement {
  const official = info.mode === 'official';
  return el('p', {},
    'Best score of each task; equal totals: the earlier first. Sensors: place among the teams that never saw the true state of the world. ',
    official && el('span', {}, el('b', {}, '✓ verified'), ': the server has played the run’s replay again and found the same score. ',
      el('b', {}, '… provisional'), ': it has not yet; the score may still fall. '),
    official && info.phase !== 'revealed' ? 'Replays open when the competition is over. ' : 'A score opens its replay. ');
}
