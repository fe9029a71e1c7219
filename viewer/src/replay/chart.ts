/** A chart over the time of a run. It shows the replay's cursor; a click or drag moves the cursor. */
import uPlot from 'uplot';
import 'uplot/dist/uPlot.min.css';
import { figure } from '../ui/format';
import { el, setText } from '../ui/elements';
import { type Line, valueAt } from './series';

/** A colour of the palette, which colour-blind people can distinguish, in the light and the dark theme. */
export type Paint = 's1' | 's2' | 's3' | 's4' | 's5' | 's6' | 's7' | 's8';
/** A line with its colour, run and axis (`scale`). */
export interface Drawn {
  line: Line;
  paint: Paint;
  run?: string;
  scale?: string;
}
export interface AxisWanted {
  scale: string;
  label: string;
  side: 'left' | 'right';
  range?: [number, number];
}

/** A choice of the shown time span. */
export function spanChoice(id: string, zoom: (span: number | null) => void): HTMLElement {
  const choice = el('select', { id }, ...SPANS.map((span) => el('option', { value: span }, span === 0 ? 'the whole run' : `${span} s`)));
  choice.addEventListener('change', () => zoom(Number(choice.value) || null));
  return el('div', { class: 'row' }, el('label', { for: id }, 'Show'), choice);
}

const SPANS = [0, 30, 10, 3, 1];
const SIDE = { left: 3, right: 1 } as const;

/** A colour of the current theme. */
function themed(variable: string): string {
  return getComputedStyle(document.documentElement).getPropertyValue(`--${variable}`).trim();
}

/** A value with its unit. */
export function formatValue(value: number | null, unit: string): string {
  if (value === null) return '–';
  const text = unit === '°' ? figure(Math.round(value * 10) / 10) : figure(value);
  return unit === '°' ? `${text}°` : `${text} ${unit}`.trimEnd();
}

/** Name of a line, with its run if there are two. */
export function lineName({ line, run }: Drawn): string {
  return run ? `${run}: ${line.label}` : line.label;
}

export class Chart {
  readonly element: HTMLElement;
  private readonly place = el('div', { class: 'chart' });
  private readonly legend = el('ul', { class: 'keys' });
  private readonly marker = el('div', { class: 'now' });
  private readonly observer = new ResizeObserver(() => this.resize());
  private readonly dark = matchMedia('(prefers-color-scheme: dark)');
  private readonly redraw = (): void => this.build();
  private plot: uPlot | null = null;
  private lines: Drawn[] = [];
  private values: HTMLElement[] = [];
  private time = 0;
  /** Shown time span, s; null: the whole run. */
  private span: number | null = null;
  /** Begin of the shown span, s. */
  private from = 0;

  constructor(
    title: string,
    private readonly axes: AxisWanted[],
    private readonly duration: number,
    private readonly seek: (time: number) => void,
    ...controls: HTMLElement[]
  ) {
    this.element = el(
      'figure',
      { class: 'plot' },
      el('figcaption', { class: 'row' }, el('span', {}, title), ...controls),
      this.place,
      this.legend,
    );
    this.observer.observe(this.place);
    this.dark.addEventListener('change', this.redraw);
  }

  /** Shows other lines. */
  draw(lines: Drawn[]): void {
    this.lines = lines;
    this.values = lines.map(() => el('span', { class: 'num' }));
    this.legend.replaceChildren(
      ...lines.map((drawn, k) =>
        el(
          'li',
          {},
          el('span', { class: `key ${drawn.paint}${drawn.line.dashed ? ' dashed' : ''}` }),
          el('bdi', {}, lineName(drawn)),
          ' ',
          this.values[k],
        ),
      ),
    );
    this.build();
  }

  get drawn(): readonly Drawn[] {
    return this.lines;
  }

  /** Moves the cursor to `time`, s. */
  show(time: number): void {
    this.time = time;
    this.lines.forEach(({ line }, k) => {
      const value = this.values[k];
      if (value) setText(value, formatValue(valueAt(line, time), line.unit));
    });
    if (!this.plot) return;
    const [min, max] = this.window();
    const { x } = this.plot.scales;
    // setScale takes effect later: the marker's place is computed here.
    if (x?.min !== min || x.max !== max) this.plot.setScale('x', { min, max });
    const wide = this.plot.bbox.width / devicePixelRatio;
    this.marker.style.transform = `translateX(${((time - min) / (max - min)) * wide}px)`;
  }

