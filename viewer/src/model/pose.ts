/** Positions (m), unit quaternions x, y, z, w, and poses. */
export type Vec3 = [number, number, number];
export type Quat = [number, number, number, number];
export interface Pose {
  position: Vec3;
  quat: Quat;
}

/** q v: the rotated vector. */
export function turned(q: Quat, v: Vec3): Vec3 {
  const [x, y, z, w] = q;
  const tx = 2 * (y * v[2] - z * v[1]);
  const ty = 2 * (z * v[0] - x * v[2]);
  const tz = 2 * (x * v[1] - y * v[0]);
  return [v[0] + w * tx + y * tz - z * ty, v[1] + w * ty + z * tx - x * tz, v[2] + w * tz + x * ty - y * tx];
}

/** The quaternion product a b. */
export function times(a: Quat, b: Quat): Quat {
  return [
    a[3] * b[0] + a[0] * b[3] + a[1] * b[2] - a[2] * b[1],
    a[3] * b[1] - a[0] * b[2] + a[1] * b[3] + a[2] * b[0],
    a[3] * b[2] + a[0] * b[1] - a[1] * b[0] + a[2] * b[3],
    a[3] * b[3] - a[0] * b[0] - a[1] * b[1] - a[2] * b[2],
  ];
}

/** a ∘ b: b, a pose in a's frame, in the frame of a's parent. */
export function composed(a: Pose, b: Pose): Pose {
  const [x, y, z] = turned(a.quat, b.position);
  return { position: [a.position[0] + x, a.position[1] + y, a.position[2] + z], quat: times(a.quat, b.quat) };
}

/** The rotation by `angle` (rad) about a unit axis. */
export function turnAbout(axis: Vec3, angle: number): Quat {
  const s = Math.sin(angle / 2);
  return [axis[0] * s, axis[1] * s, axis[2] * s, Math.cos(angle / 2)];
}
