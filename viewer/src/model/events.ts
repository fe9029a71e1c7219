/** The referee's events as words that follow an object's name, and whether each is good news. */
const EVENTS: Record<string, [words: string, good: boolean]> = {
  in_goal: ['is in the goal', true],
  left_goal: ['left the goal', false],
  outside: ['is outside', false],
  back_inside: ['is back inside', true],
  lifted: ['is lifted', true],
  dropped: ['was dropped', false],
  slipped: ['slipped', false],
  held: ['is held', true],
  shaken: ['was held while shaken', true],
};

/** An event's words; `goals` of the scene. A kind that this page does not know keeps its own name. */
export function eventWords(kind: string, goals: readonly string[] = []): string {
  const goal = goals.indexOf(kind);
  if (goal >= 0) return `reached goal ${goal + 1} of ${goals.length}: ${kind.replaceAll('_', ' ')}`;
  return EVENTS[kind]?.[0] ?? kind.replaceAll('_', ' ');
}

export function isGoodNews(kind: string): boolean {
  return EVENTS[kind]?.[1] ?? true;
}
