/** Boxes around bodies and their parts, and the points that a camera of a scene shows. */
import { Box3, Matrix4, Quaternion, Vector3 } from 'three';
import type { Body, Part, SceneInfo } from '../model/scene';

const ONE = new Vector3(1, 1, 1);

/** A pose as a matrix. */
export function matrixOf({ position, quat }: Pick<Body, 'position' | 'quat'>): Matrix4 {
  return new Matrix4().compose(new Vector3(...position), new Quaternion(...quat), ONE);
}

/** The box around a part, in the part's own frame, m. */
export function boxOf({ shape }: Part): Box3 {
  const upTo = (x: number, y: number, z: number): Box3 => new Box3(new Vector3(-x, -y, -z), new Vector3(x, y, z));
  switch (shape.type) {
    case 'sphere':
      return upTo(shape.radius, shape.radius, shape.radius);
    case 'capsule':
      return upTo(shape.radius, shape.radius, shape.half_length + shape.radius);
    case 'cylinder':
      return upTo(shape.radius, shape.radius, shape.half_length);
    case 'box':
      return upTo(...shape.half_extents);
    case 'hull':
      return new Box3().setFromPoints(shape.points.map((point) => new Vector3(...point))).expandByScalar(shape.rounding);
    case 'mesh':
      return new Box3().setFromArray(shape.corners);
  }
}

/** The box around all parts of a body, in the body's frame; empty without parts. */
export function bodyBox(body: Body): Box3 {
  return body.parts.reduce((box, part) => box.union(boxOf(part).applyMatrix4(matrixOf(part))), new Box3());
}

/** The corners of a box. */
export function cornersOf({ min, max }: Box3): Vector3[] {
  return Array.from({ length: 8 }, (_, k) => new Vector3(k & 1 ? max.x : min.x, k & 2 ? max.y : min.y, k & 4 ? max.z : min.z));
}

/** Corners of the boxes around a body's parts, in the world. */
function around(body: Body): Vector3[] {
  const place = matrixOf(body);
  return body.parts.flatMap((part) => {
    const own = matrixOf(part).premultiply(place);
    return cornersOf(boxOf(part)).map((corner) => corner.applyMatrix4(own));
  });
}

/** The corners of regions and objects; those of the hand if there is nothing else; never empty. */
export function scenePoints(info: SceneInfo): Vector3[] {
  const regions = info.regions.flatMap(({ min, max }) => cornersOf(new Box3(new Vector3(...min), new Vector3(...max))));
  const of = (kind: Body['kind']): Vector3[] => info.bodies.filter((body) => body.kind === kind).flatMap(around);
  const fixed = [...of('object'), ...regions];
  const all = fixed.length > 0 ? fixed : of('hand');
  return all.length > 0 ? all : cornersOf(new Box3(new Vector3(-0.3, -0.3, 0), new Vector3(0.3, 0.3, 0.4)));
}
