/** The pointer in the 3D view: drags arrows that push links and pins that hold them. */
import { Plane, Raycaster, Vector2, Vector3 } from 'three';
import type { Vec3 } from '../model/scene';
import type { Stage } from '../render/stage';
import type { LoadMarks } from './load_marks';

/** Effect of a press on a link. */
export type Mode = 'look' | 'force' | 'hold';

/** Radius within which a press takes a handle, px; larger for fingers than for a mouse. */
const [NEAR_PX, FINGER_PX] = [14, 26];

export interface LoadListener {
  /** A link was pressed. Returns the id of the new load there, or null if there can be none. */
  pressed(kind: 'force' | 'hold', link: number, at: Vec3): number | null;
  /** A drag of a load's handle begins. */
  grabbed(id: number): void;
  /** The handle was dragged by this vector since the drag began; m, world frame. */
  dragged(id: number, by: Vec3): void;
}

export class LoadPointer {
  mode: Mode = 'look';
  private hold: { id: number; plane: Plane; from: Vector3 } | null = null;
  private readonly raycaster = new Raycaster();

  constructor(
    private readonly stage: Stage,
    private readonly marks: LoadMarks,
    area: HTMLElement,
    private readonly listener: LoadListener,
  ) {
    // In the capture phase: before the camera's controls get the event.
    area.addEventListener('pointerdown', (event) => this.begin(event), { capture: true });
    area.addEventListener('pointermove', (event) => this.drag(event), { capture: true });
    for (const end of ['pointerup', 'pointercancel'] as const) area.addEventListener(end, () => this.end(), { capture: true });
  }

  private begin(event: PointerEvent): void {
    const canvas = this.stage.renderer.domElement;
    if (event.button !== 0 || event.target !== canvas || !event.isPrimary) return;
    const area = canvas.getBoundingClientRect();
    let id = this.marks.nearest(event.clientX - area.left, event.clientY - area.top, event.pointerType === 'touch' ? FINGER_PX : NEAR_PX);
    if (id === null && this.mode !== 'look') {
      const hit = this.stage.hit(event.clientX, event.clientY);
      if (hit) id = this.listener.pressed(this.mode, hit.id, hit.point);
    }
    const at = id === null ? null : this.marks.handleAt(id);
    if (id === null || !at) return;
    this.listener.grabbed(id);
    const plane = new Plane().setFromNormalAndCoplanarPoint(this.stage.camera.getWorldDirection(new Vector3()), at);
    this.hold = { id, plane, from: this.on(plane, event) ?? at.clone() };
    this.stage.controls.enabled = false;
    canvas.setPointerCapture(event.pointerId);
  }

  private drag(event: PointerEvent): void {
    const { hold } = this;
    const at = hold && this.on(hold.plane, event);
    if (!hold || !at) return;
    at.sub(hold.from);
    this.listener.dragged(hold.id, [at.x, at.y, at.z]);
  }

  private end(): void {
    if (!this.hold) return;
    this.hold = null;
    this.stage.controls.enabled = true;
  }

  /** Intersection of the pointer's ray with a plane. */
  private on(plane: Plane, event: PointerEvent): Vector3 | null {
    const area = this.stage.renderer.domElement.getBoundingClientRect();
    const at = new Vector2(((event.clientX - area.left) / area.width) * 2 - 1, 1 - ((event.clientY - area.top) / area.height) * 2);
    this.raycaster.setFromCamera(at, this.stage.camera);
    return this.raycaster.ray.intersectPlane(plane, new Vector3());
  }
}
