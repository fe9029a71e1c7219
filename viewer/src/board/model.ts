/** Leaderboard and competition, as in the server's HTTP API and the watch socket's `leaderboard`. */

/** A team's best run of a task. Points; times in ms since 1970 UTC. */
export interface TaskBest { score: number; run_id: string; status: string; ended_unix_ms: number }

/** A team's row. */
export interface BoardRow {
  rank: number; team: string; total: number; runs: number; reached_unix_ms: number;
  sensors_only: boolean; sensors_rank: number | null; tasks: Record<string, TaskBest>;
}

/** The ranking. */
export interface Board { tasks: string[]; rows: BoardRow[] }

/** A task; durations in s of simulated time. */
export interface TaskInfo { name: string; description: string; tick_s: number; step_s: number; time_limit_s: number }

/** The competition. */
export interface CompetitionInfo {
  name: string; mode: 'practice' | 'official'; session_s: number | null; reset_cost_s: number;
  tasks: string[]; hands: string[]; replay_key?: string | null;
  phase?: 'closed' | 'open' | 'revealed' | null; sessions_per_team?: number | null;
  seed_secret_sha256?: string | null; seed_secret?: string | null;
}

/** An organizer's announcement; ms since 1970 UTC. */
export interface Announcement { id: number | string; text: string; unix_ms: number }

/** The task columns: current tasks first, then tasks that only older runs have. */
export function columns(board: Board): string[] {
  const old = new Set(board.rows.flatMap((row) => Object.keys(row.tasks)));
  for (const task of board.tasks) old.delete(task);
  return [...board.tasks, ...[...old].sort()];
}

/** Whether replays are public: for official runs only after the seeds are revealed. */
export function replayIsOpen(info: Pick<CompetitionInfo, 'mode' | 'phase'>): boolean {
  return info.mode === 'practice' || info.phase === 'revealed';
}
