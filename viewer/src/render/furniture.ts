/** Furniture: boards that carry objects are opaque and receive shadows; walls, lids and the ground are transparent. */
import { Quaternion, Vector3 } from 'three';
import type { Body, Part } from '../model/scene';

/** Maximum thickness of a board, as a share of its width. */
const THIN = 0.25;
/** A part with a larger half extent is the ground, m. */
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
  return Math.abs(normal.z) > 0.9 && (half[thin] ?? 0) < THIN * Math.min(...others) && Math.max(...half) < GROUND_M;
}

/** Splits furniture into boards and walls, each as a separate body. */
export function splitFurniture(furniture: readonly Body[]): { boards: Body[]; walls: Body[] } {
  const boards: Body[] = [];
  const walls: Body[] = [];
  for (const body of furniture) {
    const flat = body.parts.filter((part) => isFlat(body, part)).sort((a, b) => height(body, a) - height(body, b));
    // The lowest board carries objects; a board above it is a lid.
    const [board] = flat;
    if (board) boards.push({ ...body, parts: [board] });
    const rest = body.parts.filter((part) => part !== board);
    if (rest.length > 0) walls.push({ ...body, parts: rest });
  }
  return { boards, walls };
}
