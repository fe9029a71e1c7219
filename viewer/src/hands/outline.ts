/** Outlines of a hand at rest in any view: the 2D hull of each convex shape's projected points. m. */
import { turned as rotated, type Vec3 } from '../model/pose';
import type { HandDescription, LinkDescription, PoseDescription, Shape } from '../wire/messages';

/** The part of a hand's description that its drawing needs. */
export type HandShapes = Pick<HandDescription, 'name'> & { links: Pick<LinkDescription, 'base_from_link_at_rest' | 'shapes'>[] };

/** The outline of a shape: corners in m (x right, y up), and depth (greater is nearer). */
export interface Outline {
  link: number;
  depth: number;
  corners: [number, number][];
}

/** A view as the rows of a rotation: right, up, towards the viewer. */
export interface View {
  right: Vec3;
  up: Vec3;
  near: Vec3;
}

/** Views for a hand frame with fingers along +z, palm normal +x, thumb +y. */
export const VIEWS = {
  palm: { right: [0, 1, 0], up: [0, 0, 1], near: [1, 0, 0] },
  side: { right: [1, 0, 0], up: [0, 0, 1], near: [0, -1, 0] },
  top: { right: [0, 1, 0], up: [-1, 0, 0], near: [0, 0, 1] },
} as const satisfies Record<string, View>;

/** Turned by an angle (rad) about the fingers' axis, from a little above. */
export function turntable(angle: number, tilt = 0.35): View {
  const [c, s, ct, st] = [Math.cos(angle), Math.sin(angle), Math.cos(tilt), Math.sin(tilt)];
  return { right: [-s, c, 0], up: [-c * st, -s * st, ct], near: [c * ct, s * ct, st] };
}

const dot = (a: Vec3, b: Vec3): number => a[0] * b[0] + a[1] * b[1] + a[2] * b[2];

/** A point from a frame to the parent frame. */
export function place({ position: p, quat_xyzw }: PoseDescription, v: Vec3): Vec3 {
  const t = rotated(quat_xyzw, v);
  return [p[0] + t[0], p[1] + t[1], p[2] + t[2]];
}

/** Evenly distributed directions, for round shapes. */
const AROUND: Vec3[] = Array.from({ length: 96 }, (_, i) => {
  const z = 1 - (2 * i + 1) / 96;
  const [r, a] = [Math.sqrt(1 - z * z), i * 2.399963];
  return [r * Math.cos(a), r * Math.sin(a), z];
});

/** Points whose hull approximates the shape. */
export function surface(shape: Shape): Vec3[] {
  switch (shape.type) {
    case 'sphere':
      return AROUND.map((d) => [d[0] * shape.radius, d[1] * shape.radius, d[2] * shape.radius]);
    case 'capsule':
      return AROUND.flatMap((d) =>
        [-1, 1].map((side): Vec3 => [d[0] * shape.radius, d[1] * shape.radius, d[2] * shape.radius + side * shape.half_length]),
      );
    case 'cylinder':
      return Array.from({ length: 24 }, (_, i) => (i * Math.PI) / 12).flatMap((a) =>
        [-1, 1].map((side): Vec3 => [Math.cos(a) * shape.radius, Math.sin(a) * shape.radius, side * shape.half_length]),
      );
    case 'box':
      return [-1, 1].flatMap((a) =>
        [-1, 1].flatMap((b) => [-1, 1].map((c): Vec3 => [a * shape.half_extents[0], b * shape.half_extents[1], c * shape.half_extents[2]])),
      );
    case 'hull':
      return shape.points;
  }
}

/** The convex hull of points in the plane, counter-clockwise (monotone chain). */
export function hull(points: readonly [number, number][]): [number, number][] {
  const sorted = [...points].sort((a, b) => a[0] - b[0] || a[1] - b[1]);
  const half = (run: readonly [number, number][]): [number, number][] => {
    const chain: [number, number][] = [];
    for (const p of run) {
      for (let a = chain.at(-2), b = chain.at(-1); a !== undefined && b !== undefined; a = chain.at(-2), b = chain.at(-1)) {
        if ((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]) > 0) break;
        chain.pop();
      }
      chain.push(p);
    }
    chain.pop();
    return chain;
  };
  return [...half(sorted), ...half(sorted.reverse())];
}

/** All shapes of a hand, the farthest first. */
export function outlines(hand: HandShapes, view: View): Outline[] {
  const seen = hand.links.flatMap((link, index) =>
    link.shapes.map((placed): Outline => {
      const points = surface(placed.shape).map((point) => place(link.base_from_link_at_rest, place(placed, point)));
      const corners = hull(points.map((p): [number, number] => [dot(p, view.right), dot(p, view.up)]));
      return { link: index, depth: points.reduce((sum, p) => sum + dot(p, view.near), 0) / points.length, corners };
    }),
  );
  return seen.sort((a, b) => a.depth - b.depth);
}
