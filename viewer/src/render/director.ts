/**
 * Moves the camera: the hand is always in its picture, and in the views of the whole scene all of the scene, too. *Palm* and
 * *Follow* go with the hand and choose a side from which it is visible. A person who moves the camera has it; then it moves only to
 * keep a hand in the picture that was in it.
 */
import { type PerspectiveCamera, Vector3 } from 'three';
import type { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { Axes, Bounds, type Pane, type Place, between } from './framing';
import { ABOVE_M, bestDirection, lessSteep } from './sight';
import type { Subject } from './subject';

export type ViewName = 'free' | 'follow' | 'front' | 'side' | 'top' | 'palm';

/** Directions from the scene to the camera. */
const FROM: Record<Exclude<ViewName, 'palm'>, Vector3> = {
  free: new Vector3(0.55, -1, 0.7),
  follow: new Vector3(0.55, -1, 0.7),
  front: new Vector3(0, -1, 0.25),
  side: new Vector3(1, 0, 0.25),
  top: new Vector3(0, -0.001, 1),
};

/** Share of the half picture that a followed hand fills, and from which on the camera moves. */
const [CLOSE, CLOSE_MOST] = [0.68, 0.9];
/** Space around the hand in a view of the whole scene, m. */
const AROUND_M = 0.06;
/** The camera comes nearer if it is farther than needed by the first factor, until it is by the second one. */
const [FAR, FAR_ENOUGH] = [1.25, 1.02];
/** Time constants of coming nearer and of turning, ms. */
const [NEARER_MS, TURN_MS] = [350, 300];
/** The side of the hand is chosen anew after this time, ms. */
const CHOICE_MS = 250;
/** A hand that moves farther in a frame has jumped, m. */
const JUMP_M = 0.12;
/** Attempts to look from higher. */
const TRIES = 8;
/** Smaller movements of the camera are left out, m. */
const STILL_M = 1e-5;

function scaled(pane: Pane, by: number): Pane {
  return { left: by * pane.left, right: by * pane.right, top: by * pane.top, bottom: by * pane.bottom };
}

export class Director {
  private name: ViewName = 'free';
  /** A person has moved the camera. */
  private own = false;
  /** The hand was in the picture when the person let go. */
  private held = true;
  private fresh = true;
  private nearing = false;
  private towards = new Vector3();
  private wanted: Vector3 | null = null;
  private chosenAt = -Infinity;
  private last: number | null = null;
  private readonly middle = new Vector3();

  constructor(
    private readonly camera: PerspectiveCamera,
    private readonly controls: OrbitControls,
  ) {}

  get view(): ViewName {
    return this.name;
  }

  /** Starts a named view. */
  start(name: ViewName): void {
    this.name = name;
    [this.own, this.fresh] = [false, true];
  }

  /** A person has moved the camera. */
  taken(subject: Subject | null): void {
    this.own = true;
    this.fresh = false;
    this.held = subject === null || this.shows(subject.hand);
  }

  /** Moves the camera along with the hand in a view that follows it, also while something else moves the camera. */
  along(subject: Subject, stays = false): void {
    if (this.close(subject) && !this.fresh && !stays) {
      const move = subject.middle.clone().sub(this.middle);
      this.camera.position.add(move);
      this.controls.target.add(move);
    }
    this.middle.copy(subject.middle);
  }

  /** Moves the camera at `now`, ms; `still`: without animation. Returns whether it goes on without a change of the scene. */
  frame(subject: Subject, pane: Pane, now: number, still: boolean): boolean {
    const passed = this.last === null ? 0 : Math.min(now - this.last, 100);
    this.last = now;
    const close = this.close(subject);
    const jumped = this.middle.distanceTo(subject.middle) > JUMP_M;
    this.along(subject);
    const turning = !this.own && this.turn(subject, close, now, passed, still || this.fresh || (close && jumped));
    if (this.own) {
      this.keep(subject, pane);
      return false;
    }
    const snaps = this.fresh || (close && jumped);
    const share = still ? 1 : 1 - Math.exp(-passed / NEARER_MS);
    let shot = this.shot(subject, pane, close, snaps ? null : share);
    // A camera under the ground sees nothing: it looks from higher, and that changes its place.
    for (let k = 0; close && k < TRIES && shot.position.z < subject.ground + ABOVE_M; k += 1) {
      this.towards.z += (1.1 * (subject.ground + ABOVE_M - shot.position.z)) / shot.position.distanceTo(subject.middle);
      this.towards.copy(lessSteep(this.towards));
      shot = this.shot(subject, pane, close, snaps ? null : share);
    }
    this.fresh = false;
    this.put(shot.position, shot.target);
    return turning || this.nearing;
  }

  /** Moves a person's camera if it must, to keep the hand in the picture. */
  private keep(subject: Subject, pane: Pane): void {
    if (!this.held || subject.hand.length === 0) return;
    const axes = new Axes(this.camera.position.clone().sub(this.controls.target));
    const place = this.bounds(axes, pane).add(subject.hand).nearest(axes.placeOf(this.camera.position));
    const move = axes.point(place).sub(this.camera.position);
    this.put(this.camera.position.clone().add(move), this.controls.target.clone().add(move));
  }

  /** Place and target of a camera in the present direction; `share` of the way nearer, or with null at its best place. */
  private shot(subject: Subject, pane: Pane, close: boolean, share: number | null): { position: Vector3; target: Vector3 } {
    const axes = new Axes(this.towards);
    const [most, wished] = close
      ? [this.bounds(axes, scaled(pane, CLOSE_MOST)).add(subject.hand), this.bounds(axes, scaled(pane, CLOSE)).add(subject.hand)]
      : [
          this.bounds(axes, pane).add(subject.scene).add(subject.hand),
          this.bounds(axes, pane)
            .add(subject.scene)
            .add(subject.hand, subject.alone ? 0 : AROUND_M),
        ];
    const fit = wished.fit();
    const place = share === null ? fit : most.nearest(this.nearer(axes.placeOf(this.camera.position), fit, wished, share));
    const depth = Math.min((wished.near + wished.far) / 2, place.depth - 0.02);
    return { position: axes.point(place), target: axes.point({ ...place, depth }) };
  }

  private bounds(axes: Axes, pane: Pane): Bounds {
    return new Bounds(axes, pane, Math.tan((this.camera.fov * Math.PI) / 360), this.camera.aspect);
  }

  /** Whether the camera shows the hand alone. */
  private close(subject: Subject): boolean {
    return (this.name === 'follow' || this.name === 'palm') && subject.hand.length > 0;
  }

  /** Turns towards the wished direction; returns whether it is still turning. */
  private turn(subject: Subject, close: boolean, now: number, passed: number, atOnce: boolean): boolean {
    if (!close) {
      this.towards.copy(FROM[this.name === 'palm' ? 'free' : this.name]).normalize();
      return false;
    }
    if (atOnce || this.wanted === null || now - this.chosenAt >= CHOICE_MS) {
      const wish =
        this.name === 'palm' ? new Vector3(...subject.palm.direction).transformDirection(subject.base) : FROM.follow.clone().normalize();
      this.wanted = bestDirection(
        subject.links,
        wish,
        this.usual(subject),
        subject.blockers,
        subject.ground,
        this.fresh ? null : this.wanted,
      );
      this.chosenAt = now;
    }
    const before = this.towards.clone();
    const share = atOnce ? 1 : 1 - Math.exp(-passed / TURN_MS);
    const between = before.clone().lerp(this.wanted, share);
    // Opposite directions have no middle.
    this.towards.copy(lessSteep(between.lengthSq() > 1e-3 ? between : this.wanted));
    if (!this.fresh) {
      const distance = this.camera.position.clone().sub(subject.middle).dot(before);
      this.camera.position.copy(subject.middle).addScaledVector(this.towards, distance);
    }
    return this.towards.angleTo(this.wanted) > 1e-3;
  }

  /** About the distance of a followed hand, m. */
  private usual(subject: Subject): number {
    const radius = subject.hand.reduce((most, corner) => Math.max(most, corner.distanceTo(subject.middle)), 0.05);
    return radius / (CLOSE * Math.tan((this.camera.fov * Math.PI) / 360) * Math.min(1, this.camera.aspect));
  }

  /** Comes nearer if the camera is much farther than needed. */
  private nearer(place: Place, fit: Place, { near, far }: Bounds, share: number): Place {
    const middle = (near + far) / 2;
    const factor = (place.depth - middle) / (fit.depth - middle);
    if (factor > FAR) this.nearing = true;
    else if (factor < FAR_ENOUGH) this.nearing = false;
    return this.nearing ? between(place, fit, share) : place;
  }

  private put(position: Vector3, target: Vector3): void {
    const before = this.controls.target.clone().sub(this.camera.position);
    if (position.distanceTo(this.camera.position) < STILL_M && target.clone().sub(position).angleTo(before) < STILL_M) return;
    this.camera.position.copy(position);
    this.controls.target.copy(target);
    this.controls.update();
  }

  /** Whether all points are in the picture. */
  private shows(points: readonly Vector3[]): boolean {
    this.camera.updateMatrixWorld();
    const at = new Vector3();
    return points.every((point) => {
      at.copy(point).project(this.camera);
      return Math.abs(at.x) <= 1 && Math.abs(at.y) <= 1 && at.z < 1;
    });
  }
}
