import { expect, test } from 'vitest';
import { bestSoFar, ticks } from './score_chart';

test('the best so far never falls', () => {
  expect(bestSoFar([1, 3, 2, -1, 4])).toEqual([1, 3, 3, 3, 4]);
  expect(bestSoFar([])).toEqual([]);
});

test('lines are at round values around all scores', () => {
  expect(ticks(0, 10)).toEqual([0, 5, 10]);
  expect(ticks(0, 3)).toEqual([0, 1, 2, 3]);
  expect(ticks(-0.5, 9.6)).toEqual([-5, 0, 5, 10]);
  expect(ticks(0, 0)).toHaveLength(2);
  for (const [least, most] of [
    [0, 0.4],
    [-3, 47],
    [0, 50],
    [2, 2],
  ] as const) {
    const lines = ticks(least, most);
    expect(lines[0]).toBeLessThanOrEqual(least);
    expect(lines.at(-1)).toBeGreaterThanOrEqual(most);
    expect(lines.length).toBeLessThanOrEqual(6);
  }
});
