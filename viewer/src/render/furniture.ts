/** Furniture: boards that carry objects are opaque and receive shadows; walls and lids are transparent; the ground is apart. */
import { Quaternion, Vector3 } from 'three';
import type { Body, Part } from '../model/scene';

/** Maximum thickness of a board, as a share of its width. */
const THIN = 0.25;
/** A flat part with a larger half extent is the ground, m. */
const GROUND_M = 0.7;

/** World height of a part's centre, m. */
function height(body: Body, part: Part): number {
  return new Vector3(...part.position).applyQuaternion(new Quaternion(...body.quat)).z + body.position[2];
}

/** Whether a part is a horizontal board. */
function isFlat(body: Body, part: Part): boolean {
  if (part.shape.type !== 'box') return false;
  const half = part.shape.half_extents;
  const thin = half.indexOf(Math.min(...half));
  const normal = new Vector3().setComponent(thin, 1).applyQuaternion(new Quaternion(...part.quat)).applyQuaternion(new Quaternion(...body.quat));
  const others = half.filter((_, axis) => axis !== thin);
  return Math.abs(normal.z) > 0.9 && (half[thin] ?? 0) < THIN * Math.min(...others);
}

/** Whether a horizontal board is the ground. */
function isGround({ shape }: Part): boolean {
  return shape.type === 'box' && Math.max(...shape.half_extents) >= GROUND_M;
}

/** Furniture in three kinds, each body with the parts of one kind. */
export interface Furniture { boards: Body[]; walls: Body[]; grounds: Body[] }

/** Splits furniture into boards, walls and the ground. */
export function splitFurniture(furniture: readonly Body[]): Furniture {
  const made: Furniture = { boards: [], walls: [], grounds: [] };
  for (const body of furniture) {
    const flat = body.parts.filter((part) => isFlat(body, part)).sort((a, b) => height(body, a) - height(body, b));
    const ground = flat.filter(isGround);
    // The lowest board carries objects; a board above it is a lid.
    const board = flat.filter((part) => !isGround(part)).slice(0, 1);
    const walls = body.parts.filter((part) => !ground.includes(part) && !board.includes(part));
    for (const [kind, parts] of [['boards', board], ['walls', walls], ['grounds', ground]] as const) {
      if (parts.length > 0) made[kind].push({ ...body, parts });
    }
  }
  return made;
}
