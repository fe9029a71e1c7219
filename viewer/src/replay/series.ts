/**
 * Lines of the charts, from a recording. Each value holds until the next. Times in s, angles in degrees, forces in N, tensions in the
 * hand's own unit.
 */
import type { TelemetryRecord } from '../wire/telemetry';
import type { Recording } from './recording';
import { type Turn, turns } from './link_angles';
import type { HandDescription } from '../wire/messages';

/** A quantity over time. Lines of the same record share their `times`. */
export interface Line {
  label: string;
  unit: string;
  times: number[];
  values: (number | null)[];
  /** A command or prediction, not a measurement. */
  dashed?: boolean;
}

const DEGREES = 180 / Math.PI;

/** Index of the last of ascending times at or before `time`; -1 if there is none. */
export function placeAt(times: ArrayLike<number>, time: number): number {
  let [low, high] = [-1, times.length];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if ((times[middle] ?? Infinity) <= time + 1e-9) low = middle;
    else high = middle;
  }
  return low;
}

/** A line's value at a time. */
export function valueAt(line: Line, time: number): number | null {
  return line.values[placeAt(line.times, time)] ?? null;
}

/** Difference of the greatest and the least value of a line. */
export function range(line: Line): number {
  let [least, most] = [Infinity, -Infinity];
  for (const value of line.values) {
    if (value === null) continue;
    least = Math.min(least, value);
    most = Math.max(most, value);
  }
  return most >= least ? most - least : 0;
}

/** A coordinate's unit: degrees for revolute joints, mm for prismatic joints. */
function unitOf(hand: HandDescription | undefined, coordinate: string): { unit: string; factor: number } {
  const hinges = hand?.links.filter((link) => link.coordinate === coordinate).flatMap((link) => link.hinges) ?? [];
  const slides = hinges.length > 0 && hinges.every((hinge) => hinge.kind === 'prismatic');
  return slides ? { unit: 'mm', factor: 1000 } : { unit: '°', factor: DEGREES };
}

/** All lines of a run. */
export class Series {
  /** Times of /telemetry and the end of the run, so that the last values extend to it. */
  private readonly times: number[];
  private readonly records: readonly TelemetryRecord[];
  private readonly hand: HandDescription | undefined;
  private rotations: Turn[] | null = null;

  constructor(private readonly recording: Recording) {
    this.records = recording.telemetry;
    this.hand = recording.scene.hand;
    this.times = this.records.map((record) => record.tick * recording.tickS);
    if (this.records.length > 0) this.times.push(Math.max(recording.duration, this.times.at(-1) ?? 0));
  }

  get hasTelemetry(): boolean {
    return this.records.length > 0;
  }

  private line(label: string, unit: string, of: (record: TelemetryRecord) => number | undefined, dashed = false): Line {
    const values = this.records.map((record) => of(record) ?? null);
    values.push(values.at(-1) ?? null);
    return { label, unit, times: this.times, values, dashed };
  }

  /** Commanded and reached σ; older files have only the commands. */
  motors(): Line[] {
    if (this.hasTelemetry) {
      const named = this.names(this.hand?.motors, this.records[0]?.position.length ?? 0, 'motor');
      return named.flatMap((name, k) => [
        this.line(`${name}, commanded`, 'σ', (record) => record.command[k], true),
        this.line(`${name}, reached`, 'σ', (record) => record.position[k]),
      ]);
    }
    const { actions, tickS } = this.recording;
    const times = actions.map((action) => action.tick * tickS);
    const width = Math.max(0, ...actions.slice(0, 1).map((action) => action.hand.length));
    return Array.from({ length: width }, (_, k) => ({
      label: width > 1 ? `motor ${k + 1}, commanded` : 'motor, commanded',
      unit: 'σ',
      times,
      values: actions.map((action) => action.hand[k] ?? null),
      dashed: true,
    }));
  }

  /** Tension of each motor. */
  motorTensions(): Line[] {
    if (!this.hasTelemetry) return [];
    return this.names(this.hand?.motors, this.records[0]?.motor_tension.length ?? 0, 'motor').map((name, k) =>
      this.line(`${name}, tension`, '', (record) => record.motor_tension[k]),
    );
  }

  /** Tension of each tendon. */
  tensions(): Line[] {
    if (!this.hasTelemetry) return [];
    return this.names(this.hand?.tendons, this.records[0]?.tension.length ?? 0, 'tendon').map((name, k) =>
      this.line(name, '', (record) => record.tension[k]),
    );
  }

  /** Names of the joints to choose from, those that move most first. */
  joints(): string[] {
    if (!this.hasTelemetry) return this.turns().map((turn) => turn.link);
    const names = this.names(this.hand?.coordinates, this.records[0]?.q.length ?? 0, 'joint');
    const moved = new Map(names.map((name) => [name, range(this.joint(name)[0] ?? { label: '', unit: '', times: [], values: [] })]));
    return names.sort((a, b) => (moved.get(b) ?? 0) - (moved.get(a) ?? 0));
  }

  /** Measured and, if available, predicted values of a joint. */
  joint(name: string): Line[] {
    if (!this.hasTelemetry) {
      const turn = this.turns().find((one) => one.link === name);
      return turn ? [{ label: `${name}, rotation`, unit: '°', times: turn.times, values: turn.degrees }] : [];
    }
    const k = this.names(this.hand?.coordinates, this.records[0]?.q.length ?? 0, 'joint').indexOf(name);
    if (k < 0) return [];
    const { unit, factor } = unitOf(this.hand, name);
    const scaled = (value: number | undefined): number | undefined => (value === undefined ? undefined : value * factor);
    const measured = this.line(`${name}, measured`, unit, (record) => scaled(record.q[k]));
    const predicted = this.line(`${name}, predicted`, unit, (record) => scaled(record.predicted[k]), true);
    return predicted.values.some((value) => value !== null) ? [measured, predicted] : [measured];
  }

  /** Contact force on a body, by the hand and by other bodies: sums of the contacts' magnitudes. */
  forces(body: number): Line[] {
    if (!this.hasTelemetry) return [];
    const links = new Set(this.recording.scene.bodies.filter((one) => one.kind === 'hand').map((one) => one.id));
    return [
      this.line('by the hand', 'N', (record) => pressed(record, body, (other) => links.has(other))),
      this.line('by other bodies', 'N', (record) => pressed(record, body, (other) => !links.has(other))),
    ];
  }

  score(): Line[] {
    if (!this.hasTelemetry) return [];
    const line = this.line('score', 'points', (record) => record.score);
    if (this.recording.outcome) line.values[line.values.length - 1] = this.recording.outcome.score;
    return [line];
  }

  private names(described: readonly { name: string }[] | undefined, count: number, kind: string): string[] {
    return Array.from({ length: count }, (_, k) => described?.[k]?.name ?? (count > 1 ? `${kind} ${k + 1}` : kind));
  }

  private turns(): Turn[] {
    this.rotations ??= turns(this.recording);
    return this.rotations;
  }
}

/** Sum of the force magnitudes of a body's contacts with the bodies that `counts` accepts, N. */
export function pressed(record: TelemetryRecord, body: number, counts: (other: number) => boolean): number {
  let sum = 0;
  record.contact_a.forEach((a, k) => {
    const b = record.contact_b[k] ?? -1;
    if (a !== body && b !== body) return;
    if (!counts(a === body ? b : a)) return;
    sum += Math.hypot(record.contact_force[3 * k] ?? 0, record.contact_force[3 * k + 1] ?? 0, record.contact_force[3 * k + 2] ?? 0);
  });
  return sum;
}
