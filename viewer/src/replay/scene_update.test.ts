import { expect, it } from 'vitest';
import { entity } from './fixture';
import { bodiesOf } from './scene_update';

it('gives ids as contacts use them: bodies of the scene in order, then the hand’s links', () => {
  const made = bodiesOf([entity('hand/palm', 'hand/palm'), entity('ball', 'ball'), entity('table', 'world')]);
  expect(made.map(({ body }) => [body.id, body.name, body.kind])).toEqual([
    [0, 'ball', 'object'],
    [1, 'table', 'furniture'],
    [2, 'palm', 'hand'],
  ]);
  expect(made[0]?.body.color).toEqual([1, 0, 0]);
});

it('converts sizes to radii and half extents', () => {
  const all = entity('thing', 'thing');
  const one = all.spheres[0];
  if (!one) throw new Error('no sphere');
  const sized = { ...one, size: { x: 2, y: 4, z: 6 } };
  const triangles = { pose: one.pose, color: one.color, points: [{ x: 1, y: 2, z: 3 }], colors: [], indices: [] };
  const shapes = bodiesOf([
    { ...all, cubes: [sized], cylinders: [{ ...sized, bottom_scale: 1, top_scale: 1 }], triangles: [triangles] },
  ])[0]?.body.parts.map((part) => part.shape);
  expect(shapes).toEqual([
    { type: 'box', half_extents: [1, 2, 3], rounding: 0 },
    { type: 'sphere', radius: 0.05 },
    { type: 'cylinder', radius: 1, half_length: 3 },
    { type: 'hull', points: [[1, 2, 3]], rounding: 0 },
  ]);
});
