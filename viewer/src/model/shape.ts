/** Collision shapes. SI units. */
import type { Vec3 } from './pose';

/** Convex and centred on its own frame; the axis of cylinders and capsules is z. Rounding enlarges a hull, but not a box. */
export type Shape =
  | { type: 'sphere'; radius: number }
  | { type: 'capsule' | 'cylinder'; radius: number; half_length: number }
  | { type: 'box'; half_extents: Vec3; rounding: number }
  | { type: 'hull'; points: Vec3[]; rounding: number };
