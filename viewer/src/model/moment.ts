/** A moment of a run: where everything is, and what the hand does and feels. */

/** What the motors, tendons and joints do. Angles in rad, tensions in the tendon's own unit. */
export interface Telemetry {
  /** σ asked for, σ reached, tension, and the work done on the tendons since reset (J; absent where it is not told), of each motor. */
  motors: { command: number; position: number; tension: number; work?: number | undefined }[];
  /** Of each tendon. */
  tension: number[];
  /** Joint coordinates. */
  q: number[];
  /** Where the free hand would rest at these motor positions; null where nothing can be said. */
  predicted: number[] | null;
  /** What each finger bears, world frame: force in N, and torque about the base's origin in N·m. */
  fingers?: { force: number[]; torque: number[] }[];
  /** Force on each taxel, N: along x and y of its patch, and into it. */
  touch?: number[][];
  /** Readings of sensors without errors, in the order of `scene.readings`. */
  readings?: number[];
}

/** Two bodies that touch. */
export interface Contact {
  a: number;
  b: number;
  /** m, in the world. */
  position: [number, number, number];
  /** On b, N. */
  force: [number, number, number];
  /** |tangential force| / (μ · normal force): 1 is where it slips. */
  use: number;
}

export interface Moment {
  tick: number;
  /** s since the run began. */
  time: number;
  score: number | null;
  /** x, y, z, qx, qy, qz, qw for each body of `scene.moving`. */
  poses: Float32Array;
  telemetry?: Telemetry;
  contacts?: Contact[];
}

/** Numbers of a pose. */
export const POSE = 7;
