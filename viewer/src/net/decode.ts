/** Binary frames of the subprotocol `palmares.v1.bin`; docs/protocol.md has their byte layout. */
import { type Contact, type Moment, POSE, type Telemetry } from '../model/moment';

const VERSION = 1;
const KEY_FRAME = 1;
const TELEMETRY = 2;
const CONTACTS = 4;
const LOADS = 8;
const READINGS = 16;

/** A quaternion in 32 bits: the index of its largest component, then the other three with 10 bits each. */
export function unpackQuaternion(packed: number): [number, number, number, number] {
  const largest = packed >>> 30;
  const value = (shift: number): number => ((((packed >>> shift) & 1023) / 1023) * 2 - 1) / Math.SQRT2;
  const others = [value(20), value(10), value(0)];
  const rest = Math.sqrt(Math.max(0, 1 - others.reduce((sum, x) => sum + x * x, 0)));
  others.splice(largest, 0, rest);
  return [others[0] ?? 0, others[1] ?? 0, others[2] ?? 0, others[3] ?? 1];
}

/** Reads little-endian numbers in sequence. */
class Cursor {
  private at = 0;
  constructor(private readonly view: DataView) {}
  u8(): number {
    this.at += 1;
    return this.view.getUint8(this.at - 1);
  }
  u16(): number {
    this.at += 2;
    return this.view.getUint16(this.at - 2, true);
  }
  u32(): number {
    this.at += 4;
    return this.view.getUint32(this.at - 4, true);
  }
  f32(): number {
    this.at += 4;
    return this.view.getFloat32(this.at - 4, true);
  }
  floats(count: number): number[] {
    return Array.from({ length: count }, () => this.f32());
  }
  vec(): [number, number, number] {
    return [this.f32(), this.f32(), this.f32()];
  }
}

function telemetry(cursor: Cursor): Telemetry {
  const motors = Array.from({ length: cursor.u8() }, () => ({ command: cursor.f32(), position: cursor.f32(), tension: cursor.f32() }));
  const tension = cursor.floats(cursor.u8());
  const joints = cursor.u8();
  const q = cursor.floats(joints);
  return { motors, tension, q, predicted: cursor.u8() === 1 ? cursor.floats(joints) : null };
}

/** Adds the work of the motors, fingers and taxels. */
function loads(cursor: Cursor, known: Telemetry): Telemetry {
  const work = cursor.floats(cursor.u8());
  const fingers = Array.from({ length: cursor.u8() }, () => ({ force: cursor.vec(), torque: cursor.vec() }));
  const touch = Array.from({ length: cursor.u16() }, () => cursor.vec());
  return { ...known, motors: known.motors.map((motor, k) => ({ ...motor, work: work[k] })), fingers, touch };
}

function contacts(cursor: Cursor): Contact[] {
  return Array.from({ length: cursor.u16() }, () => ({
    a: cursor.u16(),
    b: cursor.u16(),
    position: cursor.vec(),
    force: cursor.vec(),
    use: cursor.u8() / 255,
  }));
}

/** Decodes the frames of one run. A frame has only the bodies that moved; the others keep their poses. */
export class FrameReader {
  private poses: Float32Array;
  private complete = false;

  /** `moving`: number of moving bodies; `tickS`: length of a tick, s. */
  constructor(
    moving: number,
    private readonly tickS: number,
  ) {
    this.poses = new Float32Array(POSE * moving);
  }

  /** The moment of a frame; null before the first key frame. Throws if the bytes are not a valid frame. */
  read(data: ArrayBuffer): Moment | null {
    const cursor = new Cursor(new DataView(data));
    const version = cursor.u8();
    if (version !== VERSION)
      throw new Error(`the server sends frames of version ${version}, this page reads version ${VERSION}: reload the page`);
    const flags = cursor.u8();
    const count = cursor.u16();
    const tick = cursor.u32();
    const score = cursor.f32();
    this.complete ||= (flags & KEY_FRAME) !== 0;
    // A new array: the previous moment's poses may still be in use for interpolation.
    this.poses = this.poses.slice();
    for (let k = 0; k < count; k += 1) {
      const row = cursor.u16() * POSE;
      this.poses.set(cursor.vec(), row);
      this.poses.set(unpackQuaternion(cursor.u32()), row + 3);
    }
    const moment: Moment = { tick, time: tick * this.tickS, score, poses: this.poses };
    if (flags & TELEMETRY) moment.telemetry = telemetry(cursor);
    if (flags & CONTACTS) moment.contacts = contacts(cursor);
    if (flags & LOADS && moment.telemetry) moment.telemetry = loads(cursor, moment.telemetry);
    if (flags & READINGS && moment.telemetry) moment.telemetry.readings = cursor.floats(cursor.u16());
    return this.complete ? moment : null;
  }
}
