/** Converts a replay's `foxglove.SceneUpdate` to bodies, with the same ids as on the watch socket. */
import type { Body, Part, Quat, Vec3 } from '../model/scene';
import type { CylinderPrimitive, FoxglovePose, Primitive, SceneEntity, TriangleListPrimitive, Vector3 } from '../wire/messages';

const vec = (v: Vector3): Vec3 => [v.x, v.y, v.z];
const place = (pose: FoxglovePose): { position: Vec3; quat: Quat } => ({
  position: vec(pose.position),
  quat: [pose.orientation.x, pose.orientation.y, pose.orientation.z, pose.orientation.w],
});

function parts(entity: SceneEntity): Part[] {
  const box = (s: Primitive): Part => ({
    ...place(s.pose),
    shape: { type: 'box', half_extents: [s.size.x / 2, s.size.y / 2, s.size.z / 2], rounding: 0 },
  });
  const sphere = (s: Primitive): Part => ({ ...place(s.pose), shape: { type: 'sphere', radius: s.size.x / 2 } });
  const cylinder = (s: CylinderPrimitive): Part => ({
    ...place(s.pose),
    shape: { type: 'cylinder', radius: s.size.x / 2, half_length: s.size.z / 2 },
  });
  const hull = (t: TriangleListPrimitive): Part => ({
    ...place(t.pose),
    shape: { type: 'hull', points: t.points.map(vec), rounding: 0 },
  });
  return [...entity.cubes.map(box), ...entity.spheres.map(sphere), ...entity.cylinders.map(cylinder), ...entity.triangles.map(hull)];
}

function color(entity: SceneEntity): Vec3 {
  const first = [...entity.cubes, ...entity.spheres, ...entity.cylinders, ...entity.triangles][0];
  return first ? [first.color.r, first.color.g, first.color.b] : [0.7, 0.7, 0.7];
}

/** A body and its frame. */
export interface FramedBody {
  body: Body;
  frame: string;
}

/** Converts all entities. Bodies of the scene have the first ids, the hand's links the ids after them. */
export function bodiesOf(entities: SceneEntity[]): FramedBody[] {
  const isLink = (entity: SceneEntity): boolean => entity.frame_id.startsWith('hand/');
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
