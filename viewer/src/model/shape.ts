/** Shapes that bodies touch with. SI units. */
import type { Vec3 } from './pose';

/** Convex, centred on its own frame; cylinders and capsules stand along z. A hull's rounding grows it, a box's does not. */
export type Shape =
  | { type: 'sphere'; radius: number }
  | { type: 'capsule' | 'cylinder'; radius: number; half_length: number }
  | { type: 'box'; half_extents: Vec3; rounding: number }
  | { type: 'hull'; points: Vec3[]; rounding: number };
