/** Form for a push: link, direction, force and duration. */
import { el } from '../ui/elements';
import type { Vec3 } from '../model/scene';
import type { Push } from './messages';

const DIRECTIONS: readonly (readonly [string, Vec3])[] = [
  ['down (−z)', [0, 0, -1]],
  ['up (+z)', [0, 0, 1]],
  ['+x', [1, 0, 0]],
  ['−x', [-1, 0, 0]],
  ['+y', [0, 1, 0]],
  ['−y', [0, -1, 0]],
];

export class PushForm {
  readonly element: HTMLElement;
  private readonly links = el('select', { id: 'push-link' });

  /** `push` gets the push, with the time of the input (ms of `performance.now`). */
  constructor(push: (push: Push, at: number) => void) {
    const way = el('select', { id: 'push-way' }, ...DIRECTIONS.map(([label], k) => el('option', { value: k }, label)));
    const force = el('input', { id: 'push-force', type: 'number', value: 2, min: 0, step: 'any', required: true });
    const seconds = el('input', { id: 'push-seconds', type: 'number', value: 0.3, min: 0, step: 'any', required: true });
    const submit = (event: Event): void => {
      event.preventDefault();
      const direction = DIRECTIONS[Number(way.value)]?.[1] ?? [0, 0, 0];
      const along = (axis: 0 | 1 | 2): number => direction[axis] * Number(force.value) + 0;
      push(
        { link: this.links.value, force: [along(0), along(1), along(2)], torque: [0, 0, 0], duration_s: Number(seconds.value) },
        event.timeStamp,
      );
    };
    this.element = el(
      'form',
      { class: 'push', on: { submit } },
      el('div', { class: 'field' }, el('label', { for: 'push-link' }, 'Link'), this.links),
      el('div', { class: 'field' }, el('label', { for: 'push-way' }, 'Direction'), way),
      el('div', { class: 'field' }, el('label', { for: 'push-force' }, 'Force, N'), force),
      el('div', { class: 'field' }, el('label', { for: 'push-seconds' }, 'Duration, s'), seconds),
      el('button', { type: 'submit' }, 'Push once'),
    );
  }

  /** Sets the links to choose from. */
  offer(links: readonly string[]): void {
    const chosen = this.links.value;
    this.links.replaceChildren(...links.map((link) => el('option', { value: link }, link)));
    if (links.includes(chosen)) this.links.value = chosen;
  }

  choose(link: string): void {
    this.links.value = link;
  }
}
