/** A table of a hand's figures, compared with the built-in hands and the limits. */
import { figure } from '../ui/format';
import { el } from '../ui/elements';
import type { FigureRow } from '../wire/messages';

/** A badge for an unusual figure. */
function badge(row: FigureRow): HTMLElement | null {
  if (!row.allowed) return el('span', { class: 'badge bad' }, 'over the limit');
  return row.beyond_others ? el('span', { class: 'badge warn' }, 'beyond all built-in hands') : null;
}

/** Number of other hands that have a column each; if there are more, the least and the largest value are shown. */
const MAX_OTHERS = 4;

/** The heads and cells about the other hands. */
function compared(figures: readonly FigureRow[]): { heads: string[]; of: (row: FigureRow) => (number | undefined)[] } {
  const others = [...new Set(figures.flatMap((row) => Object.keys(row.others)))].sort();
  if (others.length <= MAX_OTHERS) return { heads: others, of: (row) => others.map((one) => row.others[one]) };
  return {
    heads: ['Least of others', 'Most of others'],
    of: (row) => {
      const values = Object.values(row.others);
      return values.length === 0 ? [undefined, undefined] : [Math.min(...values), Math.max(...values)];
    },
  };
}

/** The table; unusual figures come first. */
export function figureTable(figures: readonly FigureRow[]): HTMLTableElement {
  // Otherwise the server's order.
  const priority = (row: FigureRow): number => (!row.allowed ? 0 : row.beyond_others ? 1 : 2);
  const inOrder = [...figures].sort((a, b) => priority(a) - priority(b));
  const others = compared(figures);
  const heads: [string, string][] = [
    ['Figure', ''],
    ['This hand', 'n'],
    ...others.heads.map((one): [string, string] => [one, 'n']),
    ['Limit', 'n'],
    ['', ''],
  ];
  return el(
    'table',
    { class: 'dense cards figures' },
    el(
      'thead',
      {},
      el(
        'tr',
        {},
        ...heads.map(([head, kind]) =>
          el('th', { scope: 'col', class: kind }, head === '' ? el('span', { class: 'visually-hidden' }, 'Remark') : head),
        ),
      ),
    ),
    el(
      'tbody',
      {},
      ...inOrder.map((row) =>
        el(
          'tr',
          { class: !row.allowed ? 'beyond' : row.beyond_others ? 'odd' : undefined },
          el(
            'th',
            { scope: 'row', title: row.place ?? undefined },
            row.what,
            row.unit === '' ? null : el('span', { class: 'soft' }, ` ${row.unit}`),
          ),
          el('td', { class: 'n', 'data-label': 'This hand' }, el('b', {}, figure(row.value))),
          ...others.of(row).map((value, k) => el('td', { class: 'n soft', 'data-label': others.heads[k] }, figure(value))),
          el(
            'td',
            { class: 'n', 'data-label': 'Limit' },
            row.limit === null ? '–' : `${row.bound === 'most' ? '≤' : '≥'} ${figure(row.limit)}`,
          ),
          el('td', {}, badge(row)),
        ),
      ),
    ),
  );
}
