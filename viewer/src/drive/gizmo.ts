/** Handles at the hand's base: dragging them sets the target pose of the base. */
import { Object3D } from 'three';
import { TransformControls } from 'three/addons/controls/TransformControls.js';
import type { Quat, Vec3 } from '../model/scene';
import type { Stage } from '../render/stage';
import type { Field } from '../wire/messages';

/** Size of the handles, as a share of the image's height. */
const SIZE = 0.7;
/** Colours of the axes x, y and z, as for frames, and of the handle under the pointer. */
const COLOURS = ['#d55e00', '#009e73', '#0072b2', '#f0e442'] as const;
/** Rounds to 1 / `by`, so that sent numbers are short: 0.01 mm, and about 0.0001 rad. */
const rounded = (x: number, by: number): number => Math.round(x * by) / by + 0;

export class Gizmo {
  private readonly place = new Object3D();
  private readonly controls: TransformControls;
  private readonly limits: [number, number][] = [];

  /** `moved` gets each change, with the time of its event (ms of `performance.now`). */
  constructor(
    private readonly stage: Stage,
    moved: (position: Vec3, quat: Quat, at: number) => void,
  ) {
    this.controls = new TransformControls(stage.camera, stage.renderer.domElement);
    this.controls.setSize(SIZE);
    this.controls.setColors(...COLOURS);
    stage.three.add(this.place, this.controls.getHelper());
    // In the capture phase: before `objectChange`, which needs the event's time.
    let at = performance.now();
    stage.renderer.domElement.addEventListener(
      'pointermove',
      (event) => {
        at = event.timeStamp;
      },
      { capture: true },
    );
    this.controls.addEventListener('change', () => stage.touch());
    this.controls.addEventListener('dragging-changed', (event) => {
      stage.controls.enabled = event.value !== true;
    });
    this.controls.addEventListener('objectChange', () => {
      const { position, quaternion } = this.place;
      this.limits.forEach(([least, most], axis) =>
        position.setComponent(axis, Math.min(Math.max(position.getComponent(axis), least), most)),
      );
      const [x, y, z] = position.toArray().map((value) => rounded(value, 1e5)) as Vec3;
      const [qx, qy, qz, qw] = quaternion.toArray().map((value) => rounded(value, 1e5));
      moved([x, y, z], [qx ?? 0, qy ?? 0, qz ?? 0, qw ?? 1], at);
    });
    this.show(null);
  }

  /** Sets the server's limits of the base's position. */
  limit(spec: Field | undefined): void {
    this.limits.length = 0;
    if (spec && spec.minimum !== null && spec.maximum !== null)
      this.limits.push(...Array.from({ length: 3 }, (): [number, number] => [spec.minimum ?? 0, spec.maximum ?? 0]));
  }

  /** Shows the handles for moving, for turning, or none. */
  show(mode: 'translate' | 'rotate' | null): void {
    if (mode) this.controls.attach(this.place).setMode(mode);
    else this.controls.detach();
    this.stage.touch();
  }

  /** Aligns the handles with the world or with the hand. */
  along(space: 'world' | 'local'): void {
    this.controls.setSpace(space);
  }

  get dragging(): boolean {
    return this.controls.dragging;
  }

  /** Moves the handles to the base's pose or target. */
  put(position: Vec3, quat: Quat): void {
    if (this.controls.dragging) return;
    this.place.position.set(...position);
    this.place.quaternion.set(...quat);
  }
}
