/** Points around a scene, for a camera that shows all of it. */
import { Quaternion, Vector3 } from 'three';
import type { Body, Part, SceneInfo, Vec3 } from '../model/scene';

/** Distance of a part's surface from its own origin along each axis, m. */
function reach({ shape }: Part): Vec3 {
  switch (shape.type) {
    case 'sphere': return [shape.radius, shape.radius, shape.radius];
    case 'capsule': return [shape.radius, shape.radius, shape.half_length + shape.radius];
    case 'cylinder': return [shape.radius, shape.radius, shape.half_length];
    case 'box': return shape.half_extents;
    case 'hull': return farthest(shape.points, shape.rounding);
    case 'mesh': return farthest(Array.from({ length: shape.corners.length / 3 }, (_, k) => [...shape.corners.subarray(3 * k, 3 * k + 3)]), 0);
  }
}

function farthest(points: readonly (readonly number[])[], rounding: number): Vec3 {
  const along = (axis: number): number => points.reduce((most, point) => Math.max(most, Math.abs(point[axis] ?? 0)), 0) + rounding;
  return [along(0), along(1), along(2)];
}

const corners = (min: readonly number[], max: readonly number[]): Vector3[] =>
  Array.from({ length: 8 }, (_, k) => new Vector3(...[0, 1, 2].map((axis) => ((k >> axis) & 1 ? max[axis] : min[axis]) ?? 0) as Vec3));

/** Corners of the boxes around a body's parts, in the world. */
function around(body: Body): Vector3[] {
  const [turn, at] = [new Quaternion(...body.quat), new Vector3(...body.position)];
  return body.parts.flatMap((part) => {
    const half = reach(part);
    const [own, place] = [new Quaternion(...part.quat), new Vector3(...part.position)];
    return corners(half.map((x) => -x), half).map((corner) => corner.applyQuaternion(own).add(place).applyQuaternion(turn).add(at));
  });
}

/** The corners of regions, objects and the hand; never empty. */
export function pointsOf(info: SceneInfo): Vector3[] {
  const moving = info.bodies.filter((body) => body.kind !== 'furniture').flatMap(around);
  const regions = info.regions.flatMap((region) => corners(region.min, region.max));
  const all = [...moving, ...regions];
  return all.length > 0 ? all : corners([-0.3, -0.3, 0], [0.3, 0.3, 0.4]);
}
