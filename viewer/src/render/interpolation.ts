/** Interpolates poses between two frames of a live run; the motion always ends at the newest frame. */
import { type Moment, POSE } from '../model/moment';

/** Maximum duration of an interpolation, ms; after a longer pause the poses jump. */
const MAX_MS = 120;

/** Moves from the shown poses to the newest moment in the time between the last two moments. */
export class PoseInterpolator {
  /** The shown poses. */
  poses: Float32Array = new Float32Array();
  private from: Float32Array = new Float32Array();
  private to: Float32Array = new Float32Array();
  private begun = 0;
  private span = 0;
  private last = 0;

  /** Shows a moment without interpolation. */
  jump(moment: Moment): void {
    this.poses = moment.poses.slice();
    this.from = this.poses;
    this.to = moment.poses;
    this.span = 0;
  }

  /** The next moment, received at `now`, ms. */
  push(moment: Moment, now: number): void {
    if (moment.poses.length !== this.poses.length) {
      this.jump(moment);
    } else {
      this.from = this.poses.slice();
      this.to = moment.poses;
      this.span = Math.min(now - this.last, MAX_MS);
      this.begun = now;
    }
    this.last = now;
  }

  /** Whether `poses` has changed since the last call. */
  advance(now: number): boolean {
    if (this.span <= 0) return false;
    const s = Math.min(Math.max((now - this.begun) / this.span, 0), 1);
    mixPoses(this.from, this.to, s, this.poses);
    if (s >= 1) this.span = 0;
    return true;
  }
}

/** Linear for positions, the shorter rotation for orientations. */
export function mixPoses(from: Float32Array, to: Float32Array, s: number, into: Float32Array): void {
  for (let row = 0; row + POSE <= into.length; row += POSE) {
    let dot = 0;
    for (let k = 3; k < POSE; k += 1) dot += (from[row + k] ?? 0) * (to[row + k] ?? 0);
    const sign = dot < 0 ? -1 : 1;
    let norm = 0;
    for (let k = 0; k < POSE; k += 1) {
      const value = (1 - s) * (from[row + k] ?? 0) + s * (k < 3 ? 1 : sign) * (to[row + k] ?? 0);
      into[row + k] = value;
      if (k >= 3) norm += value * value;
    }
    norm = Math.sqrt(norm) || 1;
    for (let k = 3; k < POSE; k += 1) into[row + k] = (into[row + k] ?? 0) / norm;
  }
}
