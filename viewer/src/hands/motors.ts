/** A slider for each motor: σ from 0 (open) to 1 (closed). */
import { button, el, nameInWords, setText } from '../ui/elements';
import type { MotorDescription } from '../wire/messages';

export class MotorSliders {
  readonly element: HTMLElement;
  private readonly rows: { slider: HTMLInputElement; shown: HTMLOutputElement }[];

  constructor(
    motors: readonly MotorDescription[],
    private readonly changed: (sigma: number[]) => void,
  ) {
    this.rows = motors.map((_, k) => {
      const slider = el('input', { type: 'range', id: `motor-${k}`, min: 0, max: 1, step: 0.01, value: 0 });
      slider.addEventListener('input', () => this.tell());
      return { slider, shown: el('output', { for: `motor-${k}` }, '0.00') };
    });
    const all = (value: number) => (): void => {
      this.set(motors.map(() => value));
      this.tell();
    };
    this.element = el(
      'section',
      { class: 'panel' },
      el('h2', {}, motors.length === 1 ? 'Motor: 0 open, 1 closed' : 'Motors: 0 open, 1 closed'),
      el(
        'div',
        { class: 'sliders' },
        ...motors.map((motor, k) =>
          el(
            'div',
            { class: 'slider' },
            el('label', { for: `motor-${k}` }, nameInWords(motor.name)),
            this.rows[k]?.slider,
            this.rows[k]?.shown,
          ),
        ),
      ),
      el(
        'div',
        { class: 'row' },
        button('Open', all(0), { class: 'small' }),
        button('Half', all(0.5), { class: 'small' }),
        button('Close', all(1), { class: 'small' }),
      ),
    );
  }

  get sigma(): number[] {
    return this.rows.map(({ slider }) => slider.valueAsNumber);
  }

  set(sigma: readonly number[]): void {
    this.rows.forEach(({ slider, shown }, k) => {
      slider.value = String(sigma[k] ?? 0);
      setText(shown, slider.valueAsNumber.toFixed(2));
    });
  }

  private tell(): void {
    this.set(this.sigma);
    this.changed(this.sigma);
  }
}
