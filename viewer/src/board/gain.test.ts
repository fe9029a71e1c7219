import { expect, test } from 'vitest';
import { gainWords, worthOf } from './gain';

const balls = { goal: 1, penalty: -0.5 };

test('a ball is +1, also one that was outside before', () => {
  expect(gainWords(1, 1, balls)).toBe('+1');
  expect(gainWords(1.5, 1, balls)).toBe('+1 (−0.5 taken back)');
  expect(gainWords(3, 2, balls)).toBe('+2 (−1 taken back)');
  expect(gainWords(0.5, 0, balls)).toBe('−0.5 taken back');
  expect(gainWords(-0.5, 0, balls)).toBe('−0.5');
});

test('a change that these objects do not explain keeps its number', () => {
  expect(gainWords(2.25, 1, balls)).toBe('+2.3');
  expect(gainWords(0.5, 1, balls)).toBe('+0.5');
  expect(gainWords(5, 1, { goal: 5, penalty: 0 })).toBe('+5');
  expect(gainWords(3, 0, null)).toBe('+3');
});

test('the points are those of the task', () => {
  const goal = { name: 'in_goal', points: 1, for_s: 0, inside: 'box_b' };
  const outside = { name: 'outside', points: -0.5, for_s: 0, outside: ['box_a', 'box_b'] };
  expect(worthOf([goal, outside])).toEqual(balls);
  expect(worthOf([goal])).toEqual({ goal: 1, penalty: 0 });
  expect(worthOf([{ ...goal, object: 'peg' }])).toBeNull();
  expect(worthOf([])).toBeNull();
  expect(worthOf(undefined)).toBeNull();
});
