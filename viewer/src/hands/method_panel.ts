/** Explains how the pose was computed, and the effect of the hand's own weight. */
import { el, setText } from '../ui/elements';
import type { EquilibriumResponse, HandDescription } from '../wire/messages';

export class MethodPanel {
  readonly element: HTMLElement;
  private readonly law = el('p');
  private readonly why = el('ul', { class: 'why', hidden: true });
  private readonly failed = el('p', { class: 'error' });

  constructor(hand: HandDescription) {
    this.element = el(
      'section',
      { class: 'panel' },
      el('h2', {}, 'How it was computed'),
      this.failed,
      this.law,
      this.why,
      el(
        'p',
        { class: 'hint' },
        hand.gravity_compensation
          ? 'The hand’s own weight is compensated: the orientation of the base has no effect.'
          : 'The hand’s own weight acts downwards in the image: the orientation of the base changes the pose.',
      ),
    );
  }

  show(rest: EquilibriumResponse): void {
    setText(this.failed, '');
    const { beyond_closed_form: beyond } = rest;
    setText(
      this.law,
      rest.law === 'closed_form'
        ? 'By the closed form of adaptive synergies: every tendon is taut and below its limit, no joint is at a limit, and moment arms are constant.'
        : 'By Newton’s method on the energy of springs, tendons and loads. The closed form of adaptive synergies does not cover:',
    );
    this.why.hidden = beyond.length === 0;
    const key = JSON.stringify(beyond);
    if (this.why.dataset['shown'] === key) return;
    this.why.dataset['shown'] = key;
    this.why.replaceChildren(...beyond.map((reason) => el('li', {}, explainReason(reason))));
  }

  fail(message: string): void {
    setText(this.failed, `${message}. The previous pose is shown.`);
  }
}

/** A reason with its explanation. */
export function explainReason(reason: string): string {
  if (reason.endsWith('is slack')) return `${reason}: it does not pull`;
  if (/^tendon .* is at its limit/.test(reason)) return `${reason}: winding further does not pull harder`;
  if (/^joint .* limit/.test(reason)) return `${reason}: the stop carries part of the torque`;
  if (reason.startsWith('moment arms vary')) return `${reason}: the table shows R at rest`;
  if (/^link .* is held$/.test(reason)) return `${reason}: a pin holds one of its points`;
  return reason;
}
