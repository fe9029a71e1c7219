/** Pushes a link by an arrow that is dragged away from it; the force is proportional to the arrow's length. */
import { ConeGeometry, CylinderGeometry, Group, Mesh, MeshBasicMaterial, Plane, Quaternion, Raycaster, Vector2, Vector3 } from 'three';
import { POSE, type Moment } from '../model/moment';
import type { SceneInfo, Vec3 } from '../model/scene';
import type { Stage } from '../render/stage';
import type { Push } from './messages';

const COLOUR = '#d55e00';
/** Radii of the arrow's shaft and head, and length of the head, m. */
const [SHAFT_M, HEAD_M, TIP_M] = [0.004, 0.011, 0.03];
const UP = new Vector3(0, 1, 0);
/** Length of arrow at which a drag begins to push, m. */
const MIN_M = 0.005;

/** A drag: the link, the point in the link's frame, and the pointer's world position, m. */
interface Drag {
  row: number;
  link: string;
  point: Vector3;
  pointer: Vector3;
  plane: Plane;
}
type Wrench = Omit<Push, 'duration_s'>;

/** Rounds to 1 / `by`, so that sent numbers are short: 0.001 N, 0.00001 N·m. */
function short(v: Vector3, by: number): Vec3 {
  return [Math.round(v.x * by) / by + 0, Math.round(v.y * by) / by + 0, Math.round(v.z * by) / by + 0];
}

export class PushArrow {
  /** Whether a drag from a link pushes it. */
  on = false;
  /** N per m of arrow. */
  gain = 100;
  // A shaft of unit length along y and a head with its tip at its origin; drawn over everything.
  private readonly arrow = new Group();
  private readonly parts: [Mesh, Mesh];
  private readonly raycaster = new Raycaster();
  private readonly origin = new Vector3();
  private readonly at = new Vector3();
  private readonly turn = new Quaternion();
  private scene: SceneInfo | null = null;
  private moment: Moment | null = null;
  private hold: Drag | null = null;

  /** `area` contains the canvas; `input` is called for each input, with its time in ms of `performance.now`. */
  constructor(
    private readonly stage: Stage,
    area: HTMLElement,
    private readonly input: (at: number) => void,
  ) {
    const material = new MeshBasicMaterial({ color: COLOUR, depthTest: false, transparent: true, opacity: 0.9 });
    this.parts = [
      new Mesh(new CylinderGeometry(SHAFT_M, SHAFT_M, 1, 12).translate(0, 0.5, 0), material),
      new Mesh(new ConeGeometry(HEAD_M, TIP_M, 16).translate(0, -TIP_M / 2, 0), material),
    ];
    for (const part of this.parts) part.renderOrder = 4;
    this.arrow.add(...this.parts);
    this.arrow.visible = false;
    stage.three.add(this.arrow);
    // In the capture phase: before the camera's controls get the event.
    area.addEventListener('pointerdown', (event) => this.begin(event), { capture: true });
    area.addEventListener('pointermove', (event) => this.drag(event), { capture: true });
    for (const end of ['pointerup', 'pointercancel'] as const) area.addEventListener(end, (event) => this.end(event), { capture: true });
  }

  setScene(scene: SceneInfo): void {
    this.scene = scene;
    this.moment = null;
    this.release();
  }

  /** Shows the arrow at the current poses. */
  show(moment: Moment): void {
    this.moment = moment;
    if (this.hold) this.draw();
  }

  /** The arrow's wrench about the link's origin; null without a push. */
  wrench(): Wrench | null {
    const { hold } = this;
    if (!hold || !this.place(hold)) return null;
    const way = hold.pointer.clone().sub(this.at);
    if (way.length() < MIN_M) return null;
    const force = way.multiplyScalar(this.gain);
    const torque = this.at.clone().sub(this.origin).cross(force);
    return { link: hold.link, force: short(force, 1e3), torque: short(torque, 1e5) };
  }

  private begin(event: PointerEvent): void {
    if (!this.on || !this.moment || event.button !== 0 || event.target !== this.stage.renderer.domElement) return;
    const hit = this.stage.hit(event.clientX, event.clientY);
    const body = this.scene?.bodies.find((one) => one.id === hit?.id);
    if (!hit || body?.kind !== 'hand') return;
    const point = new Vector3(...hit.point);
    const normal = this.stage.camera.getWorldDirection(new Vector3());
    const hold: Drag = {
      row: this.scene?.moving.indexOf(body.id) ?? -1,
      link: body.name,
      point,
      pointer: point.clone(),
      plane: new Plane().setFromNormalAndCoplanarPoint(normal, point),
    };
    if (hold.row < 0) return;
    this.read(hold);
    hold.point = point.clone().sub(this.origin).applyQuaternion(this.turn.clone().invert());
    this.hold = hold;
    this.stage.controls.enabled = false;
    this.stage.renderer.domElement.setPointerCapture(event.pointerId);
  }

  private drag(event: PointerEvent): void {
    if (!this.hold) return;
    const area = this.stage.renderer.domElement.getBoundingClientRect();
    const on = new Vector2(((event.clientX - area.left) / area.width) * 2 - 1, 1 - ((event.clientY - area.top) / area.height) * 2);
    this.raycaster.setFromCamera(on, this.stage.camera);
    if (!this.raycaster.ray.intersectPlane(this.hold.plane, this.hold.pointer)) return;
    this.input(event.timeStamp);
    this.draw();
  }

  private end(event: PointerEvent): void {
    if (!this.hold) return;
    this.release();
    this.input(event.timeStamp);
  }

  private release(): void {
    this.hold = null;
    this.arrow.visible = false;
    this.stage.controls.enabled = true;
    this.stage.touch();
  }

  /** Reads the link's pose; false if there is none. */
  private read(hold: Drag): boolean {
    const poses = this.moment?.poses;
    if (!poses) return false;
    this.origin.fromArray(poses, hold.row * POSE);
    this.turn.fromArray(poses, hold.row * POSE + 3);
    return true;
  }

  /** Computes the world position of the dragged point. */
  private place(hold: Drag): boolean {
    if (!this.read(hold)) return false;
    this.at.copy(hold.point).applyQuaternion(this.turn).add(this.origin);
    return true;
  }

  private draw(): void {
    if (!this.hold || !this.place(this.hold)) return;
    const way = this.hold.pointer.clone().sub(this.at);
    const length = way.length();
    this.arrow.visible = length >= MIN_M;
    if (this.arrow.visible) {
      this.arrow.position.copy(this.at);
      this.arrow.quaternion.setFromUnitVectors(UP, way.divideScalar(length));
      this.parts[0].scale.y = Math.max(length - TIP_M, 1e-3);
      this.parts[1].position.y = length;
    }
    this.stage.touch();
  }
}
