/** A slider and a number for each motor's target, with its reached position and tension. */
import { el, nameInWords, setText } from '../ui/elements';
import type { ActuatorObservation, Field } from '../wire/messages';

/** Sent values have three decimals. */
const DIGITS = 1000;

interface Row {
  slider: HTMLInputElement;
  target: HTMLInputElement;
  state: HTMLElement;
}

export class Motors {
  readonly element = el('section', { class: 'panel', hidden: true });
  private rows: Row[] = [];

  /** `closed` gets the target of each motor, with the time of the input (ms of `performance.now`). */
  constructor(private readonly closed: (hand: number[], at: number) => void) {}

  /** Shows sliders for these motors, with the server's limits. */
  offer(motors: readonly ActuatorObservation[], spec: Field | undefined): void {
    const [least, most] = [spec?.minimum ?? 0, spec?.maximum ?? 1];
    this.rows = motors.map((motor, k): Row => {
      const slider = el('input', { type: 'range', id: `motor-${k}`, min: least, max: most, step: 'any', value: motor.command });
      const target = el('input', {
        type: 'number',
        class: 'any-step',
        min: least,
        max: most,
        step: 0.01,
        'aria-label': `${motor.name}, target`,
      });
      const row = { slider, target, state: el('p', { class: 'hint num' }) };
      target.addEventListener('change', (event) => {
        // An empty field keeps the target; the slider keeps to its limits.
        if (!Number.isNaN(target.valueAsNumber)) slider.valueAsNumber = target.valueAsNumber;
        this.changed(event.timeStamp);
      });
      slider.addEventListener('input', (event) => this.changed(event.timeStamp));
      return row;
    });
    const all =
      (value: number) =>
      (event: Event): void => {
        for (const row of this.rows) row.slider.value = String(value);
        this.changed(event.timeStamp);
      };
    this.element.hidden = motors.length === 0;
    this.element.replaceChildren(
      el('h2', {}, 'Motors: 0 open, 1 closed'),
      el(
        'div',
        { class: 'sliders' },
        ...this.rows.flatMap((row, k) => [
          el('div', { class: 'slider' }, el('label', { for: `motor-${k}` }, nameInWords(motors[k]?.name ?? '')), row.slider, row.target),
          row.state,
        ]),
      ),
      el(
        'div',
        { class: 'row' },
        el('button', { type: 'button', class: 'small', on: { click: all(least) } }, 'Open all'),
        el('button', { type: 'button', class: 'small', on: { click: all(most) } }, 'Close all'),
      ),
    );
    this.write();
  }

  /** Closes (or opens) all motors by the same amount, for keys and triggers; returns the new targets. */
  close(by: number): number[] {
    for (const row of this.rows) row.slider.valueAsNumber += by;
    this.write();
    return this.values();
  }

  /** Shows reached positions and tensions, in the tendon's own unit. */
  show(motors: readonly ActuatorObservation[]): void {
    motors.forEach((motor, k) => {
      const row = this.rows[k];
      if (row) setText(row.state, `reached ${motor.position.toFixed(2)}, tension ${motor.tension.toPrecision(3)}`);
    });
  }

  private values(): number[] {
    return this.rows.map((row) => Math.round(row.slider.valueAsNumber * DIGITS) / DIGITS);
  }

  private changed(at: number): void {
    this.write();
    this.closed(this.values(), at);
  }

  private write(): void {
    for (const row of this.rows) row.target.value = row.slider.valueAsNumber.toFixed(2);
  }
}
