import { expect, test } from 'vitest';
import type { Body, Part } from '../model/scene';
import { splitFurniture } from './furniture';

const box = (x: number, y: number, z: number, at = 0, quat: Part['quat'] = [0, 0, 0, 1]): Part => ({ position: [0, 0, at], quat, shape: { type: 'box', half_extents: [x, y, z], rounding: 0 } });
const body = (...parts: Part[]): Body => ({ id: 3, name: 'shelf', kind: 'furniture', position: [0, 0, 1], quat: [0, 0, 0, 1], color: [1, 1, 1], parts });

test('the lowest board of a body is opaque; lids, walls and blocks are transparent; the ground is apart', () => {
  const turned = Math.SQRT1_2;
  const shelf = body(box(0.3, 0.2, 0.01, 0.4), box(0.3, 0.01, 0.2, 0, [turned, 0, 0, turned]), box(0.3, 0.01, 0.2), box(0.1, 0.1, 0.1));
  const { boards, walls } = splitFurniture([shelf]);
  expect(boards.map((one) => [one.id, one.parts])).toEqual([[3, [shelf.parts[1]]]]);
  expect(walls.map((one) => one.parts)).toEqual([[shelf.parts[0], shelf.parts[2], shelf.parts[3]]]);
  const ground = body(box(1.5, 1.5, 0.005));
  expect(splitFurniture([ground])).toEqual({ boards: [], walls: [], grounds: [ground] });
  expect(splitFurniture([])).toEqual({ boards: [], walls: [], grounds: [] });
});
