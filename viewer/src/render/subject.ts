/** The subject of a run's camera: the scene, and the hand where it is. */
import { type Matrix4, Matrix4 as Transform, Vector3 } from 'three';
import { type Palm, palmOf } from '../model/palm';
import type { SceneInfo } from '../model/scene';
import { splitFurniture } from './furniture';
import { bodyBox, cornersOf, matrixOf, scenePoints } from './points';
import { type Blocker, blockersOf, put } from './sight';

/** Number of links whose sight is tested. */
const TESTED = 12;

export class Subject {
  /** Corners of regions and objects at the start. */
  readonly scene: Vector3[];
  /** There is nothing but the hand. */
  readonly alone: boolean;
  /** Corners of the boxes around the hand's links; empty without a hand. */
  readonly hand: Vector3[] = [];
  /** Middles of the links that sight is tested for. */
  readonly links: Vector3[];
  /** Mean of the corners. */
  readonly middle = new Vector3();
  /** Pose of the hand's base. */
  readonly base = new Transform();
  readonly palm: Palm;
  /** Height of the ground, m; −∞ without one. */
  readonly ground: number;
  /** Boards, walls and objects. */
  readonly blockers: Blocker[];
  private readonly own: { id: number; corners: Vector3[]; middle: Vector3 }[];
  private readonly tested: number[];
  private readonly matrix = new Transform();

  constructor(info: SceneInfo) {
    const links = info.bodies.filter((body) => body.kind === 'hand');
    this.scene = scenePoints(info);
    this.alone = info.regions.length === 0 && info.bodies.every((body) => body.kind === 'hand');
    this.palm = palmOf(info.hand);
    this.own = links.flatMap((link) => {
      const box = bodyBox(link);
      return box.isEmpty() ? [] : [{ id: link.id, corners: cornersOf(box), middle: box.getCenter(new Vector3()) }];
    });
    this.hand.push(...this.own.flatMap(({ corners }) => corners.map(() => new Vector3())));
    const step = Math.max(1, Math.ceil(this.own.length / TESTED));
    this.tested = this.own.map((_, k) => k).filter((k) => k % step === 0);
    this.links = this.tested.map(() => new Vector3());
    const { panels, grounds } = splitFurniture(info);
    const objects = info.bodies.filter((body) => body.kind === 'object');
    this.ground = Math.max(...grounds.map((body) => bodyBox(body).applyMatrix4(matrixOf(body)).max.z));
    this.blockers = [
      ...panels.flatMap(({ body, outward }) => blockersOf(outward ? 'wall' : 'board', [body])),
      ...blockersOf('object', objects),
    ];
    const first = new Map(info.bodies.map((body) => [body.id, body]));
    this.place((id, into) => {
      const body = first.get(id);
      return body ? into.copy(matrixOf(body)) : null;
    });
  }

  /** Moves hand and objects to the present poses. */
  place(poseOf: (id: number, into: Matrix4) => Matrix4 | null): void {
    const { own, hand, matrix, middle } = this;
    middle.set(0, 0, 0);
    own.forEach(({ id, corners }, k) => {
      if (!poseOf(id, matrix)) return;
      if (k === 0) this.base.copy(matrix);
      corners.forEach((corner, j) => {
        const at = hand[8 * k + j];
        if (at) middle.add(at.copy(corner).applyMatrix4(matrix));
      });
    });
    if (hand.length > 0) middle.divideScalar(hand.length);
    this.tested.forEach((k, j) => {
      const link = own[k];
      if (link && poseOf(link.id, matrix)) this.links[j]?.copy(link.middle).applyMatrix4(matrix);
    });
    for (const blocker of this.blockers) if (blocker.kind === 'object' && poseOf(blocker.body, matrix)) put(blocker, matrix);
  }
}
