import { expect, test } from 'vitest';
import { type HandShapes, hull, outlines, place, turntable, VIEWS } from './outline';

test('the hull of a square is its corners', () => {
  const square: [number, number][] = [
    [0, 0],
    [1, 0],
    [1, 1],
    [0, 1],
    [0.5, 0.5],
    [0.5, 0],
  ];
  expect(hull(square)).toEqual([
    [0, 0],
    [1, 0],
    [1, 1],
    [0, 1],
  ]);
});

test('a quarter turn about z takes x to y', () => {
  const half = Math.SQRT1_2;
  const [x, y, z] = place({ position: [1, 0, 0], quat_xyzw: [0, 0, half, half] }, [1, 0, 0]);
  expect([x, y, z].map((v) => Math.round(v * 1e9) / 1e9)).toEqual([1, 1, 0]);
});

test('a box has its true edges, and the nearer one is last', () => {
  const box = {
    position: [0, 0, 0] as [number, number, number],
    quat_xyzw: [0, 0, 0, 1] as [number, number, number, number],
    shape: { type: 'box' as const, half_extents: [0.1, 0.2, 0.3] as [number, number, number], rounding: 0 },
    friction: 1,
  };
  const at = (x: number) => ({
    position: [x, 0, 0] as [number, number, number],
    quat_xyzw: [0, 0, 0, 1] as [number, number, number, number],
  });
  const hand: HandShapes = {
    name: 'h',
    links: [
      { base_from_link_at_rest: at(1), shapes: [box] },
      { base_from_link_at_rest: at(0), shapes: [box] },
    ],
  };
  const seen = outlines(hand, VIEWS.palm);
  expect(seen.map((one) => one.link)).toEqual([1, 0]);
  expect(Math.max(...seen.flatMap((one) => one.corners.map((c) => c[1])))).toBeCloseTo(0.3);
  expect(Math.max(...seen.flatMap((one) => one.corners.map((c) => c[0])))).toBeCloseTo(0.2);
});

test('every view is a rotation', () => {
  for (const { right, up, near } of [...Object.values(VIEWS), turntable(0.7), turntable(4)]) {
    const cross = [right[1] * up[2] - right[2] * up[1], right[2] * up[0] - right[0] * up[2], right[0] * up[1] - right[1] * up[0]];
    cross.forEach((value, i) => expect(value).toBeCloseTo(near[i] ?? NaN));
  }
});
