/** The pages of the wall's ranking: which rows each has, and when the next one comes. */

/** Display time of a page, ms. */
export const PAGE_MS = 9000;

/** First and last row of each page. Every page is full: the last one begins earlier, so that its rows keep their size. */
export function pages(rows: number, most: number): [number, number][] {
  const count = Math.max(1, Math.ceil(rows / most));
  return Array.from({ length: count }, (_, page): [number, number] => {
    const to = Math.min(rows, (page + 1) * most);
    return [Math.max(0, count === 1 ? 0 : to - most), to];
  });
}

/** The shown page, and since when (ms). */
export interface Showing {
  page: number;
  since: number;
}

/** The page to show now, of `count`. A held page stays. */
export function turned(shown: Showing, count: number, now: number, held: boolean): Showing {
  if (shown.page >= count) return { page: 0, since: now };
  if (held || count < 2 || now - shown.since < PAGE_MS) return shown;
  return { page: (shown.page + 1) % count, since: now };
}
