/** Converts a replay's `foxglove.SceneUpdate` to bodies, with the same ids as on the watch socket. */
import type { Body, Part, Quat, Vec3 } from '../model/scene';

interface Xyz { x: number; y: number; z: number }
interface Placed { position: Xyz; orientation: Xyz & { w: number } }
interface Color { r: number; g: number; b: number }
interface Sized { pose: Placed; size: Xyz; color: Color }
interface Triangles { pose: Placed; points: Xyz[]; color: Color }

/** The drawn part of an entity. */
export interface Entity {
  frame_id: string;
  id: string;
  cubes: Sized[];
  spheres: Sized[];
  cylinders: Sized[];
  triangles: Triangles[];
}

const vec = (v: Xyz): Vec3 => [v.x, v.y, v.z];
const place = (pose: Placed): { position: Vec3; quat: Quat } => ({
  position: vec(pose.position),
  quat: [pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w],
});

function parts(entity: Entity): Part[] {
  const box = (s: Sized): Part => ({
    ...place(s.pose),
    shape: { type: 'box', half_extents: [s.size.x / 2, s.size.y / 2, s.size.z / 2], rounding: 0 },
  });
  const sphere = (s: Sized): Part => ({ ...place(s.pose), shape: { type: 'sphere', radius: s.size.x / 2 } });
  const cylinder = (s: Sized): Part => ({
    ...place(s.pose),
    shape: { type: 'cylinder', radius: s.size.x / 2, half_length: s.size.z / 2 },
  });
  const hull = (t: Triangles): Part => ({
    ...place(t.pose),
    shape: { type: 'hull', points: t.points.map(vec), rounding: 0 },
  });
  return [...entity.cubes.map(box), ...entity.spheres.map(sphere), ...entity.cylinders.map(cylinder), ...entity.triangles.map(hull)];
}

function color(entity: Entity): Vec3 {
  const first = [...entity.cubes, ...entity.spheres, ...entity.cylinders, ...entity.triangles][0];
  return first ? [first.color.r, first.color.g, first.color.b] : [0.7, 0.7, 0.7];
}

/** A body and its frame. */
export interface FramedBody {
  body: Body;
  frame: string;
}

/** Converts all entities. Bodies of the scene have the first ids, the hand's links the ids after them. */
export function bodiesOf(entities: Entity[]): FramedBody[] {
  const isLink = (entity: Entity): boolean => entity.frame_id.startsWith('hand/');
  const ordered = [...entities.filter((entity) => !isLink(entity)), ...entities.filter(isLink)];
  return ordered.map((entity, id) => {
    const hand = isLink(entity);
    const fixed = entity.frame_id === 'world';
    return {
      frame: entity.frame_id,
      body: {
        id,
        name: hand ? entity.id.slice('hand/'.length) : entity.id,
        kind: hand ? 'hand' : fixed ? 'furniture' : 'object',
        position: [0, 0, 0],
        quat: [0, 0, 0, 1],
        parts: parts(entity),
        color: color(entity),
      },
    };
  });
}
