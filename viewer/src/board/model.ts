/** The ranking's columns, and whether replays are public. */
import type { CompetitionResponse, Leaderboard } from '../wire/messages';

/** The ranking without the time of the response. */
export type Board = Pick<Leaderboard, 'tasks' | 'rows'>;

/** The task columns: current tasks first, then tasks that only older runs have. */
export function columns(board: Board): string[] {
  const old = new Set(board.rows.flatMap((row) => Object.keys(row.tasks)));
  for (const task of board.tasks) old.delete(task);
  return [...board.tasks, ...[...old].sort()];
}

/** Whether replays are public: for official runs only after the seeds are revealed. */
export function replayIsOpen(info: Pick<CompetitionResponse, 'mode' | 'phase'>): boolean {
  return info.mode === 'practice' || info.phase === 'revealed';
}
