/** Poses between two frames of a live world: the newest frame is always where it ends, however many were missed. */
import { type Moment, POSE } from '../model/moment';

/** Longest time that a movement is spread over, ms; after a pause it jumps. */
const LONGEST_MS = 120;

/** Moves from what is shown to the newest moment within the time between the last two. */
export class PoseInterpolator {
  /** What is shown. */
  poses: Float32Array = new Float32Array();
  private from: Float32Array = new Float32Array();
  private to: Float32Array = new Float32Array();
  private begun = 0;
  private span = 0;
  private last = 0;

  /** Shows a moment at once. */
  jump(moment: Moment): void {
    this.poses = moment.poses.slice();
    this.from = this.poses;
    this.to = moment.poses;
    this.span = 0;
  }

  /** The next moment, which came at `now`, ms. */
  push(moment: Moment, now: number): void {
    if (moment.poses.length !== this.poses.length) {
      this.jump(moment);
    } else {
      this.from = this.poses.slice();
      this.to = moment.poses;
      this.span = Math.min(now - this.last, LONGEST_MS);
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

/** Straight for positions, the shorter way for orientations. */
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
