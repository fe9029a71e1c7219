/** What the referee notes of an object, in words that follow its name. */
export const EVENTS: Record<string, string> = {
  in_goal: 'is in the goal', left_goal: 'left the goal', outside: 'lies outside', back_inside: 'is back inside',
  lifted: 'is lifted', dropped: 'was dropped', slipped: 'slipped', held: 'is held', shaken: 'was held while shaken',
};