  /** Shows `span` seconds around the cursor, or with null the whole run. */
  zoom(span: number | null): void {
    this.span = span;
    this.from = this.time - (span ?? 0) / 2;
    this.build();
  }

  dispose(): void {
    this.observer.disconnect();
    this.dark.removeEventListener('change', this.redraw);
    this.plot?.destroy();
  }

  /** Begin and end of the shown span, s. */
  private window(): [number, number] {
    const all = Math.max(this.duration, 1e-3);
    if (this.span === null || this.span >= all) return [0, all];
    // The window stays until the cursor is near its edge, then moves by a page.
    const margin = this.span / 20;
    if (this.time > this.from + this.span - margin) this.from = this.time - 2 * margin;
    else if (this.time < this.from + margin) this.from = this.time + 2 * margin - this.span;
    this.from = Math.min(Math.max(this.from, 0), all - this.span);
    return [this.from, this.from + this.span];
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.place;
    if (width === 0 || height === 0) return;
    if (!this.plot) this.build();
    else if (this.plot.width !== width || this.plot.height !== height) this.plot.setSize({ width, height });
    this.show(this.time);
  }

  private build(): void {
    this.plot?.destroy();
    this.plot = null;
    const { clientWidth: width, clientHeight: height } = this.place;
    if (width === 0 || height === 0) return;
    const [ink, faint] = [themed('soft'), themed('line')];
    // A narrow or low chart has numbers but no axis titles; title and legend have the names.
    const small = width < 420 || height < 140;
    const axis = {
      stroke: ink,
      grid: { stroke: faint, width: 1 },
      ticks: { stroke: faint, width: 1, size: 4 },
      font: '12px system-ui',
      labelFont: '12px system-ui',
    };
    const scales: uPlot.Scales = { x: { time: false, range: () => this.window() } };
    for (const { scale, range } of this.axes)
      scales[scale] = range ? { range: (_, min, max) => [Math.min(min, range[0]), Math.max(max, range[1])] } : {};
    this.plot = new uPlot(
      {
        width,
        height,
        scales,
        legend: { show: false },
        cursor: { drag: { x: false, y: false }, y: false, points: { show: false } },
        axes: [
          { ...axis, scale: 'x', size: 26, gap: 2, values: (_, splits) => splits.map((s) => `${figure(s)} s`) },
          ...this.axes.map((wanted, k): uPlot.Axis => ({
            ...axis,
            scale: wanted.scale,
            side: SIDE[wanted.side],
            size: 42,
            gap: 3,
            values: (_, splits) => splits.map((v) => figure(v)),
            space: 24,
            grid: { ...axis.grid, show: k === 0 },
            ...(small ? {} : { label: wanted.label, labelSize: 18 }),
          })),
        ],
        series: [
          {},
          ...this.lines.map(({ line, paint, scale }): uPlot.Series => ({
            scale: scale ?? this.axes[0]?.scale ?? 'y',
            stroke: themed(paint),
            width: line.dashed ? 1.5 : 2,
            dash: line.dashed ? [6, 4] : [],
            points: { show: false },
            ...(uPlot.paths.stepped ? { paths: uPlot.paths.stepped({ align: 1 }) } : {}),
          })),
        ],
      },
      this.joined(),
      this.place,
    );
    this.plot.over.append(this.marker);
    this.pointer(this.plot.over);
    this.show(this.time);
  }

  /** All lines over a common row of times. */
  private joined(): uPlot.AlignedData {
    if (this.lines.length === 0) return [[0, this.duration]];
    return uPlot.join(this.lines.map(({ line }): uPlot.AlignedData => [line.times, line.values]));
  }

  private pointer(over: HTMLElement): void {
    const to = (event: PointerEvent): void => {
      if (this.plot) this.seek(this.plot.posToVal(event.clientX - over.getBoundingClientRect().left, 'x'));
    };
    over.addEventListener('pointerdown', (event) => {
      if (event.button !== 0) return;
      over.setPointerCapture(event.pointerId);
      to(event);
    });
    over.addEventListener('pointermove', (event) => {
      if (over.hasPointerCapture(event.pointerId)) to(event);
    });
  }
}
