import { expect, test } from 'vitest';
import type { Body, Part, SceneInfo } from '../model/scene';
import { splitFurniture } from './furniture';

const box = (x: number, y: number, z: number, at: [number, number, number] = [0, 0, 0], quat: Part['quat'] = [0, 0, 0, 1]): Part => ({
  position: at,
  quat,
  shape: { type: 'box', half_extents: [x, y, z], rounding: 0 },
});
const body = (...parts: Part[]): Body => ({
  id: 3,
  name: 'shelf',
  kind: 'furniture',
  position: [0, 0, 1],
  quat: [0, 0, 0, 1],
  color: [1, 1, 1],
  parts,
});
const scene = (...bodies: Body[]): SceneInfo => ({ bodies, moving: [], regions: [] });

test('the lowest board carries objects; lids and walls have an outer face; the ground is a part of its own', () => {
  const turned = Math.SQRT1_2;
  const [lid, floor, wall, block] = [
    box(0.3, 0.2, 0.01, [0, 0, 0.4]),
    box(0.3, 0.01, 0.2, [0, 0, 0], [turned, 0, 0, turned]),
    box(0.3, 0.01, 0.2, [0, -0.2, 0.2]),
    box(0.1, 0.1, 0.1, [0, 0, 0.1]),
  ];
  const { panels, grounds } = splitFurniture(scene(body(lid, floor, wall, block)));
  expect(panels.map(({ body: one }) => one.parts)).toEqual([[lid], [floor], [wall], [block]]);
  expect(panels.map(({ outward }) => outward?.toArray().map((x) => Math.round(x) + 0) ?? null)).toEqual([
    [0, 0, 1],
    null,
    [0, -1, 0],
    null,
  ]);
  expect(panels.map(({ body: one }) => one.id)).toEqual([0, 1, 2, 3]);
  expect(grounds).toEqual([]);
  const ground = body(box(1.5, 1.5, 0.005));
  expect(splitFurniture(scene(ground))).toEqual({ panels: [], grounds: [ground] });
});
