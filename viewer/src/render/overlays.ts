/** Overlays: regions of the rules, frames of bodies, centres of mass. */
import type { Region } from '../wire/messages';
import {
  BufferAttribute,
  BufferGeometry,
  Color,
  InstancedMesh,
  LineBasicMaterial,
  LineSegments,
  Matrix4,
  MeshBasicMaterial,
  SphereGeometry,
  Vector3,
} from 'three';

/** Length of a drawn axis, m; shorter for the hand's links, which are close together. */
const AXIS_M = 0.06;
const LINK_AXIS_M = 0.022;
const AXES = [new Color('#d55e00'), new Color('#009e73'), new Color('#0072b2')];
const GOAL = new Color('#009e73');
const START = new Color('#e69f00');
const OTHER = new Color('#888888');

/** Edges of a box between two corners, as pairs of points. */
function edges(min: readonly number[], max: readonly number[]): number[] {
  const corner = (k: number): number[] => [0, 1, 2].map((axis) => ((k >> axis) & 1 ? max[axis] : min[axis]) ?? 0);
  const all: number[] = [];
  for (let k = 0; k < 8; k += 1) {
    for (let axis = 0; axis < 3; axis += 1) if (!((k >> axis) & 1)) all.push(...corner(k), ...corner(k | (1 << axis)));
  }
  return all;
}

/** Boxes around the regions: goal green, start orange, others grey. */
export function regionLines(regions: readonly Region[]): LineSegments {
  const positions: number[] = [];
  const colors: number[] = [];
  for (const region of regions) {
    const lines = edges(region.min, region.max);
    positions.push(...lines);
    const color = region.role === 'goal' ? GOAL : region.role === 'start' ? START : OTHER;
    for (let k = 0; k < lines.length / 3; k += 1) colors.push(color.r, color.g, color.b);
  }
  const geometry = new BufferGeometry();
  geometry.setAttribute('position', new BufferAttribute(new Float32Array(positions), 3));
  geometry.setAttribute('color', new BufferAttribute(new Float32Array(colors), 3));
  return new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true }));
}

/** Axes x, y, z of many frames in one draw call. */
export class Frames {
  readonly lines: LineSegments;
  private readonly positions: BufferAttribute;
  private readonly tip = new Vector3();
  private readonly origin = new Vector3();

  constructor(private readonly ofLink: readonly boolean[]) {
    const count = ofLink.length;
    const geometry = new BufferGeometry();
    this.positions = new BufferAttribute(new Float32Array(18 * count), 3);
    const colors = new Float32Array(18 * count);
    for (let k = 0; k < 6 * count; k += 1) AXES[Math.floor(k / 2) % 3]?.toArray(colors, 3 * k);
    geometry.setAttribute('position', this.positions);
    geometry.setAttribute('color', new BufferAttribute(colors, 3));
    this.lines = new LineSegments(geometry, new LineBasicMaterial({ vertexColors: true, depthTest: false, transparent: true }));
    this.lines.frustumCulled = false;
    this.lines.renderOrder = 2;
  }

  show(place: (k: number, into: Matrix4) => Matrix4 | null): void {
    const matrix = new Matrix4();
    for (let k = 0; k < this.ofLink.length; k += 1) {
      const at = place(k, matrix);
      if (!at) continue;
      this.origin.setFromMatrixPosition(at);
      const length = this.ofLink[k] ? LINK_AXIS_M : AXIS_M;
      for (let axis = 0; axis < 3; axis += 1) {
        this.tip.setFromMatrixColumn(at, axis).multiplyScalar(length).add(this.origin);
        this.positions.setXYZ(6 * k + 2 * axis, this.origin.x, this.origin.y, this.origin.z);
        this.positions.setXYZ(6 * k + 2 * axis + 1, this.tip.x, this.tip.y, this.tip.z);
      }
    }
    this.positions.needsUpdate = true;
  }
}

/** Spheres at the centres of mass. */
export class Centres {
  readonly mesh: InstancedMesh;
  private readonly matrix = new Matrix4();

  constructor(most: number) {
    const material = new MeshBasicMaterial({ color: '#cc79a7', depthTest: false, transparent: true });
    this.mesh = new InstancedMesh(new SphereGeometry(0.006, 12, 8), material, Math.max(most, 1));
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 2;
  }

  show(places: readonly Vector3[]): void {
    places.forEach((at, k) => this.mesh.setMatrixAt(k, this.matrix.makeTranslation(at)));
    this.mesh.count = Math.min(places.length, this.mesh.instanceMatrix.count);
    this.mesh.instanceMatrix.needsUpdate = true;
  }
}
