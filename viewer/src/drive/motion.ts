/** Converts the deflection of keys and sticks to a velocity of the base. */
import { turned } from '../model/pose';
import type { Quat, Vec3 } from '../model/scene';

/** Deflection from −1 to 1: movement right, forward, up; rotation about these axes. */
export interface Axes {
  move: Vec3;
  turn: Vec3;
}
/** The frame of the directions: camera, world or hand. */
export type FrameName = 'view' | 'world' | 'hand';
/** m/s and rad/s. */
export interface Twist {
  linear: Vec3;
  angular: Vec3;
}

export const STILL: Axes = { move: [0, 0, 0], turn: [0, 0, 0] };

const clamped = (x: number): number => Math.min(Math.max(x, -1), 1);
const sum = (a: Vec3, b: Vec3): Vec3 => [clamped(a[0] + b[0]), clamped(a[1] + b[1]), clamped(a[2] + b[2])];
/** Rounds, so that sent and recorded numbers are short: 0.1 mm/s, 0.0001 rad/s. */
const short = (v: Vec3): Vec3 => [Math.round(v[0] * 1e4) / 1e4 + 0, Math.round(v[1] * 1e4) / 1e4 + 0, Math.round(v[2] * 1e4) / 1e4 + 0];

/** The sum of keys and sticks. */
export function sumOf(a: Axes, b: Axes): Axes {
  return { move: sum(a.move, b.move), turn: sum(a.turn, b.turn) };
}

export function isStill(axes: Axes): boolean {
  return [...axes.move, ...axes.turn].every((x) => x === 0);
}

/** A direction from its frame to the world; `right` is the camera's right. */
function inWorld(v: Vec3, frame: FrameName, right: Vec3, hand: Quat): Vec3 {
  if (frame === 'hand') return turned(hand, v);
  if (frame === 'world') return v;
  const length = Math.hypot(right[0], right[1]);
  const [c, s] = length > 1e-6 ? [right[0] / length, right[1] / length] : [1, 0];
  return [c * v[0] - s * v[1], s * v[0] + c * v[1], v[2]];
}

/** The velocity for a deflection; `linear` (m/s) and `angular` (rad/s) are the values at full deflection. */
export function twistOf(axes: Axes, frame: FrameName, right: Vec3, hand: Quat, linear: number, angular: number): Twist {
  const move = inWorld(axes.move, frame, right, hand);
  const turn = inWorld(axes.turn, frame, right, hand);
  return {
    linear: short([linear * move[0], linear * move[1], linear * move[2]]),
    angular: short([angular * turn[0], angular * turn[1], angular * turn[2]]),
  };
}
