import { PerspectiveCamera, Quaternion, Vector3 } from 'three';
import type { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { describe, expect, it } from 'vitest';
import type { Body, Quat, SceneInfo, Vec3 } from '../model/scene';
import { Director, type ViewName } from './director';
import { matrixOf } from './points';
import { blocks } from './sight';
import { Subject } from './subject';

const VIEWS: ViewName[] = ['free', 'front', 'side', 'top', 'palm', 'follow'];
/** Width by height of pictures: a phone's, a page's, a projector's. */
const ASPECTS = [390 / 470, 948 / 692, 16 / 9];
const PANE = { left: 0.94, right: 0.94, top: 0.94, bottom: 0.8 };

const box = (position: Vec3, half: Vec3): Body['parts'][number] => ({
  position,
  quat: [0, 0, 0, 1],
  shape: { type: 'box', half_extents: half, rounding: 0 },
});
const body = (id: number, kind: Body['kind'], position: Vec3, ...parts: Body['parts']): Body => ({
  id,
  name: `${kind} ${id}`,
  kind,
  position,
  quat: [0, 0, 0, 1],
  color: [1, 1, 1],
  parts,
});

/** Two boxes on a ground as in the task `balls`; a palm with four fingers along z and a thumb. */
const scene: SceneInfo = {
  bodies: [
    body(0, 'object', [0.1, 0, 0.05], { position: [0, 0, 0], quat: [0, 0, 0, 1], shape: { type: 'sphere', radius: 0.05 } }),
    body(1, 'furniture', [0, 0, 0], box([0.35, 0, -0.055], [1.5, 1.2, 0.05])),
    ...[0, 0.7].map((x, k) =>
      body(
        2 + k,
        'furniture',
        [x, 0, 0],
        box([0, 0, -0.0025], [0.25, 0.25, 0.0025]),
        box([0.25, 0, 0.15], [0.0025, 0.25, 0.15]),
        box([0, -0.25, 0.15], [0.25, 0.0025, 0.15]),
      ),
    ),
    body(10, 'hand', [0, 0, 0], box([0, 0, 0.05], [0.015, 0.04, 0.05])),
    ...[-0.03, -0.01, 0.01, 0.03].map((y, k) => body(11 + k, 'hand', [0, 0, 0], box([0, y, 0.14], [0.008, 0.008, 0.04]))),
    body(15, 'hand', [0, 0, 0], box([0.03, 0.05, 0.09], [0.02, 0.01, 0.01])),
  ],
  moving: [0, 10, 11, 12, 13, 14, 15],
  regions: [
    { name: 'a', role: 'start', min: [-0.25, -0.25, 0], max: [0.25, 0.25, 0.3] },
    { name: 'b', role: 'goal', min: [0.45, -0.25, 0], max: [0.95, 0.25, 0.3] },
  ],
  goals: [],
} as SceneInfo;

class Shot {
  readonly camera: PerspectiveCamera;
  readonly controls: { target: Vector3; update(): boolean };
  readonly director: Director;
  readonly subject = new Subject(scene);
  private now = 0;

  constructor(aspect: number) {
    this.camera = new PerspectiveCamera(45, aspect, 0.01, 50);
    this.camera.up.set(0, 0, 1);
    this.controls = {
      target: new Vector3(),
      update: () => {
        this.camera.lookAt(this.controls.target);
        this.camera.updateMatrixWorld();
        return true;
      },
    };
    this.director = new Director(this.camera, this.controls as unknown as OrbitControls);
  }

  /** A frame after `passed` ms with the hand at a pose. */
  frame(position: Vec3, quat: Quat, passed = 16): void {
    const place = matrixOf({ position, quat });
    this.subject.place((id, into) => (id >= 10 ? into.copy(place) : into.makeTranslation(0.1, 0, 0.05)));
    this.now += passed;
    this.director.frame(this.subject, PANE, this.now, false);
    this.camera.updateMatrixWorld();
  }

  seen(points: readonly Vector3[]): { x: [number, number]; y: [number, number]; inside: boolean; share: number } {
    const at = points.map((point) => point.clone().project(this.camera));
    const range = (of: (p: Vector3) => number): [number, number] => [Math.min(...at.map(of)), Math.max(...at.map(of))];
    const [x, y] = [range((p) => p.x), range((p) => p.y)];
    // Height 2 in projected units; the width has the aspect.
    const shorter = 2 * Math.min(1, this.camera.aspect);
    const share = Math.max((x[1] - x[0]) * this.camera.aspect, y[1] - y[0]) / shorter;
    return { x, y, inside: x[0] > -0.95 && x[1] < 0.95 && y[0] > -0.81 && y[1] < 0.95 && at.every(({ z }) => z < 1), share };
  }
}

const POSTURES: Quat[] = [
  [0, 1, 0, 0],
  [0, 0, 0, 1],
  [-Math.SQRT1_2, 0, 0, Math.SQRT1_2],
  [0, Math.SQRT1_2, 0, Math.SQRT1_2],
  [0, -Math.SQRT1_2, 0, Math.SQRT1_2],
  [0.5, 0.5, 0.5, 0.5],
];
const PLACES: Vec3[] = [
  [0, 0, 0.75],
  [0, 0, 0.22],
  [0.7, 0, 0.3],
  [0, 0, 2],
  [2, 2, 2],
  [-2, 2, 1],
  [2, -2, 0.3],
  [-2, -2, 2],
];

// Hundreds of pictures: a busy machine takes longer than the usual limit.
describe('the camera', { timeout: 60_000 }, () => {
  it('has the hand in every view, whatever its pose, and in a view of the scene all of that, too', () => {
    for (const aspect of ASPECTS)
      for (const view of VIEWS) {
        const shot = new Shot(aspect);
        shot.director.start(view);
        for (const quat of POSTURES)
          for (const place of PLACES) {
            shot.frame(place, quat);
            const where = `${view} at ${aspect.toFixed(2)}, hand at ${place.join(', ')}, ${quat.join(', ')}`;
            const hand = shot.seen(shot.subject.hand);
            expect(hand.inside, where).toBe(true);
            if (view === 'palm' || view === 'follow') {
              expect(hand.share, where).toBeGreaterThan(0.3);
              expect(shot.camera.position.z, where).toBeGreaterThan(-0.005);
            } else {
              expect(shot.seen(shot.subject.scene).inside, where).toBe(true);
            }
          }
      }
  });

  it('keeps a hand that moves steadily, without a jump', () => {
    for (const view of VIEWS) {
      const shot = new Shot(4 / 3);
      shot.director.start(view);
      let [least, most] = [Infinity, 0];
      const before = new Vector3();
      for (let k = 0; k <= 300; k += 1) {
        const up = Math.sin((Math.PI * k) / 300);
        shot.frame(
          [0.7 * up, -0.5 * up, 0.3 + 1.7 * up],
          new Quaternion().setFromAxisAngle(new Vector3(0, 1, 0), Math.PI * (1 - 0.4 * up)).toArray() as Quat,
        );
        const { inside, share } = shot.seen(shot.subject.hand);
        expect(inside, `${view}, frame ${k}`).toBe(true);
        if (k > 0) most = Math.max(most, before.distanceTo(shot.camera.position));
        before.copy(shot.camera.position);
        least = Math.min(least, share);
      }
      expect(most, view).toBeLessThan(0.25);
      if (view === 'palm' || view === 'follow') expect(least, view).toBeGreaterThan(0.3);
    }
  });

  it('comes near again when the hand is back', () => {
    const shot = new Shot(4 / 3);
    shot.director.start('free');
    shot.frame([0, 0, 0.4], [0, 1, 0, 0]);
    const begin = shot.camera.position.clone();
    shot.frame([0, 0, 2], [0, 1, 0, 0]);
    expect(shot.camera.position.distanceTo(begin)).toBeGreaterThan(1);
    for (let k = 0; k < 200; k += 1) shot.frame([0, 0, 0.4], [0, 1, 0, 0]);
    expect(shot.camera.position.distanceTo(begin)).toBeLessThan(0.1);
  });

  it('looks into the palm from above the ground, past what hides it', () => {
    const shot = new Shot(4 / 3);
    shot.director.start('palm');
    for (const height of [0.75, 0.35, 0.25]) {
      // Fingers along −z: the board of the box is below, and the ball beside.
      for (let k = 0; k < 60; k += 1) shot.frame([0, 0, height], [0, 1, 0, 0]);
      const hides = shot.subject.blockers.filter(({ kind }) => kind !== 'wall');
      const seen = shot.subject.links.filter((link) => !hides.some((blocker) => blocks(blocker, shot.camera.position, link)));
      expect(seen.length, `at ${height}`).toBe(shot.subject.links.length);
    }
  });

  it('belongs to a person who moved it, and keeps the hand that is in the picture', () => {
    const shot = new Shot(4 / 3);
    shot.director.start('free');
    shot.frame([0, 0, 0.4], [0, 1, 0, 0]);
    shot.camera.position.lerp(shot.controls.target, 0.1);
    shot.director.taken(shot.subject);
    const own = shot.camera.position.clone();
    shot.frame([0, 0, 0.41], [0, 1, 0, 0]);
    expect(shot.camera.position.distanceTo(own)).toBe(0);
    shot.frame([0, 0, 1.8], [0, 1, 0, 0]);
    expect(shot.seen(shot.subject.hand).inside).toBe(true);
    // A person who looks away from the hand keeps that direction.
    shot.camera.position.add(new Vector3(3, 0, 0));
    shot.controls.target.add(new Vector3(3, 0, 0));
    shot.controls.update();
    shot.director.taken(shot.subject);
    const away = shot.camera.position.clone();
    shot.frame([0, 0, 1.9], [0, 1, 0, 0]);
    expect(shot.camera.position.distanceTo(away)).toBe(0);
  });
});
