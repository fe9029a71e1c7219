/**
 * A camera of a fixed direction that has points in its picture. With x to the right, y up and z towards the camera, a point is right
 * of the picture's edge if x − c > slope · (d − z), where c and d are the camera's coordinates. All such bounds are linear in c
 * and d: only the strictest bound of a set of points on each side matters, and every camera between two good ones is good.
 */
import { Vector3 } from 'three';

/** The part of the canvas that points may fill: shares of the half width and half height on each side of the middle. */
export interface Pane {
  left: number;
  right: number;
  top: number;
  bottom: number;
}

/** Place of a camera in the axes of its direction, m. */
export interface Place {
  across: number;
  up: number;
  depth: number;
}

/** Least distance of the camera from the nearest point, m. */
const NEAREST_M = 0.1;

/** Axes of a camera; z of the world points up in its picture. */
export class Axes {
  readonly right = new Vector3();
  readonly up = new Vector3();
  readonly back = new Vector3();

  /** `towards`: from the points to the camera, not vertical. */
  constructor(towards: Vector3) {
    this.back.copy(towards).normalize();
    this.right.set(-this.back.y, this.back.x, 0).normalize();
    this.up.crossVectors(this.back, this.right);
  }

  /** Coordinates of a world point. */
  placeOf(at: Vector3): Place {
    return { across: at.dot(this.right), up: at.dot(this.up), depth: at.dot(this.back) };
  }

  /** World point of coordinates. */
  point({ across, up, depth }: Place, into = new Vector3()): Vector3 {
    return into.set(0, 0, 0).addScaledVector(this.right, across).addScaledVector(this.up, up).addScaledVector(this.back, depth);
  }
}

/** Slopes of the picture's edges: right, left, top, bottom. */
function slopesOf(pane: Pane, tan: number, aspect: number): [number, number, number, number] {
  return [pane.right * tan * aspect, pane.left * tan * aspect, pane.top * tan, pane.bottom * tan];
}

/** The strictest bounds of points. `tan`: tangent of half the vertical field of view. */
export class Bounds {
  private readonly slopes: [number, number, number, number];
  /** For each edge the greatest s + slope · z, where s is the coordinate towards the edge. */
  private readonly most: [number, number, number, number] = [-Infinity, -Infinity, -Infinity, -Infinity];
  /** Greatest and least z. */
  near = -Infinity;
  far = Infinity;

  constructor(
    private readonly axes: Axes,
    pane: Pane,
    tan: number,
    aspect: number,
  ) {
    this.slopes = slopesOf(pane, tan, aspect);
  }

  /** Adds points, each with a distance around it, m. */
  add(points: readonly Vector3[], margin = 0): this {
    const {
      axes: { right, up, back },
      slopes: [a, b, c, d],
      most,
    } = this;
    for (const point of points) {
      const [x, y, z] = [point.dot(right), point.dot(up), point.dot(back)];
      most[0] = Math.max(most[0], x + margin + a * z);
      most[1] = Math.max(most[1], -x + margin + b * z);
      most[2] = Math.max(most[2], y + margin + c * z);
      most[3] = Math.max(most[3], -y + margin + d * z);
      this.near = Math.max(this.near, z + margin);
      this.far = Math.min(this.far, z - margin);
    }
    return this;
  }

  /** The least depth of a camera that has all points in its picture. */
  private least(): number {
    const {
      slopes: [a, b, c, d],
      most,
    } = this;
    return Math.max((most[0] + most[1]) / (a + b), (most[2] + most[3]) / (c + d), this.near + NEAREST_M);
  }

  /** The camera that has all points in its picture and is nearest to `place`: first it moves aside, then back. */
  nearest(place: Place): Place {
    const {
      slopes: [a, b, c, d],
      most,
    } = this;
    const depth = Math.max(place.depth, this.least());
    const clamped = (x: number, low: number, high: number): number => Math.min(Math.max(x, low), high);
    return {
      across: clamped(place.across, most[0] - a * depth, b * depth - most[1]),
      up: clamped(place.up, most[2] - c * depth, d * depth - most[3]),
      depth,
    };
  }

  /** The nearest camera that has all points in its picture, with equal space on both sides. */
  fit(): Place {
    const {
      slopes: [a, b, c, d],
      most,
    } = this;
    const depth = this.least();
    return { across: (most[0] - most[1] + (b - a) * depth) / 2, up: (most[2] - most[3] + (d - c) * depth) / 2, depth };
  }
}

/** The camera at the share `s` of the way. */
export function between(from: Place, to: Place, s: number): Place {
  const mix = (a: number, b: number): number => a + (b - a) * s;
  return { across: mix(from.across, to.across), up: mix(from.up, to.up), depth: mix(from.depth, to.depth) };
}
