/** The moment of a replay at a time. */
import type { Contact, Moment, Telemetry } from '../model/moment';
import type { TelemetryRecord } from '../wire/telemetry';
import type { Recording } from './recording';

/** The last record at or before a tick; undefined if there is none. */
function recordAt(records: readonly TelemetryRecord[], tick: number): TelemetryRecord | undefined {
  let [low, high] = [0, records.length];
  while (high - low > 1) {
    const middle = (low + high) >> 1;
    if ((records[middle]?.tick ?? Infinity) <= tick) low = middle;
    else high = middle;
  }
  const found = records[low];
  return found && found.tick <= tick ? found : undefined;
}

const triple = (of: number[], k: number): [number, number, number] => [of[3 * k] ?? 0, of[3 * k + 1] ?? 0, of[3 * k + 2] ?? 0];
const triples = (of: number[]): [number, number, number][] => Array.from({ length: Math.floor(of.length / 3) }, (_, k) => triple(of, k));

function telemetryOf(record: TelemetryRecord): Telemetry {
  return {
    motors: record.position.map((position, k) => ({
      command: record.command[k] ?? position,
      position,
      tension: record.motor_tension[k] ?? 0,
      work: record.work[k],
    })),
    tension: record.tension,
    q: record.q,
    predicted: record.predicted.length > 0 ? record.predicted : null,
    fingers: triples(record.finger_force).map((force, k) => ({ force, torque: triple(record.finger_torque, k) })),
    touch: triples(record.touch),
    readings: record.readings,
  };
}

function contactsOf(record: TelemetryRecord): Contact[] {
  return record.contact_a.map((a, k) => ({
    a,
    b: record.contact_b[k] ?? 0,
    position: triple(record.contact_position, k),
    force: triple(record.contact_force, k),
    use: record.contact_use[k] ?? 0,
  }));
}

/** The moment at `time`, s; `exact`: recorded poses, otherwise interpolated ones. */
export function momentAt(recording: Recording, time: number, exact: boolean): Moment {
  const tick = Math.round(time / recording.tickS);
  const record = recordAt(recording.telemetry, tick);
  // The final count goes by position alone, so it can differ from the last running one.
  const over = recording.outcome !== null && tick >= Math.round(recording.duration / recording.tickS);
  const moment: Moment = {
    tick,
    time,
    score: over ? (recording.outcome?.score ?? null) : (record?.score ?? null),
    poses: exact ? recording.poses.at(time) : recording.poses.between(time),
  };
  if (record) {
    moment.telemetry = telemetryOf(record);
    moment.contacts = contactsOf(record);
  }
  return moment;
}
