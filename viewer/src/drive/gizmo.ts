/** Handles at the hand's base that the mouse or a finger drags: they say where the base shall go. */
import { Object3D } from 'three';
import { TransformControls } from 'three/addons/controls/TransformControls.js';
import type { Quat, Vec3 } from '../model/scene';
import type { Stage } from '../render/stage';
import type { Spec } from './messages';

/** Share of the picture's height that the handles take. */
const SIZE = 0.7;
/** Of the axes x, y and z, as where frames are drawn, and of what the pointer is at. */
const COLOURS = ['#d55e00', '#009e73', '#0072b2', '#f0e442'] as const;
/** Digits that are sent: 0.01 mm, and about 0.0001 rad. */
const rounded = (x: number, by: number): number => Math.round(x * by) / by + 0;

export class Gizmo {
  private readonly place = new Object3D();
  private readonly controls: TransformControls;
  private readonly limits: [number, number][] = [];

  /** `moved` is told of each change, at the time of the event that made it (ms of `performance.now`). */
  constructor(private readonly stage: Stage, moved: (position: Vec3, quat: Quat, at: number) => void) {
    this.controls = new TransformControls(stage.camera, stage.renderer.domElement);
    this.controls.setSize(SIZE);
    this.controls.setColors(...COLOURS);
    stage.three.add(this.place, this.controls.getHelper());
    // The event is told of the drag before the page is told what it changed.
    let at = performance.now();
    stage.renderer.domElement.addEventListener('pointermove', (event) => { at = event.timeStamp; }, { capture: true });
    this.controls.addEventListener('change', () => { stage.touch(); });
    this.controls.addEventListener('dragging-changed', (event) => { stage.controls.enabled = event.value !== true; });
    this.controls.addEventListener('objectChange', () => {
      const { position, quaternion } = this.place;
      this.limits.forEach(([least, most], axis) => { position.setComponent(axis, Math.min(Math.max(position.getComponent(axis), least), most)); });
      const [x, y, z] = position.toArray().map((value) => rounded(value, 1e5)) as Vec3;
      const [qx, qy, qz, qw] = quaternion.toArray().map((value) => rounded(value, 1e5));
      moved([x, y, z], [qx ?? 0, qy ?? 0, qz ?? 0, qw ?? 1], at);
    });
    this.show(null);
  }

  /** Room that the base may use, as the server tells it. */
  limit(spec: Spec | undefined): void {
    this.limits.length = 0;
    if (spec && spec.minimum !== null && spec.maximum !== null) this.limits.push(...Array.from({ length: 3 }, (): [number, number] => [spec.minimum ?? 0, spec.maximum ?? 0]));
  }

  /** Handles to move, to turn, or none. */
  show(mode: 'translate' | 'rotate' | null): void {
    if (mode) this.controls.attach(this.place).setMode(mode);
    else this.controls.detach();
    this.stage.touch();
  }

  /** Along the world's axes, or the hand's own. */
  along(space: 'world' | 'local'): void {
    this.controls.setSpace(space);
  }

  get dragging(): boolean {
    return this.controls.dragging;
  }

  /** Puts the handles where the base is, or shall go. */
  put(position: Vec3, quat: Quat): void {
    if (this.controls.dragging) return;
    this.place.position.set(...position);
    this.place.quaternion.set(...quat);
  }
}
