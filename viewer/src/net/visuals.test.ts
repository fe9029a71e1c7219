import { expect, test } from 'vitest';
import type { SceneInfo } from '../model/scene';
import { withVisuals, partsOf } from './visuals';

test('meshes are decoded from base64, and links without visuals keep their collision shapes', () => {
  const corners = new Float32Array([0, 0, 0, 1, 0, 0, 0, 0.5, -2]);
  const triangles = btoa(String.fromCharCode(...new Uint8Array(corners.buffer)));
  const links = partsOf([
    { link: 'palm', position: [0, 0, 1], quat_xyzw: [0, 0, 0, 1], shape: { type: 'mesh', triangles } },
    { link: 'palm', position: [0, 0, 0], quat_xyzw: [0, 0, 0, 1], shape: { type: 'sphere', radius: 0.1 } },
  ]);
  expect(links.get('palm')?.map((part) => part.shape)).toEqual([
    { type: 'mesh', corners },
    { type: 'sphere', radius: 0.1 },
  ]);
  const body = (name: string, kind: 'hand' | 'object'): SceneInfo['bodies'][number] => ({
    id: 0,
    name,
    kind,
    position: [0, 0, 0],
    quat: [0, 0, 0, 1],
    parts: [],
    color: [1, 1, 1],
  });
  const scene: SceneInfo = { bodies: [body('palm', 'hand'), body('tip', 'hand'), body('palm', 'object')], moving: [], regions: [] };
  expect(withVisuals(scene, links).bodies.map(({ parts }) => parts.length)).toEqual([2, 0, 0]);
  expect(withVisuals(scene, new Map())).toBe(scene);
});
