/** World poses of all moving bodies at each recorded moment. */
import type { FrameTransform } from './protobuf';

type Pose = Float64Array | number[];

/** Maximum duration of an interpolation, s; in a longer gap the poses first stay constant. */
const MAX_S = 0.1;

/** c = a ∘ b for poses x, y, z, qx, qy, qz, qw. */
export function compose(a: Pose, b: Pose): number[] {
  const [ax = 0, ay = 0, az = 0, ai = 0, aj = 0, ak = 0, aw = 1] = a;
  const [bx = 0, by = 0, bz = 0, bi = 0, bj = 0, bk = 0, bw = 1] = b;
  // v' = v + 2 u × (u × v + w v), u and w of a's quaternion.
  const tx = 2 * (aj * bz - ak * by);
  const ty = 2 * (ak * bx - ai * bz);
  const tz = 2 * (ai * by - aj * bx);
  return [
    ax + bx + aw * tx + (aj * tz - ak * ty),
    ay + by + aw * ty + (ak * tx - ai * tz),
    az + bz + aw * tz + (ai * ty - aj * tx),
    aw * bi + ai * bw + aj * bk - ak * bj,
    aw * bj - ai * bk + aj * bw + ak * bi,
    aw * bk + ai * bj - aj * bi + ak * bw,
    aw * bw - ai * bi - aj * bj - ak * bk,
  ];
}

/** A table with 7 numbers for each moment and moving body. */
export class PoseTable {
  /** Times of the moments, s. */
  readonly times: Float64Array;
  /** For each moving body the row of its parent frame; -1 for the world. */
  readonly parents: number[];
  private readonly rows: Float32Array;
  private readonly width: number;

  /** `frames`: the frame of each moving body; `messages`: changed transforms, in order of time. */
  constructor(frames: string[], messages: { time: number; transforms: FrameTransform[] }[]) {
    this.width = 7 * frames.length;
    this.times = Float64Array.from(messages, (message) => message.time);
    this.rows = new Float32Array(this.width * Math.max(messages.length, 1));
    const local = new Map<string, { parent: string; pose: number[] }>();
    messages.forEach(({ transforms }, moment) => {
      for (const { parent, child, pose } of transforms) local.set(child, { parent, pose });
      const world = new Map<string, number[]>();
      frames.forEach((frame, row) => this.rows.set(inWorld(frame, local, world), moment * this.width + 7 * row));
    });
    this.parents = frames.map((frame) => frames.indexOf(local.get(frame)?.parent ?? 'world'));
  }

  /** Index of the last moment at or before `time`. */
  momentAt(time: number): number {
    let [low, high] = [0, this.times.length];
    while (high - low > 1) {
      const middle = (low + high) >> 1;
      if ((this.times[middle] ?? Infinity) <= time + 1e-9) low = middle;
      else high = middle;
    }
    return low;
  }

  /** Recorded poses at the last moment at or before `time`, 7 numbers per body. */
  at(time: number): Float32Array {
    const begin = this.momentAt(time) * this.width;
    return this.rows.subarray(begin, begin + this.width);
  }

  /** Poses at `time`, interpolated linearly, rotations the shorter way. */
  between(time: number): Float32Array {
    const moment = this.momentAt(time);
    const [from, to] = [this.times[moment] ?? 0, this.times[moment + 1]];
    const before = this.at(time);
    if (to === undefined || to <= from) return before;
    // No message is written while nothing moves: the motion began at most MAX_S before the next message.
    const begun = Math.max(from, to - MAX_S);
    const s = Math.min(Math.max((time - begun) / (to - begun), 0), 1);
    const after = this.rows.subarray((moment + 1) * this.width, (moment + 2) * this.width);
    const mixed = new Float32Array(this.width);
    for (let row = 0; row < this.width; row += 7) mix(before, after, row, s, mixed);
    return mixed;
  }
}

function mix(a: Float32Array, b: Float32Array, row: number, s: number, into: Float32Array): void {
  let dot = 0;
  for (let k = 3; k < 7; k += 1) dot += (a[row + k] ?? 0) * (b[row + k] ?? 0);
  const sign = dot < 0 ? -1 : 1;
  let norm = 0;
  for (let k = 0; k < 7; k += 1) {
    const value = (1 - s) * (a[row + k] ?? 0) + s * (k < 3 ? 1 : sign) * (b[row + k] ?? 0);
    into[row + k] = value;
    if (k >= 3) norm += value * value;
  }
  norm = Math.sqrt(norm) || 1;
  for (let k = 3; k < 7; k += 1) into[row + k] = (into[row + k] ?? 0) / norm;
}

/** The world pose of a frame, through its parent frames. */
function inWorld(frame: string, local: Map<string, { parent: string; pose: number[] }>, known: Map<string, number[]>): number[] {
  const found = known.get(frame);
  if (found) return found;
  const here = local.get(frame);
  if (!here) return [0, 0, 0, 0, 0, 0, 1];
  const pose = here.parent === 'world' ? here.pose : compose(inWorld(here.parent, local, known), here.pose);
  known.set(frame, pose);
  return pose;
}
