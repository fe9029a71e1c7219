/**
 * A change of the score in words. If an object that was dropped outside arrives later, the score changes by its points and by the
 * penalty, which is taken back.
 */
import { signed } from './movement';
import type { GoalInfo } from '../wire/messages';

/** The points of the objects that a task counts: in the goal, and the penalty outside (less than 0), or 0. */
export interface Worth {
  goal: number;
  penalty: number;
}

/** The points of a task that counts objects; null for one with goals in stages. */
export function worthOf(goals: readonly GoalInfo[] | undefined): Worth | null {
  const goal = goals?.find((one) => one.points > 0 && one.inside !== undefined);
  if (goal === undefined || goals === undefined || goals.some((one) => one.object !== undefined) || goals.length > 2) return null;
  return { goal: goal.points, penalty: goals.find((one) => one.points < 0)?.points ?? 0 };
}

/** The change in words; `arrived` objects came into the goal. */
export function gainWords(change: number, arrived: number, worth: Worth | null): string {
  const plain = signed(change);
  if (worth === null || worth.penalty === 0) return plain;
  const back = (change - arrived * worth.goal) / -worth.penalty;
  const taken = Math.round(back);
  // Not explained by these objects.
  if (taken < 1 || Math.abs(back - taken) > 1e-6) return plain;
  const penalty = `${signed(taken * worth.penalty)} taken back`;
  return arrived === 0 ? penalty : `${signed(arrived * worth.goal)} (${penalty})`;
}
