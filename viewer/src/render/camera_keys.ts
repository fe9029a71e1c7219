/** Moves the camera by keys. z points up. */
import type { PerspectiveCamera } from 'three';
import type { OrbitControls } from 'three/addons/controls/OrbitControls.js';

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
