/** By which law the pose was found, in words, and what the hand's own weight does. */
import { el, setText } from '../ui/elements';
import type { HandDescription } from '../model/hand';
import type { Equilibrium } from './equilibrium';

export class MethodPanel {
  readonly element: HTMLElement;
  private readonly law = el('p');
  private readonly why = el('ul', { class: 'why', hidden: true });
  private readonly failed = el('p', { class: 'error' });

  constructor(hand: HandDescription) {
    this.element = el('section', { class: 'panel' }, el('h2', {}, 'How it was found'), this.failed, this.law, this.why,
      el('p', { class: 'hint' }, hand.gravity_compensation
        ? 'The hand’s own weight is cancelled (gravity compensation): how the base is held changes nothing.'
        : 'The hand’s own weight acts, downwards in the picture: how the base is held changes where it rests.'));
  }

  show(rest: Equilibrium): void {
    setText(this.failed, '');
    const { beyond_closed_form: beyond } = rest;
    setText(this.law, rest.law === 'closed_form'
      ? 'By the closed form of adaptive synergies: every tendon is taut and below its limit, no joint is at a limit, and moment arms are constant.'
      : 'By Newton’s method on the energy of springs, tendons and loads. The closed form of adaptive synergies does not know of this:');
    this.why.hidden = beyond.length === 0;
    const told = JSON.stringify(beyond);
    if (this.why.dataset['told'] === told) return;
    this.why.dataset['told'] = told;
    this.why.replaceChildren(...beyond.map((reason) => el('li', {}, explainReason(reason))));
  }

  fail(message: string): void {
    setText(this.failed, `${message}. The pose before stays.`);
  }
}

/** A reason with what it means. */
export function explainReason(reason: string): string {
  if (reason.endsWith('is slack')) return `${reason}: it pulls nothing`;
  if (/^tendon .* is at its limit/.test(reason)) return `${reason}: more winding pulls no harder`;
  if (/^joint .* limit/.test(reason)) return `${reason}: its stop takes part of the torque`;
  if (reason.startsWith('moment arms vary')) return `${reason}: R below is that at rest`;
  if (/^link .* is held$/.test(reason)) return `${reason}: a pin holds a point of it`;
  return reason;
}
