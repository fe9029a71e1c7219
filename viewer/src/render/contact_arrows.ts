/** Contacts as arrows: as long as the force, coloured by how near they are to slipping. */
import { Color, ConeGeometry, CylinderGeometry, InstancedMesh, Matrix4, MeshBasicMaterial, Quaternion, Vector3 } from 'three';
import { mergeGeometries } from 'three/addons/utils/BufferGeometryUtils.js';
import type { Contact } from '../model/moment';

/** Most that are drawn. */
const MOST = 512;
/** m/N; and the longest and the shortest arrow, m. */
const LENGTH_OF_NEWTON = 0.01;
const [SHORTEST, LONGEST] = [0.012, 0.25];
/** Blue where a contact holds, over yellow, to vermilion where it slips: told apart by the colour-blind, too. */
const STICKS = new Color('#0072b2');
const NEAR = new Color('#f0e442');
const SLIPS = new Color('#d55e00');
const UP = new Vector3(0, 1, 0);

/** Colour of a contact that uses this share of its friction cone. */
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
    // Seen through what hides it: most contacts are between finger and object.
    const material = new MeshBasicMaterial({ depthTest: false, transparent: true, opacity: 0.9 });
    this.mesh = new InstancedMesh(mergeGeometries([shaft, head]), material, MOST);
    this.mesh.frustumCulled = false;
    this.mesh.renderOrder = 3;
    this.mesh.count = 0;
    this.mesh.setColorAt(0, STICKS);
  }

  show(contacts: readonly Contact[]): void {
    const drawn = Math.min(contacts.length, MOST);
    for (let k = 0; k < drawn; k += 1) {
      const contact = contacts[k];
      if (!contact) continue;
      const force = this.along.set(...contact.force).length();
      this.turn.setFromUnitVectors(UP, force > 0 ? this.along.divideScalar(force) : UP);
      const length = Math.min(Math.max(force * LENGTH_OF_NEWTON, SHORTEST), LONGEST);
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
