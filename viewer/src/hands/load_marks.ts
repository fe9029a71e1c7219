/** Drawn loads of the hand: forces and reactions as arrows, held points as pins, each with its size in N. */
import {
  ConeGeometry,
  CylinderGeometry,
  Group,
  LineBasicMaterial,
  Mesh,
  MeshBasicMaterial,
  OctahedronGeometry,
  Quaternion,
  SphereGeometry,
  Vector3,
} from 'three';
import type { Pose } from '../model/pose';
import type { Vec3 } from '../model/scene';
import type { Stage } from '../render/stage';
import { inWorld, type Load, reactionOf } from './equilibrium';
import type { EquilibriumResponse } from '../wire/messages';

/** Pushes vermilion, pins blue, reactions at pins purple. */
const COLOURS = { force: '#d55e00', hold: '#0072b2', reaction: '#cc79a7', chosen: '#f0e442' } as const;
/** Radii of shaft and head, length of the head, radius of points and pins, m. */
const [SHAFT_M, HEAD_M, TIP_M, DOT_M, PIN_M] = [0.0018, 0.005, 0.014, 0.0035, 0.0065];
/** Maximum length of a drawn reaction, m. */
const MAX_REACTION_M = 0.2;
const UP = new Vector3(0, 1, 0);

const material = (color: string): MeshBasicMaterial => new MeshBasicMaterial({ color, depthTest: false, transparent: true, opacity: 0.92 });

/** An arrow from a point along a vector, m; drawn over everything. */
class Arrow {
  readonly group = new Group();
  private readonly shaft: Mesh;
  private readonly head: Mesh;
  private readonly way = new Vector3();

  constructor(color: string) {
    const paint = material(color);
    this.shaft = new Mesh(new CylinderGeometry(SHAFT_M, SHAFT_M, 1, 10).translate(0, 0.5, 0), paint);
    this.head = new Mesh(new ConeGeometry(HEAD_M, TIP_M, 14).translate(0, -TIP_M / 2, 0), paint);
    this.shaft.renderOrder = this.head.renderOrder = 4;
    this.group.add(this.shaft, this.head);
    this.group.visible = false;
  }

  show(from: Vec3, along: Vec3): void {
    const length = this.way.set(...along).length();
    this.group.visible = length > 1e-4;
    if (!this.group.visible) return;
    this.group.position.set(...from);
    this.group.quaternion.copy(new Quaternion().setFromUnitVectors(UP, this.way.divideScalar(length)));
    const head = Math.min(1, length / TIP_M);
    this.shaft.scale.y = Math.max(length - TIP_M, 1e-4);
    this.head.position.y = length;
    this.head.scale.setScalar(head);
  }
}

/** A drawn load: its point on the link, its arrow or pin, its reaction, its label. */
class LoadMark {
  readonly group = new Group();
  readonly tag = document.createElement('span');
  /** Position of its handle and label, m. */
  readonly handle = new Vector3();
  private readonly dot: Mesh<SphereGeometry, MeshBasicMaterial>;
  private readonly pin = new Mesh(new OctahedronGeometry(PIN_M), material(COLOURS.hold));
  private readonly arrow = new Arrow(COLOURS.force);
  private readonly reaction = new Arrow(COLOURS.reaction);

  constructor(readonly load: Load) {
    this.dot = new Mesh(new SphereGeometry(DOT_M, 14, 10), material(COLOURS[load.kind]));
    this.dot.renderOrder = this.pin.renderOrder = 5;
    this.group.add(this.dot, this.pin, this.arrow.group, this.reaction.group);
    this.tag.className = 'stage-label load-tag';
  }

