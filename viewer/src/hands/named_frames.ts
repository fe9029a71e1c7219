/** The named frames of a hand (base, palm, grasp centre), drawn larger than those of its links. */
import { Quaternion, Vector3 } from 'three';
import { el } from '../ui/elements';
import type { Pose } from '../model/pose';
import { Labels } from '../render/labels';
import { Frames } from '../render/overlays';
import type { Stage } from '../render/stage';

const NAMES = ['base', 'palm', 'grasp centre'];
const ONE = new Vector3(1, 1, 1);

export class NamedFrames {
  private readonly frames = new Frames(NAMES.map(() => false));
  private readonly labels: Labels;
  private poses: Pose[] = [];
  private on = false;

  constructor(
    private readonly stage: Stage,
    private readonly area: HTMLElement,
  ) {
    // An element of its own, above the names of links.
    const names = el('div', { class: 'frame-names' });
    area.append(names);
    this.labels = new Labels(names);
    this.frames.lines.visible = false;
    stage.three.add(this.frames.lines);
    stage.onFrame(() => this.place());
  }

  set visible(on: boolean) {
    this.on = on;
    this.frames.lines.visible = on;
    this.labels.set(on ? this.poses.map((_, id) => ({ id, name: NAMES[id] ?? '' })) : []);
    this.show(this.poses);
  }

  /** `poses`: base, palm, and the grasp centre if there is one. */
  show(poses: Pose[]): void {
    this.poses = poses;
    if (!this.on) return;
    this.frames.show((k, into) => {
      const pose = poses[k];
      return pose ? into.compose(new Vector3(...pose.position), new Quaternion(...pose.quat), ONE) : null;
    });
    this.stage.touch();
  }

  private place(): void {
    if (!this.on) return;
    this.labels.place(this.stage.camera, this.area.clientWidth, this.area.clientHeight, (id, into) => {
      const pose = this.poses[id];
      return pose ? into.set(...pose.position) : null;
    });
  }
}
