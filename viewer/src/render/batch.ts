/** Several bodies in one draw call. */
import { BatchedMesh, BufferGeometry, Color, Matrix4, type Material, Quaternion, Vector3 } from 'three';
import type { Body } from '../model/scene';
import { geometryOf } from './shapes';

const ONE = new Vector3(1, 1, 1);

/** Bodies of one material; each is moved and coloured by its id. */
export class Batch {
  readonly mesh: BatchedMesh;
  private readonly instances = new Map<number, number>();
  private readonly bodies: number[] = [];
  private readonly matrix = new Matrix4();
  private readonly at = new Vector3();
  private readonly turn = new Quaternion();

  /** `fine`: whether the meshes are fine. */
  constructor(bodies: readonly Body[], material: Material, fine: boolean, color: (body: Body) => Color) {
    const geometries = bodies.map((body): BufferGeometry => geometryOf(body.parts, fine));
    const vertices = geometries.reduce((sum, g) => sum + (g.getAttribute('position')?.count ?? 0), 0);
    const corners = geometries.reduce((sum, g) => sum + (g.index?.count ?? 0), 0);
    this.mesh = new BatchedMesh(Math.max(bodies.length, 1), Math.max(vertices, 3), Math.max(corners, 3), material);
    // Without culling it stays one draw call; bodies outside the view cost little.
    this.mesh.perObjectFrustumCulled = false;
    this.mesh.frustumCulled = false;
    bodies.forEach((body, k) => {
      const geometry = geometries[k];
      if (!geometry?.getAttribute('position')) return;
      const instance = this.mesh.addInstance(this.mesh.addGeometry(geometry));
      geometry.dispose();
      this.instances.set(body.id, instance);
      this.bodies[instance] = body.id;
      this.mesh.setColorAt(instance, color(body));
      this.move(body.id, body.position, body.quat);
    });
  }

  /** Sets a body's pose; `p` and `q` are offsets into the arrays. */
  move(id: number, position: ArrayLike<number>, quat: ArrayLike<number>, p = 0, q = 0): void {
    const instance = this.instances.get(id);
    if (instance === undefined) return;
    this.at.set(position[p] ?? 0, position[p + 1] ?? 0, position[p + 2] ?? 0);
    this.turn.set(quat[q] ?? 0, quat[q + 1] ?? 0, quat[q + 2] ?? 0, quat[q + 3] ?? 1);
    this.mesh.setMatrixAt(instance, this.matrix.compose(this.at, this.turn, ONE));
  }

  /** A body's position. */
  placeOf(id: number, into: Vector3): Vector3 | null {
    const instance = this.instances.get(id);
    if (instance === undefined) return null;
    this.mesh.getMatrixAt(instance, this.matrix);
    return into.setFromMatrixPosition(this.matrix);
  }

  /** A body's pose as a matrix. */
  matrixOf(id: number, into: Matrix4): Matrix4 | null {
    const instance = this.instances.get(id);
    if (instance === undefined) return null;
    this.mesh.getMatrixAt(instance, into);
    return into;
  }

  paint(id: number, color: Color): void {
    const instance = this.instances.get(id);
    if (instance !== undefined) this.mesh.setColorAt(instance, color);
  }

  setVisible(id: number, on: boolean): void {
    const instance = this.instances.get(id);
    if (instance !== undefined && this.mesh.getVisibleAt(instance) !== on) this.mesh.setVisibleAt(instance, on);
  }

  /** The body of a ray's hit. */
  bodyOf(batchId: number | undefined): number | null {
    return batchId === undefined ? null : (this.bodies[batchId] ?? null);
  }

  dispose(): void {
    this.mesh.removeFromParent();
    this.mesh.dispose();
  }
}
