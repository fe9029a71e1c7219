import { describe, expect, it } from 'vitest';
import { countWords, placeWords } from './outcome';
import { eventWords } from './events';
import type { Body } from './scene';
import type { Verdict } from '../wire/messages';

const object = (id: number): Body => ({
  id,
  name: `object_${id}`,
  kind: 'object',
  position: [0, 0, 0],
  quat: [0, 0, 0, 1],
  parts: [],
  color: [1, 1, 1],
});
const GOALS = ['lid_lifted', 'lid_aside', 'pan_lifted', 'pan_level'];
const seen = (place: string, atRest: boolean, counts = false): Verdict => ({
  object: 0,
  counts,
  place,
  reasons: [{ rule: 'at_rest', holds: atRest, value: 0.2, limit: 0.005, unit: 'm/s' }],
});

describe('words about a run', () => {
  it('count goals where there are goals, and objects elsewhere', () => {
    const bodies = [object(0), object(1)];
    expect(countWords({ in_goal: 4, outside: 0 }, { bodies, goals: GOALS })).toBe('4 of 4 goals');
    expect(countWords({ in_goal: 1, outside: 1 }, { bodies, goals: [] })).toBe('1 of 2 objects in the goal, 1 outside');
    expect(countWords({ in_goal: 1, outside: 0 }, { bodies: [object(0)] })).toBe('1 of 1 object in the goal');
  });

  it('name goals in events, also where another rule has an event of this name', () => {
    expect(eventWords('lid_aside', GOALS)).toBe('reached goal 2 of 4: lid aside');
    expect(eventWords('lifted', ['lifted', 'entered'])).toBe('reached goal 1 of 2: lifted');
    expect(eventWords('lifted')).toBe('is lifted');
    expect(eventWords('in_goal')).toBe('is in the goal');
  });

  it('say that a carried object is on the way', () => {
    expect(placeWords(seen('on_the_way', false))).toBe(' does not count: on the way.');
    expect(placeWords(seen('outside', false))).toMatch(/^ is on the way\. It counts as outside until/);
    expect(placeWords(seen('outside', true))).toBe(' does not count: outside.');
    expect(placeWords(seen('goal', true, true))).toBe(' counts: goal.');
    expect(placeWords(seen('lid_aside', true), GOALS)).toBe(': next goal: lid aside (2 of 4).');
    expect(placeWords(seen('later', true), GOALS)).toBe(': another goal comes first.');
  });
});
