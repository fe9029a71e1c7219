/**
 * Closing, measured and predicted: motor, tension and joints of a run in one chart, as in figure 6 of the 2016 paper on
 * simulating compliant underactuated hands.
 */
import { button, el, fill } from '../ui/elements';
import { type Drawn, type Paint, Chart, spanChoice } from './chart';
import type { ChartedRun } from './charts';
import type { Line } from './series';

/** Number of joints that are drawn by default. */
const MAX_JOINTS = 4;
const JOINTS: Paint[] = ['s1', 's2', 's4', 's5', 's6', 's7'];

export class ClosingDialog {
  readonly element = el('dialog', { class: 'wide closing', 'aria-labelledby': 'closing' });
  private readonly which = el('select', { id: 'closing-run' });
  private readonly joints = el('select', { id: 'closing-joints' });
  private readonly missing = el('p', { class: 'notice' });
  private readonly chart: Chart;

  constructor(private readonly runs: ChartedRun[], duration: number, seek: (time: number) => void) {
    this.chart = new Chart('Motor (left), joints and tension (right)', [
      { scale: 'σ', label: 'motor, σ', side: 'left', range: [0, 1] }, { scale: '°', label: 'joints, °', side: 'right' }, { scale: 'tension', label: 'tension, in the hand’s unit', side: 'right', range: [0, 1] },
    ], duration, seek);
    fill(this.which, ...runs.map(({ mark }, k) => el('option', { value: k }, mark)));
    this.which.addEventListener('change', () => { this.choose(); });
    this.joints.addEventListener('change', () => { this.draw(); });
    this.element.append(el('h2', { id: 'closing' }, 'Closing: measured and predicted'),
      el('p', { class: 'hint' }, 'Solid lines are measured. Dashed lines are the motor’s command, and the predicted joint angles of a hand without contact. Where the two differ, the hand touches something. Click to go to a moment.'),
      el('div', { class: 'row choices' }, el('div', { class: 'row', hidden: runs.length < 2 }, el('label', { for: 'closing-run' }, 'Run'), this.which),
        el('div', { class: 'row' }, el('label', { for: 'closing-joints' }, 'Joints'), this.joints), spanChoice('closing-span', (span) => { this.chart.zoom(span); })),
      this.chart.element, this.missing,
      el('div', { class: 'actions' }, button('Close', () => { this.element.close(); })));
    this.choose();
  }

  /** Opens the dialog with the cursor at a time, s. */
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
    this.joints.replaceChildren(el('option', { value: '' }, names.length > MAX_JOINTS ? `the ${MAX_JOINTS} that move most` : 'all'),
      ...names.map((name) => el('option', { value: name }, name)));
    this.draw();
  }

  private draw(): void {
    const series = this.run?.series;
    if (!series) return;
    const names = this.joints.value ? [this.joints.value] : series.joints().slice(0, MAX_JOINTS);
    const on = (lines: Line[], paint: Paint, scale: string): Drawn[] => lines.map((line) => ({ line, paint, scale }));
    this.chart.draw([...on(series.motors(), 's8', 'σ'), ...on(series.motorTensions(), 's3', 'tension'),
      ...names.flatMap((name, k) => on(series.joint(name), JOINTS[k % JOINTS.length] ?? 's1', '°'))]);
    const predicted = series.hasTelemetry && names.some((name) => series.joint(name).length > 1);
    this.missing.hidden = predicted;
    this.missing.textContent = series.hasTelemetry
      ? 'There is no prediction for this hand.'
      : 'This file has no telemetry, because an older server recorded it. Reached motor position, tension and prediction are missing; rotations of links are computed from the poses.';
  }
}
