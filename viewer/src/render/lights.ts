/** Lights, and a ground with shadows that show how high bodies are. */
import {
  DirectionalLight, GridHelper, HemisphereLight, Mesh, PlaneGeometry, type Scene, ShadowMaterial,
} from 'three';

/** Half the edge of the ground that has shadows, m. */
const LIT_M = 1.4;

/** Lights and ground of a scene. */
export interface Lights {
  /** Draws shadows, or none. */
  setShadows(on: boolean): void;
  /** Removes and frees them. */
  dispose(): void;
}

/** Adds lights and ground to a three.js scene. */
export function addLights(scene: Scene): Lights {
  const sky = new HemisphereLight('#ffffff', '#b3ada5', 1.5);
  const sun = new DirectionalLight('#ffffff', 2.1);
  sun.position.set(0.7, -0.9, 2.6);
  sun.castShadow = true;
  sun.shadow.mapSize.set(2048, 2048);
  const eye = sun.shadow.camera;
  [eye.left, eye.right, eye.top, eye.bottom, eye.near, eye.far] = [-LIT_M, LIT_M, LIT_M, -LIT_M, 0.1, 6];
  sun.shadow.normalBias = 0.004;
  const floor = new Mesh(new PlaneGeometry(8, 8), new ShadowMaterial({ opacity: 0.28 }));
  floor.receiveShadow = true;
  floor.position.z = -0.0005;
  const grid = new GridHelper(4, 40, '#7b838c', '#a5acb4').rotateX(Math.PI / 2);
  grid.position.z = -0.001;
  grid.material.transparent = true;
  grid.material.opacity = 0.35;
  scene.add(sky, sun, sun.target, floor, grid);
  return {
    setShadows(on) {
      sun.castShadow = on;
      // It shows nothing but shadows.
      floor.visible = on;
    },
    dispose() {
      for (const one of [sky, sun, sun.target, floor, grid]) one.removeFromParent();
      sun.dispose();
      for (const one of [floor, grid]) one.geometry.dispose();
      floor.material.dispose();
      grid.material.dispose();
    },
  };
}
