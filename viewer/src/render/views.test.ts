import { PerspectiveCamera, Vector3 } from 'three';
import { describe, expect, it } from 'vitest';
import { pointsOf } from './points';
import { frame } from './views';
import type { SceneInfo } from '../model/scene';

const scene: SceneInfo = {
  bodies: [
    { id: 0, name: 'ball', kind: 'object', position: [0.5, 0.1, 0.05], quat: [0, 0, 0, 1], color: [1, 0, 0], parts: [{ position: [0, 0, 0], quat: [0, 0, 0, 1], shape: { type: 'sphere', radius: 0.05 } }] },
    { id: 1, name: 'ground', kind: 'furniture', position: [0, 0, 0], quat: [0, 0, 0, 1], color: [1, 1, 1], parts: [{ position: [0, 0, -0.1], quat: [0, 0, 0, 1], shape: { type: 'box', half_extents: [3, 3, 0.1], rounding: 0 } }] },
  ],
  moving: [0], regions: [{ name: 'a', min: [-0.2, -0.2, 0], max: [0.2, 0.2, 0.3] }], goals: [],
};

describe('the camera of a whole scene', () => {
  it('shows every point, and they fill the view in one direction', () => {
    const points = pointsOf(scene);
    expect(points.length).toBe(16);
    for (const aspect of [0.6, 1.27, 2.5]) for (const from of [new Vector3(0.55, -1, 0.7), new Vector3(0, -0.001, 1)]) {
      const camera = new PerspectiveCamera(45, aspect, 0.01, 50);
      camera.up.set(0, 0, 1);
      const controls = { target: new Vector3(), update: () => { camera.lookAt(controls.target); camera.updateMatrixWorld(); return true; } };
      frame(camera, controls as never, points, from);
      const seen = points.map((point) => point.clone().project(camera));
      const [wide, tall] = [Math.max(...seen.map(({ x }) => Math.abs(x))), Math.max(...seen.map(({ y }) => Math.abs(y)))];
      expect(Math.max(wide, tall)).toBeCloseTo(0.94, 3);
      expect(seen.every(({ z }) => z < 1)).toBe(true);
    }
  });
});
