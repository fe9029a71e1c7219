/** Verification of runs: verify again, void or take that back, open the replay. */
import { dateTime, points } from '../ui/format';
import { button, type Child, el, name } from '../ui/elements';
import { confirmAction, type ActionDialog } from './dialog';
import type { AdminClient, Tab } from './admin_client';
import { KeyedTable } from './keyed_table';
import type { RunRecord } from '../wire/messages';

const COLOUR: Record<string, string> = {
  provisional: 'warn',
  verified: 'ok',
  rejected: 'bad',
  void: 'soft',
  voided: 'soft',
  open: 'info',
  aborted: 'soft',
};
/** Maximum number of rows. */
const MAX_ROWS = 300;

/** Whether an organizer should look at a run. */
export function needsReview(run: Pick<RunRecord, 'status' | 'similar' | 'verify_state'>): boolean {
  return run.status === 'provisional' || run.status === 'rejected' || run.verify_state === 'stuck' || (run.similar ?? []).length > 0;
}

/** Whether a run waits for its verification, and why it still does; null if it does not wait. */
export function verification(run: Pick<RunRecord, 'verify_state' | 'verify_host' | 'verify_tries' | 'verify_problem'>): string | null {
  if (run.verify_state === undefined) return null;
  const tries = run.verify_tries === 1 ? '1 try' : `${run.verify_tries ?? 0} tries`;
  const problem = run.verify_problem === undefined ? '' : `: ${run.verify_problem}`;
  if (run.verify_state === 'stuck') return `verification stuck after ${tries}${problem}`;
  if (run.verify_host !== undefined) return `being verified by ${run.verify_host}${problem}`;
  return problem === '' ? 'waits for its verification' : `waits for its verification after ${tries}${problem}`;
}

/** The tab. */
export function runsTab(admin: AdminClient): Tab {
  let all: RunRecord[] = [];
  let older = false;
  const everything = el('input', { type: 'checkbox', on: { change: () => show() } });
  const filter = el('input', {
    type: 'search',
    'aria-label': 'Team, task or run',
    placeholder: 'team, task or run',
    on: { input: () => show() },
  });
  const line = el('p', { class: 'soft', role: 'status' });
  const table = new KeyedTable<RunRecord>(
    [
      { head: 'Run' },
      { head: 'Team', class: 'wide' },
      { head: 'Task' },
      { head: 'Score', class: 'n' },
      { head: 'Status' },
      { head: 'Ended' },
      { head: 'Notes', class: 'wide' },
      { head: '', class: 'wide' },
    ],
    (run) => run.run_id,
    (run) => [
      el('span', { class: 'id' }, run.run_id),
      name(run.team),
      [run.task, run.k === null ? null : el('span', { class: 'soft once' }, ` k ${run.k}`)],
      run.score === null ? '–' : points(run.score),
      el('span', { class: `badge ${COLOUR[run.status] ?? ''}` }, run.status),
      dateTime(run.ended_unix_ms),
      notes(run),
      el(
        'div',
        { class: 'row' },
        run.ended_unix_ms !== null && el('a', { class: 'button small', href: `/replay/${encodeURIComponent(run.run_id)}` }, 'Replay'),
        run.ended_unix_ms !== null &&
          button('File', () => void admin.save(`/v1/runs/${encodeURIComponent(run.run_id)}/replay`, `${run.run_id}.mcap`), {
            class: 'small',
          }),
        ['provisional', 'verified', 'rejected'].includes(run.status) &&
          button('Verify again…', () => void confirmAction(again(run)), { class: 'small' }),
        run.status === 'voided'
          ? button('Count again…', () => void confirmAction(unvoided(run)), { class: 'small' })
          : button('Void…', () => void confirmAction(voided(run)), { class: 'small danger' }),
      ),
    ],
    { label: 'Runs', empty: 'Nothing to do: every run is verified, and none resembles another team’s run.' },
  );

  function notes(run: RunRecord): Child[] {
    const texts = [run.note, run.verify_note, verification(run)].filter(
      (text): text is string => text !== null && text !== undefined && text !== '',
    );
    const similar = (run.similar ?? []).map((other) =>
      el(
        'div',
        {},
        'similar to ',
        el('span', { class: 'id' }, other.run_id),
        ' of ',
        name(other.team),
        `: ${Math.round(100 * other.share)} % of the path, ${other.distance_mm.toFixed(1)} mm apart`,
      ),
    );
    return [...texts.map((text) => el('div', {}, text)), ...similar, texts.length + similar.length === 0 ? '–' : null];
  }

  const action =
    (path: string, run: RunRecord) =>
    async (reason: string | null): Promise<string> => {
      await admin.post(`/v1/admin/run/${path}`, { run_id: run.run_id, reason });
      await tab.refresh();
      return 'Done.';
    };
  const again = (run: RunRecord): ActionDialog => ({
    title: 'Verify again',
    text: el('span', {}, 'The server replays the run of ', name(run.team), ' again and compares every state.'),
    verb: 'Verify',
    act: action('reverify', run),
  });
  const voided = (run: RunRecord): ActionDialog => ({
    title: 'Void a run',
    text: el('span', {}, 'The run of ', name(run.team), `, ${run.task}, does not count any more; the team gets its time back.`),
    verb: 'Void',
    danger: true,
    needsReason: true,
    act: action('void', run),
  });
  const unvoided = (run: RunRecord): ActionDialog => ({
    title: 'Count a run again',
    text: el(
      'span',
      {},
      'The run of ',
      name(run.team),
      `, ${run.task}, counts again once its replay is verified; the time that was given back for it is taken again.`,
    ),
    verb: 'Count again',
    needsReason: true,
    act: action('unvoid', run),
  });

  function show(): void {
    const word = filter.value.trim().toLowerCase();
    const fits = (run: RunRecord): boolean =>
      word === '' || `${run.run_id} ${run.team} ${run.task} ${run.status}`.toLowerCase().includes(word);
    const found = all.filter((run) => (everything.checked || word !== '' || needsReview(run)) && fits(run));
    const waiting = all.filter((run) => run.status === 'provisional').length;
    const stuck = all.filter((run) => run.verify_state === 'stuck').length;
    line.textContent = `${waiting} of ${older ? 'the newest ' : ''}${all.length} runs are not verified yet${stuck > 0 ? `, ${stuck} of them are stuck` : ''}.${found.length > MAX_ROWS ? ` The newest ${MAX_ROWS} of ${found.length} are shown.` : ''}`;
    table.show(found.slice(0, MAX_ROWS));
  }

  const tab: Tab = {
    id: 'runs',
    title: 'Verification',
    period: 5000,
    element: el(
      'div',
      {},
      el(
        'div',
        { class: 'row head' },
        line,
        el('label', { class: 'check end' }, everything, 'all runs'),
        el('span', { class: 'filter' }, filter),
      ),
      table.element,
    ),
    async refresh() {
      ({ runs: all, more: older } = await admin.get<{ runs: RunRecord[]; more: boolean }>('/v1/admin/runs'));
      show();
    },
  };
  return tab;
}
