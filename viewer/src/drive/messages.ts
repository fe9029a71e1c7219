/** What the page drives with, beside the messages of the control socket. SI units. */
import type { Quat, Vec3 } from '../model/pose';

export interface PoseTarget { position: Vec3; quat_xyzw: Quat }
/** A wrench about a link's origin, in the world's frame: N, N·m. */
export interface Push { link: string; force: Vec3; torque: Vec3; duration_s: number }
