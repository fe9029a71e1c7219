/** Triangle geometry of bodies: all parts of a body in one geometry with an index and normals, fine or coarse. */
import {
  BoxGeometry,
  BufferAttribute,
  BufferGeometry,
  CapsuleGeometry,
  CylinderGeometry,
  Matrix4,
  Quaternion,
  SphereGeometry,
  Vector3,
} from 'three';
import { ConvexGeometry } from 'three/addons/geometries/ConvexGeometry.js';
import { RoundedBoxGeometry } from 'three/addons/geometries/RoundedBoxGeometry.js';
import { mergeGeometries } from 'three/addons/utils/BufferGeometryUtils.js';
import type { Mesh, Part, Vec3 } from '../model/scene';
import type { Shape } from '../wire/messages';

/** A hull with more points is drawn without its rounding, which would multiply them by twelve. */
const ROUNDED_POINTS = 150;

/** Directions to the corners of an icosahedron, and of an octahedron. */
const AROUND: Vec3[] = (() => {
  const golden = (1 + Math.sqrt(5)) / 2;
  const norm = Math.hypot(1, golden);
  const [a, b] = [1 / norm, golden / norm];
  const signs: [number, number][] = [
    [1, 1],
    [1, -1],
    [-1, 1],
    [-1, -1],
  ];
  return signs.flatMap(([s, t]): Vec3[] => [
    [0, s * a, t * b],
    [s * a, t * b, 0],
    [t * b, 0, s * a],
  ]);
})();

const ROUGHLY_AROUND: Vec3[] = [
  [1, 0, 0],
  [-1, 0, 0],
  [0, 1, 0],
  [0, -1, 0],
  [0, 0, 1],
  [0, 0, -1],
];

function hull(points: Vec3[], rounding: number, fine: boolean): BufferGeometry {
  const grown =
    rounding > 0 && points.length <= ROUNDED_POINTS
      ? points.flatMap((p) =>
          (fine ? AROUND : ROUGHLY_AROUND).map((d) => new Vector3(p[0] + rounding * d[0], p[1] + rounding * d[1], p[2] + rounding * d[2])),
        )
      : points.map((p) => new Vector3(...p));
  return new ConvexGeometry(grown);
}

function solid(shape: Shape | Mesh, fine: boolean): BufferGeometry {
  switch (shape.type) {
    case 'sphere':
      return fine ? new SphereGeometry(shape.radius, 28, 18) : new SphereGeometry(shape.radius, 14, 9);
    case 'capsule':
      return new CapsuleGeometry(shape.radius, 2 * shape.half_length, fine ? 6 : 3, fine ? 18 : 9).rotateX(Math.PI / 2);
    case 'cylinder':
      return new CylinderGeometry(shape.radius, shape.radius, 2 * shape.half_length, fine ? 32 : 16).rotateX(Math.PI / 2);
    case 'box': {
      const [x, y, z] = shape.half_extents;
      const round = Math.min(shape.rounding, x, y, z);
      return round > 0 && fine ? new RoundedBoxGeometry(2 * x, 2 * y, 2 * z, 3, round) : new BoxGeometry(2 * x, 2 * y, 2 * z);
    }
    case 'hull':
      return hull(shape.points, shape.rounding, fine);
    case 'mesh': {
      const made = new BufferGeometry().setAttribute('position', new BufferAttribute(shape.corners.slice(), 3));
      made.computeVertexNormals();
      return made;
    }
  }
}

/** The parts of a body as one geometry in the body's frame. */
export function geometryOf(parts: Part[], fine: boolean): BufferGeometry {
  const pieces = parts.map((part) => {
    const made = solid(part.shape, fine);
    // Geometries can be merged if all have an index. Corners that triangles share are transformed once.
    if (!made.index) made.setIndex(Array.from({ length: made.getAttribute('position').count }, (_, k) => k));
    for (const name of Object.keys(made.attributes)) if (name !== 'position' && name !== 'normal') made.deleteAttribute(name);
    const place = new Matrix4().compose(new Vector3(...part.position), new Quaternion(...part.quat), new Vector3(1, 1, 1));
    return made.applyMatrix4(place);
  });
  const merged = pieces.length > 0 ? mergeGeometries(pieces) : new BufferGeometry();
  for (const piece of pieces) if (piece !== merged) piece.dispose();
  return merged;
}
