/** Where the camera stands. */
import { Box3, type PerspectiveCamera, Vector3 } from 'three';
import type { OrbitControls } from 'three/addons/controls/OrbitControls.js';

export type ViewName = 'free' | 'follow' | 'front' | 'side' | 'top' | 'palm';

/** From where the named views look, as directions from what is looked at. */
const FROM: Record<'front' | 'side' | 'top', Vector3> = {
  front: new Vector3(0, -1, 0.25),
  side: new Vector3(1, 0, 0.25),
  top: new Vector3(0, -0.001, 1),
};

/** Places the camera so that a box fills most of the picture, seen along a direction. */
export function frame(camera: PerspectiveCamera, controls: OrbitControls, box: Box3, from: Vector3): void {
  const centre = box.getCenter(new Vector3());
  const radius = Math.max(box.getSize(new Vector3()).length() / 2, 0.1);
  const half = (camera.fov * Math.PI) / 360;
  const fit = radius / Math.sin(Math.atan(Math.tan(half) * Math.min(1, camera.aspect)));
  camera.position.copy(centre).addScaledVector(from.clone().normalize(), fit * 0.85);
  controls.target.copy(centre);
  controls.update();
}

/** A named view of what is in the box; the palm's is seen from below the hand. */
export function look(camera: PerspectiveCamera, controls: OrbitControls, name: ViewName, box: Box3, hand: Vector3 | null): void {
  if (name === 'front' || name === 'side' || name === 'top') frame(camera, controls, box, FROM[name]);
  else if (name === 'palm' && hand) {
    controls.target.copy(hand);
    camera.position.set(hand.x + 0.05, hand.y - 0.35, hand.z - 0.25);
    controls.update();
  } else if (name === 'follow' && hand) {
    const back = camera.position.clone().sub(controls.target).setLength(0.7);
    controls.target.copy(hand);
    camera.position.copy(hand).add(back);
    controls.update();
  } else if (name === 'free') frame(camera, controls, box, new Vector3(0.55, -1, 0.7));
}
