/** Types of the page that are not in a message. SI units. */
import type { Quat, Vec3 } from '../model/pose';

export interface PoseTarget {
  position: Vec3;
  quat_xyzw: Quat;
}
/** A wrench on a link, about its origin, world frame: N, N·m. */
export interface Push {
  link: string;
  force: Vec3;
  torque: Vec3;
  duration_s: number;
}
