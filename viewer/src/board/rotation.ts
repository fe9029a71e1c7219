/** Chooses the wall's pane: one after the other; an event in the live run shows the live pane early. Times in ms. */

/** A pane. */
export interface Pane { id: string; /** Display time. */ ms: number; /** Whether it has something to show. */ ready: boolean }

/** The shown pane, and since when. */
export interface Showing { id: string; since: number }

/** Minimum display time of a pane, even if an event happens in the live run. */
export const MIN_MS = 4000;
/** Display time of the live pane after an event. */
export const EVENT_MS = 12_000;

/** The pane to show now. `lastEvent`: time of the live run's last event, or null. */
export function rotate(panes: readonly Pane[], shown: Showing | null, now: number, held: boolean, lastEvent: number | null): Showing | null {
  const ready = panes.filter((pane) => pane.ready);
  const first = ready[0];
  if (first === undefined) return null;
  const at = panes.findIndex((pane) => pane.id === shown?.id);
  const current = panes[at];
  if (shown === null || current === undefined || !current.ready) return { id: after(panes, at)?.id ?? first.id, since: now };
  if (held) return shown;
  const live = ready.find((pane) => pane.id === 'live');
  const eventful = live !== undefined && lastEvent !== null && now - lastEvent < EVENT_MS;
  if (eventful && current.id === 'live') return shown;
  if (eventful && now - shown.since >= MIN_MS) return { id: 'live', since: now };
  if (now - shown.since < current.ms) return shown;
  return { id: after(panes, at)?.id ?? first.id, since: now };
}

/** The next pane with content, cyclically; with `by` −1 the previous one. */
export function after(panes: readonly Pane[], at: number, by: 1 | -1 = 1): Pane | undefined {
  for (let step = 1; step <= panes.length; step += 1) {
    const pane = panes[(((at + by * step) % panes.length) + panes.length) % panes.length];
    if (pane?.ready === true) return pane;
  }
  return undefined;
}

/** First and last row of each page of the ranking. */
export function pages(rows: number, most: number): [number, number][] {
  const count = Math.max(1, Math.ceil(rows / most));
  return Array.from({ length: count }, (_, page): [number, number] => [page * most, Math.min(rows, (page + 1) * most)]);
}
