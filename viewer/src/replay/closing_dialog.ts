/**
 * Closing, sensed against predicted: motor, tension and joints of a run in one chart, as figure 6 of the 2016 paper on
 * simulating compliant underactuated hands shows them.
 */
import { button, el, fill } from '../ui/elements';
import { type Drawn, type Paint, Chart, spanChoice } from './chart';
import type { ChartedRun } from './charts';
import type { Line } from './series';

/** Joints that are drawn unless others are chosen. */
const MOST = 4;
const JOINTS: Paint[] = ['s1', 's2', 's4', 's5', 's6', 's7'];

export class ClosingDialog {
  readonly element = el('dialog', { class: 'wide closing', 'aria-labelledby': 'closing' });
  private readonly which = el('select', { id: 'closing-run' });
  private readonly joints = el('select', { id: 'closing-joints' });
  private readonly lacks = el('p', { class: 'notice' });
  private readonly chart: Chart;

  constructor(private readonly runs: ChartedRun[], duration: number, seek: (time: number) => void) {
    this.chart = new Chart('Motor (left), joints and tension (right)', [
      { scale: 'σ', label: 'motor, σ', side: 'left', range: [0, 1] }, { scale: '°', label: 'joints, °', side: 'right' }, { scale: 'tension', label: 'tension, in the hand’s unit', side: 'right', range: [0, 1] },
    ], duration, seek);
    fill(this.which, ...runs.map(({ mark }, k) => el('option', { value: k }, mark)));
    this.which.addEventListener('change', () => { this.choose(); });
    this.joints.addEventListener('change', () => { this.draw(); });
    this.element.append(el('h2', { id: 'closing' }, 'Closing: sensed against predicted'),
      el('p', { class: 'hint' }, 'Lines are what was measured; dashes are what was asked of the motor, and where the free hand would rest at the motor’s position. Where they part, something is in the way. Click to go to a moment.'),
      el('div', { class: 'row choices' }, el('div', { class: 'row', hidden: runs.length < 2 }, el('label', { for: 'closing-run' }, 'Run'), this.which),
        el('div', { class: 'row' }, el('label', { for: 'closing-joints' }, 'Joints'), this.joints), spanChoice('closing-span', (span) => { this.chart.zoom(span); })),
      this.chart.element, this.lacks,
      el('div', { class: 'actions' }, button('Close', () => { this.element.close(); })));
    this.choose();
  }

  /** Shows it, with the cursor at a time, s. */
  open(time: number): void {
    this.element.showModal();
    this.draw();
    this.chart.show(time);
  }

  show(time: number): void {
    if (this.element.open) this.chart.show(time);
  }

  dispose(): void {
    this.chart.dispose();
    this.element.remove();
  }

  private get run(): ChartedRun | undefined { return this.runs[Number(this.which.value) || 0]; }

  private choose(): void {
    const names = this.run?.series.joints() ?? [];
    this.joints.replaceChildren(el('option', { value: '' }, names.length > MOST ? `the ${MOST} that move most` : 'all'),
      ...names.map((name) => el('option', { value: name }, name)));
    this.draw();
  }

  private draw(): void {
    const series = this.run?.series;
    if (!series) return;
    const names = this.joints.value ? [this.joints.value] : series.joints().slice(0, MOST);
    const on = (lines: Line[], paint: Paint, scale: string): Drawn[] => lines.map((line) => ({ line, paint, scale }));
    this.chart.draw([...on(series.motors(), 's8', 'σ'), ...on(series.motorTensions(), 's3', 'tension'),
      ...names.flatMap((name, k) => on(series.joint(name), JOINTS[k % JOINTS.length] ?? 's1', '°'))]);
    const predicted = series.hasTelemetry && names.some((name) => series.joint(name).length > 1);
    this.lacks.hidden = predicted;
    this.lacks.textContent = series.hasTelemetry
      ? 'No prediction is known for this hand.'
      : 'This file has no telemetry: it was recorded by an older server. The motor as reached, tension and prediction are missing; how far links turned is taken from the poses.';
  }
}
