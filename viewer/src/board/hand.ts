/** The part of a hand's description (`GET /v1/hands/{name}`) that a picture of it needs. SI units, poses at rest. */
export type Triple = [number, number, number];
export type Quad = [number, number, number, number];
export interface Placement { position: Triple; quat_xyzw: Quad }

/** Convex, centred on its own frame; cylinders and capsules stand along z. */
export type Shape =
  | { type: 'sphere'; radius: number }
  | { type: 'capsule' | 'cylinder'; radius: number; half_length: number }
  | { type: 'box'; half_extents: Triple; rounding: number }
  | { type: 'hull'; points: Triple[]; rounding: number };

export interface HandLink { name: string; base_from_link_at_rest: Placement; shapes: (Placement & { shape: Shape })[] }
export interface HandPicture { name: string; links: HandLink[] }
