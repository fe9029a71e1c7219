/**
 * The base's pose as numbers: where it is, and a target to go to. Positions in m; angles in degrees, roll about x, then pitch about y,
 * then yaw about z.
 */
import { Euler, MathUtils, Quaternion } from 'three';
import type { Quat, Vec3 } from '../model/scene';
import { button, el, setText } from '../ui/elements';
import type { PoseTarget } from './messages';
import type { Field } from '../wire/messages';

const NAMES = ['x, m', 'y, m', 'z, m', 'roll, °', 'pitch, °', 'yaw, °'] as const;
/** Rounds to 1 / `by`, so that sent and recorded numbers are short. */
const rounded = (x: number, by: number): number => Math.round(x * by) / by + 0;

/** Roll, pitch and yaw of an orientation, degrees. */
export function anglesOf(quat: Quat): Vec3 {
  const { x, y, z } = new Euler().setFromQuaternion(new Quaternion(...quat), 'ZYX');
  return [x, y, z].map((angle) => rounded(MathUtils.radToDeg(angle), 10)) as Vec3;
}

/** The orientation of roll, pitch and yaw, degrees. */
export function quatOf(degrees: Vec3): Quat {
  const [roll, pitch, yaw] = degrees.map(MathUtils.degToRad) as Vec3;
  return new Quaternion()
    .setFromEuler(new Euler(roll, pitch, yaw, 'ZYX'))
    .toArray()
    .map((x) => rounded(x, 1e5)) as Quat;
}

export class PoseForm {
  readonly element: HTMLElement;
  private readonly inputs = NAMES.map((label, k) =>
    el('input', {
      id: `pose-${k}`,
      type: 'number',
      class: 'any-step',
      step: k < 3 ? 0.01 : 1,
      placeholder: ' ',
      required: true,
      'aria-label': `Target ${label}`,
    }),
  );
  private readonly shown = NAMES.map(() => el('td', { class: 'n num' }, '–'));
  private now: number[] | null = null;

  /** `go` gets the target, with the time of the input (ms of `performance.now`). */
  constructor(go: (target: PoseTarget, at: number) => void) {
    // Any number is allowed, not only multiples of the arrow's step.
    const form = el(
      'form',
      {
        class: 'pose',
        novalidate: true,
        on: {
          submit: (event) => {
            event.preventDefault();
            const values = this.inputs.map((input) => input.valueAsNumber);
            const wrong = this.inputs.find(
              (input) => Number.isNaN(input.valueAsNumber) || input.validity.rangeUnderflow || input.validity.rangeOverflow,
            );
            if (wrong) {
              wrong.reportValidity();
              return;
            }
            const [x = 0, y = 0, z = 0, roll = 0, pitch = 0, yaw = 0] = values;
            go({ position: [x, y, z], quat_xyzw: quatOf([roll, pitch, yaw]) }, event.timeStamp);
          },
        },
      },
      el(
        'table',
        { class: 'dense' },
        el(
          'thead',
          {},
          el(
            'tr',
            {},
            el('th', { scope: 'col' }, 'Base'),
            el('th', { scope: 'col', class: 'n' }, 'Now'),
            el('th', { scope: 'col' }, 'Target'),
          ),
        ),
        el(
          'tbody',
          {},
          ...NAMES.map((label, k) => el('tr', {}, el('th', { scope: 'row' }, label), this.shown[k], el('td', {}, this.inputs[k]))),
        ),
      ),
      el(
        'div',
        { class: 'row' },
        el('button', { type: 'submit', class: 'small' }, 'Go to the target'),
        button('Target = now', () => this.take(), { class: 'small' }),
      ),
    );
    this.element = form;
  }

  /** Sets the server's limits of the position. */
  limit(spec: Field | undefined): void {
    for (const input of this.inputs.slice(0, 3)) {
      if (spec?.minimum !== null && spec?.minimum !== undefined) input.min = String(spec.minimum);
      if (spec?.maximum !== null && spec?.maximum !== undefined) input.max = String(spec.maximum);
    }
  }

  /** Shows the present pose; the first one is also the target. */
  show(position: Vec3, quat: Quat): void {
    const first = this.now === null;
    this.now = [...position.map((x) => rounded(x, 1e4)), ...anglesOf(quat)];
    this.now.forEach((value, k) => {
      const cell = this.shown[k];
      if (cell) setText(cell, value.toFixed(k < 3 ? 3 : 1));
    });
    if (first) this.take();
  }

  private take(): void {
    this.now?.forEach((value, k) => {
      const input = this.inputs[k];
      if (input) input.value = String(value);
    });
  }
}
