/** Orientations of the base: palm up, down, to the side. The palm's direction is estimated from how the fingers close. */
import { Matrix4, Quaternion, Vector3 } from 'three';
import { palmOf } from '../model/palm';
import type { Quat, Vec3 } from '../model/pose';
import type { HandDescription } from '../wire/messages';

export type Posture = 'model' | 'palm-up' | 'palm-down' | 'palm-side' | 'fingers-down';

export const POSTURES: readonly (readonly [Posture, string])[] = [
  ['model', 'as in its model'],
  ['palm-up', 'palm up'],
  ['palm-down', 'palm down'],
  ['palm-side', 'palm to the side'],
  ['fingers-down', 'fingers down'],
];

/** A right-handed basis: first vector `a`, second towards `b`, or any direction if `b` is parallel to `a`. */
function basis(a: Vec3, b: Vec3): Matrix4 {
  const first = new Vector3(...a).normalize();
  const second = new Vector3(...b).addScaledVector(first, -first.dot(new Vector3(...b)));
  if (second.length() < 0.1 * Math.hypot(...b)) second.set(1, 0, 0).addScaledVector(first, -first.x);
  if (second.length() < 0.1) second.set(0, 1, 0).addScaledVector(first, -first.y);
  second.normalize();
  return new Matrix4().makeBasis(first, second, new Vector3().crossVectors(first, second));
}

/** The rotation that takes `a` to `toA`, and `b` as close as possible to `toB`. */
export function turnTo(a: Vec3, toA: Vec3, b: Vec3, toB: Vec3): Quat {
  const turn = basis(toA, toB).multiply(basis(a, b).transpose());
  const q = new Quaternion().setFromRotationMatrix(turn);
  return [q.x, q.y, q.z, q.w];
}

/** The base's orientation in the world, z up. */
export function baseTurn(hand: HandDescription, posture: Posture): Quat {
  const { direction: palm, middle: fingers } = palmOf(hand);
  const aside: Vec3 = [1, 0, 0];
  switch (posture) {
    case 'model':
      return [0, 0, 0, 1];
    case 'palm-up':
      return turnTo(palm, [0, 0, 1], fingers, aside);
    case 'palm-down':
      return turnTo(palm, [0, 0, -1], fingers, aside);
    case 'palm-side':
      return turnTo(palm, [0, -1, 0], fingers, aside);
    case 'fingers-down':
      return turnTo(fingers, [0, 0, -1], palm, [0, -1, 0]);
  }
}
