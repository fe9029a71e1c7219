/** Named camera views, and following the hand. z points up. */
import { type Matrix4, type PerspectiveCamera, Vector3 } from 'three';
import type { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import type { Palm } from '../model/palm';

export type ViewName = 'free' | 'follow' | 'front' | 'side' | 'top' | 'palm';

/** Directions from the target to the camera. */
const FROM: Record<'free' | 'front' | 'side' | 'top', Vector3> = {
  free: new Vector3(0.55, -1, 0.7),
  front: new Vector3(0, -1, 0.25),
  side: new Vector3(1, 0, 0.25),
  top: new Vector3(0, -0.001, 1),
};

/** Distance of the follow and palm cameras from the hand, m. */
const FOLLOW_M = 0.75;
const PALM_M = 0.42;
/** Share of the view's width and height that the scene may fill; the rest is for the buttons. */
const FILLED = 0.94;
/** Least distance of the camera from the nearest point, m. */
const NEAREST_M = 0.1;

/** Places the camera in a direction so that the points just fill the view. */
export function frame(camera: PerspectiveCamera, controls: OrbitControls, points: readonly Vector3[], from: Vector3): void {
  const back = from.clone().normalize();
  const right = new Vector3().crossVectors(camera.up, back).normalize();
  const up = new Vector3().crossVectors(back, right);
  const tall = FILLED * Math.tan((camera.fov * Math.PI) / 360);
  const [depths, x, y] = [back, right, up].map((axis) => points.map((point) => point.dot(axis))) as [number[], number[], number[]];
  const across = fit(x, depths, tall * camera.aspect);
  const upward = fit(y, depths, tall);
  const depth = Math.max(across.depth, upward.depth, Math.max(...depths) + NEAREST_M);
  const place = (at: number): Vector3 => right.clone().multiplyScalar(across.centre).addScaledVector(up, upward.centre).addScaledVector(back, at);
  camera.position.copy(place(depth));
  controls.target.copy(place((Math.min(...depths) + Math.max(...depths)) / 2));
  controls.update();
}

/**
 * Where a camera must be so that all points are within its half angle: its coordinate along `along`, and its depth. A point at
 * depth z needs |x − centre| ≤ tan · (depth − z).
 */
function fit(along: readonly number[], depths: readonly number[], tan: number): { centre: number; depth: number } {
  const high = Math.max(...along.map((x, k) => x + tan * (depths[k] ?? 0)));
  const low = Math.max(...along.map((x, k) => -x + tan * (depths[k] ?? 0)));
  return { centre: (high - low) / 2, depth: (high + low) / (2 * tan) };
}

/** Moves the camera to a named view of the points, or of the hand whose base is at `hand`. */
export function lookFrom(camera: PerspectiveCamera, controls: OrbitControls, name: ViewName, points: readonly Vector3[], hand: Matrix4 | null, palm: Palm): void {
  if (name === 'follow' || name === 'palm') {
    if (!hand) return;
    controls.target.set(...palm.middle).applyMatrix4(hand);
    const back = name === 'palm' ? new Vector3(...palm.direction).transformDirection(hand).multiplyScalar(PALM_M) : FROM.free.clone().setLength(FOLLOW_M);
    camera.position.copy(controls.target).add(back);
    controls.update();
  } else {
    frame(camera, controls, points, FROM[name]);
  }
}

/** Moves the camera with the hand's base from `from` to `to`; with `turning` it also turns. */
export function followHand(camera: PerspectiveCamera, controls: OrbitControls, from: Matrix4, to: Matrix4, turning: boolean): void {
  if (from.equals(to)) return;
  if (turning) {
    const step = to.clone().multiply(from.clone().invert());
    controls.target.applyMatrix4(step);
    camera.position.applyMatrix4(step);
  } else {
    const step = new Vector3().setFromMatrixPosition(to).sub(new Vector3().setFromMatrixPosition(from));
    controls.target.add(step);
    camera.position.add(step);
  }
  camera.lookAt(controls.target);
}

const TURNS: Record<string, [number, number]> = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
const ZOOMS: Record<string, number> = { '+': 0.9, '=': 0.9, '-': 1 / 0.9 };

/** Arrow keys turn the camera about its target, plus and minus zoom. Returns whether the key is one of these. */
export function turnByKey(camera: PerspectiveCamera, controls: OrbitControls, key: string): boolean {
  const turn = TURNS[key];
  const zoom = ZOOMS[key];
  if (!turn && zoom === undefined) return false;
  const offset = camera.position.clone().sub(controls.target);
  const length = offset.length() * (zoom ?? 1);
  const [around, polar] = turn ?? [0, 0];
  const azimuth = Math.atan2(offset.y, offset.x) + around;
  const down = Math.min(Math.max(Math.acos(offset.z / offset.length()) + polar, 0.02), Math.PI - 0.02);
  offset.set(Math.cos(azimuth) * Math.sin(down), Math.sin(azimuth) * Math.sin(down), Math.cos(down)).multiplyScalar(length);
  camera.position.copy(controls.target).add(offset);
  controls.update();
  return true;
}
