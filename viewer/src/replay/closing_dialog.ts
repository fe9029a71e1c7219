/**
 * Closing, measured and predicted: motor, tension and joints of a run over the same time, as in figure 6 of the 2016 paper on
 * simulating compliant underactuated hands.
 */
import { button, el, fill } from '../ui/elements';
import { type Drawn, type Paint, Chart, spanChoice } from './chart';
import type { ChartedRun } from './charts';
import type { Line } from './series';

/** Number of joints that are drawn by default. */
const MAX_JOINTS = 4;
const PAINTS: Paint[] = ['s1', 's2', 's3', 's4', 's5', 's6', 's7', 's8'];

export class ClosingDialog {
  readonly element = el('dialog', { class: 'wide closing', 'aria-labelledby': 'closing' });
  private readonly which = el('select', { id: 'closing-run' });
  private readonly joints = el('select', { id: 'closing-joints' });
  private readonly missing = el('p', { class: 'notice' });
  private readonly motors: Chart;
  private readonly angles: Chart;
  private readonly tension: Chart;

  constructor(
    private readonly runs: ChartedRun[],
    duration: number,
    seek: (time: number) => void,
  ) {
    const chart = (title: string, label: string, range?: [number, number]): Chart =>
      new Chart(title, [{ scale: 'y', label, side: 'left', ...(range ? { range } : {}) }], duration, seek);
    this.motors = chart('Motors: 0 open, 1 closed', 'σ', [0, 1]);
    this.angles = chart('Joints', 'degrees');
    this.tension = chart('Tension of the motors, in the hand’s unit', 'tension', [0, 1]);
    this.angles.element.classList.add('tall');
    fill(this.which, ...runs.map(({ mark }, k) => el('option', { value: k }, mark)));
    this.which.addEventListener('change', () => this.choose());
    this.joints.addEventListener('change', () => this.draw());
    this.element.append(
      el('h2', { id: 'closing' }, 'Closing: measured and predicted'),
      el(
        'p',
        { class: 'hint' },
        'Solid lines are measured. Dashed lines are the motor’s command, and the predicted joint angles of a hand without contact. Where the two differ, the hand touches something. Click to go to a moment.',
      ),
      el(
        'div',
        { class: 'row choices' },
        el('div', { class: 'row', hidden: runs.length < 2 }, el('label', { for: 'closing-run' }, 'Run'), this.which),
        el('div', { class: 'row' }, el('label', { for: 'closing-joints' }, 'Joints'), this.joints),
        spanChoice('closing-span', (span) => {
          for (const one of this.charts) one.zoom(span);
        }),
      ),
      this.angles.element,
      this.missing,
      this.motors.element,
      this.tension.element,
      el(
        'div',
        { class: 'actions' },
        button('Close', () => this.element.close()),
      ),
    );
    this.choose();
  }

  /** Opens the dialog with the cursor at a time, s. */
  open(time: number): void {
    this.element.showModal();
    this.draw();
    this.show(time);
  }

  show(time: number): void {
    if (this.element.open) for (const one of this.charts) one.show(time);
  }

  dispose(): void {
    for (const one of this.charts) one.dispose();
    this.element.remove();
  }

  private get charts(): Chart[] {
    return [this.angles, this.motors, this.tension];
  }

  private get run(): ChartedRun | undefined {
    return this.runs[Number(this.which.value) || 0];
  }

  private choose(): void {
    const names = this.run?.series.joints() ?? [];
    this.joints.replaceChildren(
      el('option', { value: '' }, names.length > MAX_JOINTS ? `the ${MAX_JOINTS} that move most` : 'all'),
      ...names.map((name) => el('option', { value: name }, name)),
    );
    this.draw();
  }

  private draw(): void {
    const series = this.run?.series;
    if (!series) return;
    const names = this.joints.value ? [this.joints.value] : series.joints().slice(0, MAX_JOINTS);
    const coloured = (of: Line[][]): Drawn[] =>
      of.flatMap((lines, k) => lines.map((line) => ({ line, paint: PAINTS[k % PAINTS.length] ?? 's1' })));
    const motors = series.motors();
    // The two lines of a motor have one colour.
    const pairs = series.hasTelemetry
      ? motors.flatMap((_, k) => (k % 2 === 0 ? [motors.slice(k, k + 2)] : []))
      : motors.map((line) => [line]);
    this.angles.draw(coloured(names.map((name) => series.joint(name))));
    this.motors.draw(coloured(pairs));
    this.tension.draw(coloured(series.motorTensions().map((line) => [line])));
    this.tension.element.hidden = !series.hasTelemetry;
    const predicted = series.hasTelemetry && names.some((name) => series.joint(name).length > 1);
    this.missing.hidden = predicted;
    this.missing.textContent = series.hasTelemetry
      ? 'There is no prediction for this hand.'
      : 'This file has no telemetry, because an older server recorded it. Reached motor position, tension and prediction are missing; rotations of links are computed from the poses.';
  }
}
