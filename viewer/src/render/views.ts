/** Named camera views, and following the hand. z points up. */
import { Box3, type Matrix4, type PerspectiveCamera, Vector3 } from 'three';
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
/** Margin around the box, which leaves space for the buttons. */
const MARGIN = 1.06;

/** Places the camera in a direction so that the corners of a box just fit into the view. */
export function frame(camera: PerspectiveCamera, controls: OrbitControls, box: Box3, from: Vector3): void {
  const centre = box.getCenter(new Vector3());
  const back = from.clone().normalize();
  const right = new Vector3().crossVectors(camera.up, back).normalize();
  const up = new Vector3().crossVectors(back, right);
  const tall = Math.tan((camera.fov * Math.PI) / 360);
  const wide = tall * camera.aspect;
  let distance = 0.2;
  for (let k = 0; k < 8; k += 1) {
    const corner = new Vector3(k & 1 ? box.max.x : box.min.x, k & 2 ? box.max.y : box.min.y, k & 4 ? box.max.z : box.min.z).sub(centre);
    const across = Math.max(Math.abs(corner.dot(right)) / wide, Math.abs(corner.dot(up)) / tall);
    distance = Math.max(distance, corner.dot(back) + MARGIN * across);
  }
  controls.target.copy(centre);
  camera.position.copy(centre).addScaledVector(back, distance);
  controls.update();
}

/** Moves the camera to a named view of the box, or of the hand whose base is at `hand`. */
export function lookFrom(camera: PerspectiveCamera, controls: OrbitControls, name: ViewName, box: Box3, hand: Matrix4 | null, palm: Palm): void {
  if (name === 'follow' || name === 'palm') {
    if (!hand) return;
    controls.target.set(...palm.middle).applyMatrix4(hand);
    const back = name === 'palm' ? new Vector3(...palm.direction).transformDirection(hand).multiplyScalar(PALM_M) : FROM.free.clone().setLength(FOLLOW_M);
    camera.position.copy(controls.target).add(back);
    controls.update();
  } else {
    frame(camera, controls, box, FROM[name]);
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
