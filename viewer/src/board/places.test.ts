import { expect, test } from 'vitest';
import { standing } from './places';

const info = { mode: 'official', phase: 'open', places: { total: 3, playing: 2, free_within_s: 0 } } as const;

test('phase, pause, places and the next slot are sentences', () => {
  expect(standing({ mode: 'practice' })).toBe('');
  expect(standing({ mode: 'official', phase: 'closed' })).toBe('The competition is not open yet.');
  expect(standing({ ...info, places: { ...info.places, playing: 0 } })).toBe('The competition is open.');
  expect(standing(info)).toBe('The competition is open. 2 of 3 places are in use.');
  expect(standing({ ...info, places: { total: 3, playing: 3, free_within_s: 125 } })).toBe(
    'The competition is open. All 3 places are in use; the next is free in at most 2:05.',
  );
  expect(standing({ ...info, places: { total: 3, playing: 3, free_within_s: null } })).toBe(
    'The competition is open. All 3 places are in use.',
  );
  expect(standing({ ...info, worlds: { max: 3, busy: 2, idle: 0, waiting: 2 } })).toBe(
    'The competition is open. 2 of 3 places are in use. 2 teams wait for a place.',
  );
  expect(standing({ ...info, paused_unix_ms: 5 })).toBe('The competition is paused: all clocks are stopped.');
  const schedule = { slots: 4, running: 2, next_unix_ms: Date.now() + 1000, ends_unix_ms: Date.now() + 9000 };
  expect(standing({ ...info, schedule })).toMatch(/2 of 3 places are in use\. The next slot begins at \d\d:\d\d\.$/);
});
