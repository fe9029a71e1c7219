/** Contact forces as arrows: length by force, colour by how close the contact is to slipping. */
import { Color, ConeGeometry, CylinderGeometry, InstancedMesh, Matrix4, MeshBasicMaterial, Quaternion, Vector3 } from 'three';
import { mergeGeometries } from 'three/addons/utils/BufferGeometryUtils.js';
import type { Contact } from '../model/moment';

/** Maximum number of arrows. */
const MAX_ARROWS = 512;
/** m/N; shortest and longest arrow, m. */
const LENGTH_OF_NEWTON = 0.01;
const [MIN_M, MAX_M] = [0.012, 0.25];
/** Blue: sticks; yellow: half way; vermilion: slips. Colour-blind people can distinguish them. */
const STICKS = new Color('#0072b2');
const NEAR = new Color('#f0e442');
const SLIPS = new Color('#d55e00');
const UP = new Vector3(0, 1, 0);

/** Colour for the used share of the friction cone. */
export function frictionColor(use: number, into = new Color()): Color {
  return use < 0.5 ? into.lerpColors(STICKS, NEAR, 2 * use) : into.lerpColors(NEAR, SLIPS, Math.min(2 * use - 1, 1));
}

export class ContactArrows {
  readonly mesh: InstancedMesh;
  private readonly matrix = new Matrix4();
  private readonly turn = new Quaternion();
  private readonly along = new Vector3();
  private readonly at = new Vector3();
  private readonly size = new Vector3();
  private readonly color = new Color();

  constructor() {
    const shaft = new CylinderGeometry(0.05, 0.05, 0.7, 8).translate(0, 0.35, 0).toNonIndexed();
    const head = new ConeGeometry(0.13, 0.3, 12).translate(0, 0.85, 0).toNonIndexed();
    // Drawn over everything: most contacts are hidden between finger and object.
    const material = new MeshBasicMaterial({ depthTest: false, transparent: true, opacity: 0.9 });
    this.mesh = new InstancedMesh(mergeGeometries([shaft, head]), material, MAX_ARROWS);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 3;
    this.mesh.count = 0;
    this.mesh.setColorAt(0, STICKS);
  }

  show(contacts: readonly Contact[]): void {
    const drawn = Math.min(contacts.length, MAX_ARROWS);
    for (let k = 0; k < drawn; k += 1) {
      const contact = contacts[k];
      if (!contact) continue;
      const force = this.along.set(...contact.force).length();
      this.turn.setFromUnitVectors(UP, force > 0 ? this.along.divideScalar(force) : UP);
      const length = Math.min(Math.max(force * LENGTH_OF_NEWTON, MIN_M), MAX_M);
      const width = Math.min(length, 0.05);
      this.matrix.compose(this.at.set(...contact.position), this.turn, this.size.set(width, length, width));
      this.mesh.setMatrixAt(k, this.matrix);
      this.mesh.setColorAt(k, frictionColor(contact.use, this.color));
    }
    this.mesh.count = drawn;
    this.mesh.instanceMatrix.needsUpdate = true;
    if (this.mesh.instanceColor) this.mesh.instanceColor.needsUpdate = true;
  }

  dispose(): void {
    this.mesh.removeFromParent();
    this.mesh.geometry.dispose();
    this.mesh.dispose();
  }
}
