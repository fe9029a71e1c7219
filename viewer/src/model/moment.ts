/** One moment of a run: poses, telemetry of the hand, contacts. */

/** State of motors, tendons, joints and sensors. Angles in rad, tensions in the tendon's own unit. */
export interface Telemetry {
  /** For each motor: commanded σ, reached σ, tension, and its work on the tendons since reset (J; absent in older files). */
  motors: { command: number; position: number; tension: number; work?: number | undefined }[];
  /** One for each tendon. */
  tension: number[];
  /** Joint coordinates. */
  q: number[];
  /** Joint coordinates at which the hand would rest without contact at these motor positions; null if unknown. */
  predicted: number[] | null;
  /** Contact load on each finger, world frame: force in N, torque about the base's origin in N·m. */
  fingers?: { force: number[]; torque: number[] }[];
  /** Force on each taxel, N: along x and y of its patch, and into it. */
  touch?: number[][];
  /** Readings of sensors without errors, in the order of `scene.readings`. */
  readings?: number[];
}

/** A contact of two bodies. */
export interface Contact {
  a: number;
  b: number;
  /** m, in the world. */
  position: [number, number, number];
  /** Force on b, N. */
  force: [number, number, number];
  /** |tangential force| / (μ · normal force); at 1 it slips. */
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

/** Numbers in a pose. */
export const POSE = 7;
