/** Chooses the side from which a camera shows a hand: it tries directions around the wished one, with rays to the links. */
import { type Matrix4, Matrix4 as Transform, Vector3 } from 'three';
import type { Body } from '../model/scene';
import { boxOf, matrixOf } from './points';

/** A box that hides what is behind it. A wall becomes glass where it does. `body`: the id of the object, or of the panel. */
export interface Blocker {
  kind: 'board' | 'object' | 'wall';
  body: number;
  half: Vector3;
  inBody: Matrix4;
  fromWorld: Matrix4;
}

/** Angles around the wished direction, and directions at each. */
const RINGS_DEG = [25, 50, 75, 100];
const ON_RING = 8;
/** Greatest angle of a direction above or below the horizon: z of the world stays up in the picture. */
const STEEPEST = Math.sin((78 * Math.PI) / 180);
/** Least height of the camera above the ground, m. */
export const ABOVE_M = 0.04;
/** Weights: visible links, no glass between, near the wished direction, near the present one. */
const [SEEN, CLEAR, NEAR, STAYS] = [1.5, 0.3, 0.8, 0.25];

/** Boxes around the parts of bodies. */
export function blockersOf(kind: Blocker['kind'], bodies: readonly Body[]): Blocker[] {
  return bodies.flatMap((body) =>
    body.parts.map((part): Blocker => {
      const box = boxOf(part);
      const inBody = matrixOf(part).multiply(new Transform().makeTranslation(box.getCenter(new Vector3())));
      const blocker = { kind, body: body.id, half: box.getSize(new Vector3()).multiplyScalar(0.5), inBody, fromWorld: new Transform() };
      put(blocker, matrixOf(body));
      return blocker;
    }),
  );
}

/** Moves a blocker with its body. */
export function put(blocker: Blocker, body: Matrix4): void {
  blocker.fromWorld.multiplyMatrices(body, blocker.inBody).invert();
}

const [FROM, TO] = [new Vector3(), new Vector3()];

/** Whether the line between two points meets a blocker. */
export function blocks({ half, fromWorld }: Blocker, from: Vector3, to: Vector3): boolean {
  FROM.copy(from).applyMatrix4(fromWorld);
  TO.copy(to).applyMatrix4(fromWorld);
  let [enters, leaves] = [0, 1];
  for (const axis of ['x', 'y', 'z'] as const) {
    const [at, way, most] = [FROM[axis], TO[axis] - FROM[axis], half[axis]];
    if (Math.abs(way) < 1e-12) {
      if (Math.abs(at) > most) return false;
      continue;
    }
    const [one, other] = [(-most - at) / way, (most - at) / way];
    enters = Math.max(enters, Math.min(one, other));
    leaves = Math.min(leaves, Math.max(one, other));
    if (enters > leaves) return false;
  }
  return true;
}

/** The wished direction and others around it. */
function directions(wished: Vector3): Vector3[] {
  const aside = Math.abs(wished.z) < 0.9 ? new Vector3(0, 0, 1) : new Vector3(0, 1, 0);
  const across = new Vector3().crossVectors(wished, aside).normalize();
  const upward = new Vector3().crossVectors(across, wished);
  return [
    wished.clone(),
    ...RINGS_DEG.flatMap((degrees) =>
      Array.from({ length: ON_RING }, (_, k) => {
        const [tilt, turn] = [(degrees * Math.PI) / 180, (2 * Math.PI * k) / ON_RING];
        const aside = across.clone().multiplyScalar(Math.cos(turn)).addScaledVector(upward, Math.sin(turn));
        return aside.multiplyScalar(Math.sin(tilt)).addScaledVector(wished, Math.cos(tilt));
      }),
    ),
  ];
}

/** The unit direction, less steep if it is nearly vertical. */
export function lessSteep(towards: Vector3): Vector3 {
  const made = towards.clone().normalize();
  if (Math.abs(made.z) <= STEEPEST) return made;
  const flat = Math.hypot(made.x, made.y);
  const [x, y] = flat > 1e-6 ? [made.x / flat, made.y / flat] : [0, -1];
  const level = Math.sqrt(1 - STEEPEST ** 2);
  return made.set(x * level, y * level, Math.sign(made.z) * STEEPEST);
}

/**
 * The best direction of a camera at `distance` from the middle of `links`, m. `ground`: height of the ground, m; `present`: the
 * direction that the camera has, if any.
 */
export function bestDirection(
  links: readonly Vector3[],
  wished: Vector3,
  distance: number,
  blockers: readonly Blocker[],
  ground: number,
  present: Vector3 | null,
): Vector3 {
  const middle = links.reduce((sum, at) => sum.add(at), new Vector3()).divideScalar(Math.max(links.length, 1));
  const wish = lessSteep(wished);
  const camera = new Vector3();
  let [best, most] = [wish, -Infinity];
  for (const towards of [...(present ? [present] : []), ...directions(wish)]) {
    if (Math.abs(towards.z) > STEEPEST + 1e-9) continue;
    camera.copy(middle).addScaledVector(towards, distance);
    if (camera.z < ground + ABOVE_M) continue;
    let [seen, clear] = [0, 0];
    for (const link of links) {
      let [hidden, behindGlass] = [false, false];
      for (const blocker of blockers) {
        if ((blocker.kind === 'wall' ? behindGlass : hidden) || !blocks(blocker, camera, link)) continue;
        if (blocker.kind === 'wall') behindGlass = true;
        else hidden = true;
      }
      seen += hidden ? 0 : 1;
      clear += behindGlass ? 0 : 1;
    }
    const share = 1 / Math.max(links.length, 1);
    const value = SEEN * seen * share + CLEAR * clear * share + NEAR * towards.dot(wish) + (present ? STAYS * towards.dot(present) : 0);
    if (value > most + 1e-9) [best, most] = [towards, value];
  }
  // Under a low hand no direction may be left: the camera looks along the ground.
  if (most === -Infinity) best = new Vector3(wish.x, wish.y, 0.35).normalize();
  return best.clone();
}
