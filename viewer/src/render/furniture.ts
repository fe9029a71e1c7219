/** Furniture: what things stand on is solid and takes shadows; walls, lids and the ground are looked through. */
import { Quaternion, Vector3 } from 'three';
import type { Body, Part } from '../model/scene';

/** A board is at most so thick, as a share of its width. */
const THIN = 0.25;
/** What is larger is the ground, m. */
const GROUND_M = 0.7;

/** Height of a part's middle in the world, m. */
function height(body: Body, part: Part): number {
  return new Vector3(...part.position).applyQuaternion(new Quaternion(...body.quat)).z + body.position[2];
}

/** Whether a part is a box that lies flat in the world. */
function isFlat(body: Body, part: Part): boolean {
  if (part.shape.type !== 'box') return false;
  const half = part.shape.half_extents;
  const thin = half.indexOf(Math.min(...half));
  const normal = new Vector3().setComponent(thin, 1).applyQuaternion(new Quaternion(...part.quat)).applyQuaternion(new Quaternion(...body.quat));
  const others = half.filter((_, axis) => axis !== thin);
  return Math.abs(normal.z) > 0.9 && (half[thin] ?? 0) < THIN * Math.min(...others) && Math.max(...half) < GROUND_M;
}

/** The boards and the walls of furniture, as bodies of their own. */
export function splitFurniture(furniture: readonly Body[]): { boards: Body[]; walls: Body[] } {
  const boards: Body[] = [];
  const walls: Body[] = [];
  for (const body of furniture) {
    const flat = body.parts.filter((part) => isFlat(body, part)).sort((a, b) => height(body, a) - height(body, b));
    // What lies above another board is a lid.
    const [board] = flat;
    if (board) boards.push({ ...body, parts: [board] });
    const rest = body.parts.filter((part) => part !== board);
    if (rest.length > 0) walls.push({ ...body, parts: rest });
  }
  return { boards, walls };
}
