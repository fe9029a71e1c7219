/** The tension of every tendon, and its limit. */
import { figure } from '../ui/format';
import { el, nameInWords, setText } from '../ui/elements';
import type { TendonDescription } from '../wire/messages';

export class Tensions {
  readonly element: HTMLElement;
  private readonly rows: { meter: HTMLMeterElement; shown: HTMLElement }[];

  constructor(private readonly tendons: readonly TendonDescription[]) {
    this.rows = tendons.map((tendon) => ({
      meter: el('meter', { min: 0, max: tendon.force_limit, 'aria-label': `Tension of ${tendon.name}` }),
      shown: el('output', {}, '–'),
    }));
    this.element = el(
      'section',
      { class: 'panel' },
      el('h2', {}, 'Tension of tendons'),
      el(
        'div',
        { class: 'sliders' },
        ...tendons.map((tendon, k) =>
          el('div', { class: 'slider' }, el('span', {}, nameInWords(tendon.name)), this.rows[k]?.meter, this.rows[k]?.shown),
        ),
      ),
    );
  }

  show(tension: readonly number[]): void {
    this.rows.forEach(({ meter, shown }, k) => {
      const f = tension[k] ?? 0;
      meter.value = Math.abs(f);
      setText(shown, `${figure(Number(f.toPrecision(3)))} of ${figure(this.tendons[k]?.force_limit)}`);
    });
  }
}
