/** The charts below the image, and their values as a table. */
import { el, fill, setText } from '../ui/elements';
import { type Drawn, type Paint, Chart, lineName, spanChoice, formatValue } from './chart';
import { type Line, type Series, valueAt } from './series';

/** A run in the charts; `mark` (A or B) distinguishes two runs. */
export interface ChartedRun {
  series: Series;
  mark: string;
  object: number | null;
}

const ALONE: Paint[] = ['s1', 's2', 's3', 's4', 's5', 's6', 's7', 's8'];
const FIRST: Paint[] = ['s1', 's3', 's6', 's8'];
const SECOND: Paint[] = ['s2', 's5', 's4', 's7'];
/** Update interval of the table, ms. */
const TABLE_MS = 200;

/** Assigns colours: each run has its own; a dashed line has the colour of its solid line. */
export function coloured(runs: readonly ChartedRun[], of: (run: ChartedRun) => Line[], scale?: string): Drawn[] {
  return runs.flatMap((run, place) => {
    const paints = runs.length === 1 ? ALONE : place === 0 ? FIRST : SECOND;
    const names: string[] = [];
    return of(run).map((line) => {
      const quantity = line.label.replace(/, (commanded|reached|measured|predicted|rotation)$/, '');
      if (!names.includes(quantity)) names.push(quantity);
      const paint = paints[names.indexOf(quantity) % paints.length] ?? 's1';
      return { line, paint, ...(runs.length > 1 ? { run: run.mark } : {}), ...(scale ? { scale } : {}) };
    });
  });
}

export class Charts {
  readonly element = el('section', { class: 'charts', 'aria-label': 'Charts' });
  private readonly grid = el('div', { class: 'plots' });
  private readonly joint = el('select', { 'aria-label': 'Joint' });
  private readonly about = el('bdi', {});
  private readonly rows = el('tbody', {});
  private readonly values = el(
    'details',
    {},
    el('summary', {}, 'Values at this moment, as a table'),
    el(
      'div',
      { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Values at this moment' },
      el(
        'table',
        { class: 'dense' },
        el(
          'thead',
          {},
          el(
            'tr',
            {},
            el('th', { scope: 'col' }, 'Chart'),
            el('th', { scope: 'col' }, 'Line'),
            el('th', { scope: 'col', class: 'n' }, 'Value'),
          ),
        ),
        this.rows,
      ),
    ),
  );
  private readonly all: { title: string; chart: Chart; lines: () => Drawn[] }[] = [];
  private written = 0;
  private time = 0;

  constructor(runs: ChartedRun[], duration: number, seek: (time: number) => void) {
    const telemetry = runs.some(({ series }) => series.hasTelemetry);
    const add = (title: string, unit: string, lines: () => Drawn[], range?: [number, number], ...controls: HTMLElement[]): void => {
      const chart = new Chart(title, [{ scale: 'y', label: unit, side: 'left', ...(range ? { range } : {}) }], duration, seek, ...controls);
      this.all.push({ title, chart, lines });
      this.grid.append(chart.element);
    };
    fill(this.joint, ...[...new Set(runs.flatMap(({ series }) => series.joints()))].map((name) => el('option', { value: name }, name)));
    this.joint.addEventListener('change', () => this.redraw());
    add(telemetry ? 'Motors, σ' : 'Motors, commanded σ', 'σ', () => coloured(runs, ({ series }) => series.motors()), [0, 1]);
    add(
      telemetry ? 'Joint angle' : 'Rotation of a link, from its poses',
      '°',
      () => coloured(runs, ({ series }) => series.joint(this.joint.value)),
      undefined,
      this.joint,
    );
    if (telemetry) {
      add('Tension of the tendons', 'tension', () => coloured(runs, ({ series }) => series.tensions()), [0, 1]);
      add(
        'Contact force (N) on',
        'N',
        () => coloured(runs, ({ series, object }) => (object === null ? [] : series.forces(object))),
        [0, 1],
        this.about,
      );
      add('Score', 'points', () => coloured(runs, ({ series }) => series.score()), [0, 1]);
    }
    this.element.append(
      spanChoice('span', (span) => {
        for (const { chart } of this.all) chart.zoom(span);
      }),
      this.grid,
    );
    if (telemetry) {
      this.element.append(
        el(
          'p',
          { class: 'hint' },
          'A contact force adds the magnitudes of all contacts: the two sides of a grip count twice. ',
          'The base follows its path with any force, as an ideal arm. So a hand that presses an object against something fixed can press harder than its fingers hold.',
        ),
      );
    }
    if (!runs.every(({ series }) => series.hasTelemetry)) {
      this.element.append(
        el(
          'p',
          { class: 'notice' },
          `${telemetry ? 'One of the files' : 'This file'} has no telemetry, because an older server recorded it. `,
          'Reached motor positions, tensions, contacts, the score over time and the prediction are missing; rotations of links are computed from the poses.',
        ),
      );
    }
    this.element.append(this.values);
    this.values.addEventListener('toggle', () => this.table());
  }

  /** Redraws for another object or joint. */
  redraw(objectName?: string): void {
    if (objectName !== undefined) setText(this.about, objectName);
    for (const { chart, lines } of this.all) chart.draw(lines());
    this.show(this.time);
    this.table();
  }

  show(time: number): void {
    this.time = time;
    for (const { chart } of this.all) chart.show(time);
    const now = performance.now();
    if (!this.values.open || now - this.written < TABLE_MS) return;
    this.written = now;
    this.table();
  }

  dispose(): void {
    for (const { chart } of this.all) chart.dispose();
  }

  private table(): void {
    if (!this.values.open) return;
    this.rows.replaceChildren(
      ...this.all.flatMap(({ title, chart }) =>
        chart.drawn.map((drawn) =>
          el(
            'tr',
            {},
            el('td', {}, title),
            el('th', { scope: 'row' }, el('bdi', {}, lineName(drawn))),
            el('td', { class: 'n' }, formatValue(valueAt(drawn.line, this.time), drawn.line.unit)),
          ),
        ),
      ),
    );
  }
}
