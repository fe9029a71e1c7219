/** Furniture as single panels: boards carry objects, walls are around them, the ground is below. */
import { Vector3 } from 'three';
import type { Body, Part, SceneInfo } from '../model/scene';
import { bodyBox, matrixOf } from './points';

/** Maximum thickness of a panel, as a share of its width. */
const THIN = 0.25;
/** A flat part with a larger half extent is the ground, m. */
const GROUND_M = 0.7;

/** A part of furniture, as a body with an id of its own. A camera on the side of `outward` looks at its outer face. */
export interface Panel {
  body: Body;
  outward: Vector3 | null;
  middle: Vector3;
}
export interface Furniture {
  panels: Panel[];
  grounds: Body[];
}

/** The unit normal of a thin box in the world; null for other parts. */
function normalOf(body: Body, part: Part): Vector3 | null {
  if (part.shape.type !== 'box') return null;
  const half = part.shape.half_extents;
  const thin = half.indexOf(Math.min(...half));
  if ((half[thin] ?? 0) >= THIN * Math.min(...half.filter((_, axis) => axis !== thin))) return null;
  return new Vector3().setComponent(thin, 1).transformDirection(matrixOf(part).premultiply(matrixOf(body)));
}

/** Splits furniture. The lowest board of a body has no outward side: it carries objects; a board above it is a lid. */
export function splitFurniture(info: SceneInfo): Furniture {
  const made: Furniture = { panels: [], grounds: [] };
  for (const body of info.bodies) {
    if (body.kind !== 'furniture') continue;
    const parts = body.parts.map((part) => {
      const normal = normalOf(body, part);
      const middle = bodyBox({ ...body, parts: [part] })
        .applyMatrix4(matrixOf(body))
        .getCenter(new Vector3());
      const flat = normal !== null && Math.abs(normal.z) > 0.9;
      return { part, normal, middle, flat, ground: flat && part.shape.type === 'box' && Math.max(...part.shape.half_extents) >= GROUND_M };
    });
    const boards = parts.filter(({ flat, ground }) => flat && !ground).sort((a, b) => a.middle.z - b.middle.z);
    const panels = parts.filter(({ ground }) => !ground);
    const centre = panels.reduce((sum, { middle }) => sum.add(middle), new Vector3()).divideScalar(Math.max(panels.length, 1));
    for (const one of parts) {
      if (one.ground) made.grounds.push({ ...body, parts: [one.part] });
      else {
        const out =
          one === boards[0] || !one.normal ? null : one.normal.multiplyScalar(one.normal.dot(one.middle.clone().sub(centre)) < 0 ? -1 : 1);
        made.panels.push({ body: { ...body, id: made.panels.length, parts: [one.part] }, outward: out, middle: one.middle });
      }
    }
  }
  return made;
}
