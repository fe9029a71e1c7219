/** The ranking's columns, and whether replays are open. */
import type { CompetitionAnswer, Leaderboard } from '../wire/messages';

/** The ranking without the time of its making. */
export type Board = Pick<Leaderboard, 'tasks' | 'rows'>;

/** The columns: tasks of today first, then those that only old runs know. */
export function columns(board: Board): string[] {
  const old = new Set(board.rows.flatMap((row) => Object.keys(row.tasks)));
  for (const task of board.tasks) old.delete(task);
  return [...board.tasks, ...[...old].sort()];
}

/** Whether anybody may open the replay of a run: of official runs only when the seeds are public. */
export function replayIsOpen(info: Pick<CompetitionAnswer, 'mode' | 'phase'>): boolean {
  return info.mode === 'practice' || info.phase === 'revealed';
}