  show(link: Pose, number: number, metres: number, chosen: boolean, reaction: EquilibriumResponse['reactions'][number] | null): void {
    const { load } = this;
    const at = inWorld(link, load.point);
    this.dot.position.set(...at);
    this.dot.material.color.set(chosen ? COLOURS.chosen : COLOURS[load.kind]);
    this.pin.visible = load.kind === 'hold';
    this.pin.position.set(...load.place);
    const along = (force: Vec3, most = Infinity): Vec3 => {
      const share = metres * Math.min(1, most / Math.max(metres * Math.hypot(...force), 1e-9));
      return [force[0] * share, force[1] * share, force[2] * share];
    };
    const arrow = along(load.force);
    this.arrow.show(at, load.kind === 'force' ? arrow : [0, 0, 0]);
    this.reaction.show(at, reaction ? along(reaction.force, MAX_REACTION_M) : [0, 0, 0]);
    this.handle.set(...(load.kind === 'hold' ? load.place : at));
    if (load.kind === 'force') this.handle.add(new Vector3(...arrow));
    const newtons = load.kind === 'force' ? load.force : reaction?.force;
    this.tag.textContent = newtons ? `${number}: ${formatNewtons(Math.hypot(...newtons))} N` : `${number}: held`;
    this.tag.classList.toggle('chosen', chosen);
  }

  dispose(): void {
    this.group.removeFromParent();
    this.tag.remove();
    this.group.traverse((one) => {
      if (!(one instanceof Mesh)) return;
      (one.geometry as { dispose(): void }).dispose();
      (one.material as MeshBasicMaterial | LineBasicMaterial).dispose();
    });
  }
}

/** Newtons as text. */
export function formatNewtons(newtons: number): string {
  return newtons >= 100 ? newtons.toFixed(0) : newtons >= 10 ? newtons.toFixed(1) : newtons.toFixed(2);
}

export class LoadMarks {
  private readonly marks = new Map<number, LoadMark>();
  private readonly scratch = new Vector3();

  constructor(
    private readonly stage: Stage,
    private readonly area: HTMLElement,
  ) {
    stage.onFrame(() => this.place());
  }

  /** Draws the loads, with `metres` of arrow for each N. */
  show(
    loads: readonly Load[],
    places: ReadonlyMap<string, Pose>,
    rest: EquilibriumResponse | null,
    metres: number,
    chosen: number | null,
  ): void {
    for (const [id, mark] of this.marks) {
      if (loads.some((load) => load === mark.load)) continue;
      mark.dispose();
      this.marks.delete(id);
    }
    loads.forEach((load, k) => {
      const link = places.get(load.link);
      if (!link) return;
      let mark = this.marks.get(load.id);
      if (!mark) {
        mark = new LoadMark(load);
        this.marks.set(load.id, mark);
        this.stage.three.add(mark.group);
        this.area.append(mark.tag);
      }
      mark.show(link, k + 1, metres, load.id === chosen, reactionOf(load, loads, rest));
    });
    this.stage.touch();
  }

  /** Position of a load's handle on the canvas, CSS px from its upper left corner. */
  handleOf(id: number): { x: number; y: number } | null {
    const mark = this.marks.get(id);
    return mark ? this.onScreen(mark.handle) : null;
  }

  /** World position of a load's handle, m. */
  handleAt(id: number): Vector3 | null {
    return this.marks.get(id)?.handle ?? null;
  }

  /** The load whose handle is nearest to a point of the canvas, at most `within` px away. */
  nearest(x: number, y: number, within: number): number | null {
    let [best, found]: [number, number | null] = [within, null];
    for (const [id, mark] of this.marks) {
      const at = this.onScreen(mark.handle);
      const far = at ? Math.hypot(at.x - x, at.y - y) : Infinity;
      if (far < best) [best, found] = [far, id];
    }
    return found;
  }

  private onScreen(point: Vector3): { x: number; y: number } | null {
    const at = this.scratch.copy(point).project(this.stage.camera);
    if (at.z >= 1) return null;
    return { x: ((at.x + 1) / 2) * this.area.clientWidth, y: ((1 - at.y) / 2) * this.area.clientHeight };
  }

  private place(): void {
    for (const mark of this.marks.values()) {
      const at = this.onScreen(mark.handle);
      mark.tag.hidden = at === null;
      if (at) mark.tag.style.transform = `translate(${Math.round(at.x + 12)}px, ${Math.round(at.y - 10)}px)`;
    }
  }
}
