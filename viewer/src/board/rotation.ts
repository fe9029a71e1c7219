/** Which pane the wall shows: one after the other, but what is exciting comes at once and stays a while. Times in ms. */

/** A pane as the rotation sees it. */
export interface Pane { id: string; /** How long it is shown. */ ms: number; /** Whether it has something to show. */ ready: boolean }

/** What is shown, and since when. */
export interface Showing { id: string; since: number }

/** Once shown, nothing is taken away sooner than this, not even for something exciting. */
export const MIN_MS = 4000;
/** How long something exciting keeps its pane. */
export const EXCITED_MS = 12_000;

/** What to show now. `excited`: when the live world last had something worth seeing, or null. */
export function rotate(panes: readonly Pane[], shown: Showing | null, now: number, held: boolean, excited: number | null): Showing | null {
  const ready = panes.filter((pane) => pane.ready);
  const first = ready[0];
  if (first === undefined) return null;
  const at = panes.findIndex((pane) => pane.id === shown?.id);
  const current = panes[at];
  if (shown === null || current === undefined || !current.ready) return { id: after(panes, at)?.id ?? first.id, since: now };
  if (held) return shown;
  const live = ready.find((pane) => pane.id === 'live');
  const thrilling = live !== undefined && excited !== null && now - excited < EXCITED_MS;
  if (thrilling && current.id === 'live') return shown;
  if (thrilling && now - shown.since >= MIN_MS) return { id: 'live', since: now };
  if (now - shown.since < current.ms) return shown;
  return { id: after(panes, at)?.id ?? first.id, since: now };
}

/** The next pane with something to show, around the corner too; by −1 the one before. */
export function after(panes: readonly Pane[], at: number, by: 1 | -1 = 1): Pane | undefined {
  for (let step = 1; step <= panes.length; step += 1) {
    const pane = panes[(((at + by * step) % panes.length) + panes.length) % panes.length];
    if (pane?.ready === true) return pane;
  }
  return undefined;
}

/** Pages of the ranking: from which row to which. */
export function pages(rows: number, most: number): [number, number][] {
  const count = Math.max(1, Math.ceil(rows / most));
  return Array.from({ length: count }, (_, page): [number, number] => [page * most, Math.min(rows, (page + 1) * most)]);
}
