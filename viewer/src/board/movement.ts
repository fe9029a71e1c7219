/** Differences between two rankings. */
import { ordinal, points } from '../ui/format';
import type { LeaderboardRow } from '../wire/messages';

/** A team's change. `places` is positive for up, null for a new team; `gained` is in points. */
export interface Move {
  places: number | null;
  gained: number;
}

/** The teams whose rank or total changed; none without an earlier ranking. */
export function movement(before: readonly LeaderboardRow[] | null, now: readonly LeaderboardRow[]): Map<string, Move> {
  const moves = new Map<string, Move>();
  if (before === null) return moves;
  const had = new Map(before.map((row) => [row.team, row]));
  for (const row of now) {
    const old = had.get(row.team);
    if (old === undefined) moves.set(row.team, { places: null, gained: row.total });
    else if (old.rank !== row.rank || Math.abs(old.total - row.total) > 1e-9) {
      moves.set(row.team, { places: old.rank - row.rank, gained: row.total - old.total });
    }
  }
  return moves;
}

/** Whether two rankings differ. */
export function differs(before: readonly LeaderboardRow[], now: readonly LeaderboardRow[]): boolean {
  return JSON.stringify(before) !== JSON.stringify(now);
}

/** The mark next to a name, and its text for screen readers. */
export function moveMark(move: Move): { sign: string; words: string; way: 'up' | 'down' | 'new' | 'same' } {
  if (move.places === null) return { sign: 'new', words: 'new', way: 'new' };
  if (move.places > 0) return { sign: `▲${move.places}`, words: `up ${places(move.places)}`, way: 'up' };
  if (move.places < 0) return { sign: `▼${-move.places}`, words: `down ${places(-move.places)}`, way: 'down' };
  const gained = signed(move.gained);
  return { sign: gained, words: `${gained} points`, way: 'same' };
}

function places(n: number): string {
  return n === 1 ? '1 place' : `${n} places`;
}

/** A change in points with a sign; a whole number has no decimals. */
export function signed(gained: number): string {
  const text = points(gained).replace(/\.0$/, '');
  return gained > 0 ? `+${text}` : text;
}

/** One sentence for screen readers: at most three teams that gained points, the best first. */
export function announcementOf(moves: ReadonlyMap<string, Move>, now: readonly LeaderboardRow[]): string {
  const gained = now.filter((row) => {
    const move = moves.get(row.team);
    return move !== undefined && (move.places === null || Math.abs(move.gained) > 1e-9);
  });
  return gained
    .slice(0, 3)
    .map((row) => `${row.team} is ${ordinal(row.rank)} with ${points(row.total)} points`)
    .join('; ');
}
