/** The audit: organizers' actions with time and reason; the newest first, one page at a time. */
import { dateTime } from '../ui/format';
import { button, copyText, el, name } from '../ui/elements';
import type { AdminClient, Tab } from './admin_client';
import { type Cell, KeyedTable } from './keyed_table';
import type { AuditEntry } from '../wire/messages';

/** Records on a page. */
export const PAGE = 50;

/** The number of the last record, by doubling and bisection. `has(n)`: whether there is a record after n. */
export async function lastOf(has: (after: number) => Promise<boolean>, known = 0): Promise<number> {
  if (!(await has(known))) return known;
  let [low, step] = [known + 1, 1];
  while (await has(low + step - 1)) {
    low += step;
    step *= 2;
  }
  // The last is between low and low + step - 1.
  let high = low + step - 1;
  while (low < high) {
    const middle = Math.floor((low + high) / 2);
    if (await has(middle)) low = middle + 1;
    else high = middle;
  }
  return low;
}

/** The holder of the token that was used, and its id. */
function who(entry: AuditEntry): Cell {
  const id = el('code', {}, entry.actor);
  return entry.label === null || entry.label === '' ? id : [name(entry.label), ' ', id];
}

/** The tab. */
export function auditTab(admin: AdminClient): Tab {
  let last = 0;
  let page = 0;
  const fetched = (after: number, limit: number): Promise<AuditEntry[]> =>
    admin.get<{ records: AuditEntry[] }>(`/v1/admin/audit?after=${after}&limit=${limit}`).then((answer) => answer.records);
  const line = el('span', { class: 'soft', role: 'status' });
  const turn = (by: number) => (): void => {
    page = Math.max(0, page + by);
    void tab.refresh();
  };
  const newer = button('Newer', turn(-1), { class: 'small' });
  const older = button('Older', turn(1), { class: 'small' });
  // Until the number of records is known: a button that is disabled while it has the focus loses it.
  newer.disabled = true;
  older.disabled = true;
  const table = new KeyedTable<AuditEntry>(
    [
      { head: '#', class: 'n' },
      { head: 'When' },
      { head: 'Who' },
      { head: 'What' },
      { head: 'Subject', class: 'wide' },
      { head: 'Why', class: 'wide' },
    ],
    (entry) => String(entry.seq),
    (entry) => [
      entry.seq,
      dateTime(entry.unix_ms),
      who(entry),
      entry.seconds === null ? entry.action : `${entry.action} ${entry.seconds} s`,
      el('bdi', {}, entry.subject),
      entry.reason === null ? '–' : el('bdi', {}, entry.reason),
    ],
    { label: 'Audit', empty: 'No actions yet.', head: 3 },
  );

  const tab: Tab = {
    id: 'audit',
    title: 'Audit',
    period: 5000,
    element: el(
      'div',
      {},
      el(
        'div',
        { class: 'row head' },
        newer,
        older,
        line,
        button('Copy this page', () => void copyText(table.element.innerText), { class: 'small end' }),
      ),
      table.element,
    ),
    async refresh() {
      last = await lastOf(async (after) => (await fetched(after, 1)).length > 0, last);
      page = Math.min(page, Math.max(0, Math.ceil(last / PAGE) - 1));
      const to = last - page * PAGE;
      const from = Math.max(0, to - PAGE);
      table.show((await fetched(from, to - from)).reverse());
      newer.disabled = page === 0;
      older.disabled = from === 0;
      line.textContent = last === 0 ? '' : `${from + 1}–${to} of ${last}`;
    },
  };
  return tab;
}
