import { expect, test } from 'vitest';
import { inOrder, leftAt, readClock, state } from './clocks';
import type { Session } from '../wire/messages';

const session = (over: Partial<Session>): Session => ({
  session_id: 's',
  team: 't',
  mode: 'official',
  status: 'open',
  client_version: null,
  limit_s: 100,
  clock_wall_s: 0,
  clock_simulated_s: 0,
  refunded_s: 0,
  paused_unix_ms: null,
  pauses: 0,
  created_unix_ms: 0,
  ended_unix_ms: null,
  runs: 0,
  elapsed_s: 10,
  left_s: 90,
  ...over,
});

test('a clock runs only after two readings in which it moved', () => {
  const first = readClock(session({}), 0, undefined);
  expect(leftAt(first, 5000)).toBe(90);
  const second = readClock(session({ elapsed_s: 12, left_s: 88 }), 2000, first);
  expect(leftAt(second, 3500)).toBeCloseTo(86.5);
  expect(leftAt(second, 1e9)).toBe(0);
  const third = readClock(session({ elapsed_s: 12, left_s: 88 }), 4000, second);
  expect(third.going).toBe(false);
});

test('a paused clock does not run, a clock without a limit shows none', () => {
  const before = readClock(session({}), 0, undefined);
  expect(readClock(session({ elapsed_s: 11, paused_unix_ms: 1 }), 1000, before).going).toBe(false);
  expect(leftAt(readClock(session({ left_s: null }), 0, undefined), 9)).toBeNull();
});

test('states have words', () => {
  expect(state(session({}), true).word).toBe('running');
  expect(state(session({ paused_unix_ms: 5 }), true).word).toBe('paused');
  expect(state(session({ place_in_queue: 2 }), false).word).toBe('waits, no. 2');
  expect(state(session({ elapsed_s: 0 }), false).word).toBe('not started');
  expect(state(session({ left_s: 0 }), false).word).toBe('time is up');
  expect(state(session({ status: 'voided' }), false).word).toBe('voided');
});

test('open sessions are first', () => {
  const order = inOrder([
    session({ session_id: 'a', status: 'ended', created_unix_ms: 9 }),
    session({ session_id: 'b', team: 'z' }),
    session({ session_id: 'c', team: 'y' }),
  ]);
  expect(order.map((one) => one.session_id)).toEqual(['c', 'b', 'a']);
});
