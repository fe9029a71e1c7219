/** The equilibrium of a hand: request and response of the server. SI units; tensions in the tendon's own unit. */
import { composed, type Pose, turned } from '../model/pose';
import type { Vec3 } from '../model/scene';
import type { EquilibriumResponse, EquilibriumRequest } from '../wire/messages';

/** A virtual force or a held point, at `point` in the link's frame (m). */
export interface Load {
  id: number;
  kind: 'force' | 'hold';
  link: string;
  point: Vec3;
  /** Force, N, world frame. */
  force: Vec3;
  /** Position of a held point, m, world frame. */
  place: Vec3;
}

/** Maximum number of loads of each kind. */
export const MAX_LOADS = 32;
/** Maximum force, N. */
export const MAX_FORCE = 200;

/** The request for the shown state. */
export function equilibriumRequest(motors: readonly number[], base: Pose, loads: readonly Load[]): EquilibriumRequest {
  const of = (kind: Load['kind']): Load[] => loads.filter((load) => load.kind === kind);
  return {
    motors: [...motors],
    base: { position: base.position, quat_xyzw: base.quat },
    forces: of('force')
      .filter((load) => Math.hypot(...load.force) > 0)
      .map(({ link, point, force }) => ({ link, point, force })),
    contacts: of('hold').map(({ link, point, place }) => ({ link, point, position: place })),
  };
}

/** The reaction at a held point; null for forces and before the response. */
export function reactionOf(
  load: Load,
  loads: readonly Load[],
  rest: EquilibriumResponse | null,
): EquilibriumResponse['reactions'][number] | null {
  if (load.kind !== 'hold') return null;
  return rest?.reactions[loads.filter((one) => one.kind === 'hold').indexOf(load)] ?? null;
}

/** A point from a link's frame to the world. */
export function inWorld(link: Pose, point: Vec3): Vec3 {
  return composed(link, { position: point, quat: [0, 0, 0, 1] }).position;
}

/** A point from the world to a link's frame. */
export function inLink({ position, quat }: Pose, at: Vec3): Vec3 {
  const away: Vec3 = [at[0] - position[0], at[1] - position[1], at[2] - position[2]];
  return turned([-quat[0], -quat[1], -quat[2], quat[3]], away);
}

/** Rounds to 1 / `by`, so that numbers stay readable. */
export function rounded(v: Vec3, by: number): Vec3 {
  return v.map((x) => Math.round(x * by) / by + 0) as Vec3;
}

/** Limits a force to the server's maximum. */
export function clampForce(force: Vec3): Vec3 {
  const size = Math.hypot(...force);
  const share = size > MAX_FORCE ? (0.999 * MAX_FORCE) / size : 1;
  return rounded([force[0] * share, force[1] * share, force[2] * share], 1e3);
}
