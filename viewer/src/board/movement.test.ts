import { expect, test } from 'vitest';
import { columns, replayIsOpen } from './model';
import { differs, moveMark, movement, announcementOf } from './movement';
import type { LeaderboardRow } from '../wire/messages';

function row(rank: number, team: string, total: number): LeaderboardRow {
  const best = { score: total, run_id: `run_${team}`, status: 'verified', ended_unix_ms: 0 };
  return { rank, team, total, runs: 1, reached_unix_ms: 0, sensors_only: false, sensors_rank: null, tasks: { balls: best } };
}

test('at first nobody has moved', () => expect(movement(null, [row(1, 'a', 3)]).size).toBe(0));

test('who overtakes goes up, who is overtaken goes down, others stand', () => {
  const before = [row(1, 'a', 3), row(2, 'b', 2), row(3, 'c', 1), row(4, 'd', 0)];
  const now = [row(1, 'c', 4), row(2, 'a', 3), row(3, 'b', 2), row(4, 'd', 0)];
  const moves = movement(before, now);
  expect([...moves]).toEqual([
    ['c', { places: 2, gained: 3 }],
    ['a', { places: -1, gained: 0 }],
    ['b', { places: -1, gained: 0 }],
  ]);
  expect(moveMark({ places: 2, gained: 3 })).toEqual({ sign: '▲2', words: 'up 2 places', way: 'up' });
  expect(moveMark({ places: -1, gained: 0 })).toEqual({ sign: '▼1', words: 'down 1 place', way: 'down' });
  expect(moveMark({ places: 0, gained: 1 }).sign).toBe('+1');
  expect(announcementOf(moves, now)).toBe('c is 1st with 4.0 points');
});

test('a new team is new, a falling total has a mark', () => {
  const moves = movement([row(1, 'a', 3)], [row(1, 'a', 2), row(2, 'b', 1)]);
  expect(moves.get('b')).toEqual({ places: null, gained: 1 });
  expect(moves.get('a')).toEqual({ places: 0, gained: -1 });
  expect(moveMark({ places: 0, gained: -1 }).words).toBe('−1 points');
  expect(differs([row(1, 'a', 3)], [row(1, 'a', 3)])).toBe(false);
});

test('columns of today come first', () =>
  expect(columns({ tasks: ['shelf', 'grasp'], rows: [row(1, 'a', 1)] })).toEqual(['shelf', 'grasp', 'balls']));

test('replays of official runs are closed until the seeds are public', () => {
  expect(replayIsOpen({ mode: 'practice' })).toBe(true);
  expect(replayIsOpen({ mode: 'official', phase: 'open' })).toBe(false);
  expect(replayIsOpen({ mode: 'official', phase: 'revealed' })).toBe(true);
});
