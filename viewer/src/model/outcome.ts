/** The count of a run, and the status of an object, as words. */
import type { Verdict } from '../wire/messages';
import type { SceneInfo } from './scene';

const of = (n: number, all: number, word: string): string => `${n} of ${all} ${word}${all === 1 ? '' : 's'}`;

/** `3 of 4 goals`, or `7 of 10 objects in the goal, 1 outside`. */
export function countWords(count: { in_goal: number; outside: number }, scene: Pick<SceneInfo, 'bodies' | 'goals'>): string {
  const goals = scene.goals?.length ?? 0;
  if (goals > 0) return of(count.in_goal, goals, 'goal');
  const objects = scene.bodies.filter((body) => body.kind === 'object').length;
  return `${of(count.in_goal, objects, 'object')} in the goal${count.outside > 0 ? `, ${count.outside} outside` : ''}`;
}

/** The words for an object's place, which follow its name. */
export function placeWords({ counts, place, reasons }: Verdict, goals: readonly string[] = []): string {
  if (goals.includes(place)) return `: next goal: ${place.replaceAll('_', ' ')} (${goals.indexOf(place) + 1} of ${goals.length}).`;
  if (goals.length > 0) {
    const words: Record<string, string> = {
      done: 'all its goals are reached',
      later: 'another goal comes first',
      none: 'no goal is about it',
    };
    return `: ${words[place] ?? place.replaceAll('_', ' ')}.`;
  }
  const moves = reasons.some((reason) => reason.rule === 'at_rest' && !reason.holds);
  // The referee found it at rest outside, and keeps that until it arrives somewhere.
  if (place === 'outside' && moves) return ' is on the way. It counts as outside until it is in the goal, or back in the start.';
  return `${counts ? ' counts: ' : ' does not count: '}${place.replaceAll('_', ' ')}.`;
}
