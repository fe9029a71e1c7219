/** Session clocks between two readings: a clock that moved continues with wall-clock time. s. */
import type { Session } from '../wire/messages';

/** A reading of a clock; `at` as of performance.now(). */
export interface ClockReading {
  at: number;
  left: number | null;
  elapsed: number;
  going: boolean;
}

/** A new reading; `before` is the previous one. */
export function readClock(
  session: Pick<Session, 'status' | 'paused_unix_ms' | 'elapsed_s' | 'left_s'>,
  at: number,
  before: ClockReading | undefined,
): ClockReading {
  const open = session.status === 'open' && session.paused_unix_ms === null;
  const going = open && before !== undefined && session.elapsed_s > before.elapsed + 1e-3;
  return { at, left: session.left_s, elapsed: session.elapsed_s, going };
}

/** Time left at a moment, never below zero. */
export function leftAt(reading: ClockReading, at: number): number | null {
  if (reading.left === null) return null;
  return Math.max(0, reading.left - (reading.going ? Math.max(0, at - reading.at) / 1000 : 0));
}

/** The state of a session as a word and a colour. */
export function state(
  session: Pick<Session, 'status' | 'paused_unix_ms' | 'elapsed_s' | 'left_s' | 'place_in_queue'>,
  going: boolean,
): { word: string; colour: 'ok' | 'warn' | 'info' | 'soft' } {
  if (session.status !== 'open') return { word: session.status, colour: 'soft' };
  if (session.paused_unix_ms !== null) return { word: 'paused', colour: 'warn' };
  if (typeof session.place_in_queue === 'number') return { word: `waits, no. ${session.place_in_queue}`, colour: 'warn' };
  if (session.left_s !== null && session.left_s <= 0) return { word: 'time is up', colour: 'soft' };
  if (session.elapsed_s <= 0) return { word: 'not started', colour: 'info' };
  return going ? { word: 'running', colour: 'ok' } : { word: 'open', colour: 'info' };
}

/** Open sessions first, by team, so that rows keep their places; then the newest. */
export function inOrder(sessions: readonly Session[]): Session[] {
  const open = (one: Session): number => (one.status === 'open' ? 0 : 1);
  return [...sessions].sort(
    (a, b) =>
      open(a) - open(b) ||
      (open(a) === 0 ? a.team.localeCompare(b.team) : b.created_unix_ms - a.created_unix_ms) ||
      a.session_id.localeCompare(b.session_id),
  );
}
