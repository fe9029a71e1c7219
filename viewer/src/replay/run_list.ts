/** `/replay`: the server's newest runs with a replay. */
import { ApiError, getJson } from '../net/api';
import { el, name } from '../ui/elements';
import { dateTime, points } from '../ui/format';
import type { RunList as Listed, RunRecord } from '../wire/messages';

export class ReplayList {
  private readonly status = el('p', { class: 'soft', role: 'status' }, 'Looking for runs …');
  private readonly rows = el('tbody');
  private readonly table = el(
    'div',
    { class: 'scroll', hidden: true },
    el(
      'table',
      { class: 'cards' },
      el(
        'thead',
        {},
        el(
          'tr',
          {},
          ...['Team', 'Task', 'Hand', 'Score', 'Ended', ''].map((head) =>
            el('th', { scope: 'col', class: head === 'Score' ? 'n' : undefined }, head),
          ),
        ),
      ),
      this.rows,
    ),
  );
  readonly element = el('section', { class: 'stack', 'aria-label': 'Runs of this server' }, this.status, this.table);

  /** `open` plays a run in this document, which has the token. */
  constructor(private readonly open: (run: string) => void) {}

  /** Lists the runs that a client with this token may see. */
  async load(token: string | null): Promise<void> {
    try {
      const { runs } = await getJson<Listed>('/v1/runs', token);
      this.table.hidden = runs.length === 0;
      this.status.textContent =
        runs.length > 0
          ? `The newest ${runs.length === 1 ? 'run' : `${runs.length} runs`} of this server.`
          : 'No run to show: this server has no finished run with a replay, or shows none without a token.';
      this.rows.replaceChildren(...runs.map((run) => this.row(run, token !== null)));
    } catch (error) {
      this.table.hidden = true;
      this.status.textContent = error instanceof ApiError ? error.message : String(error);
    }
  }

  private row(run: RunRecord, here: boolean): HTMLElement {
    const play = (event: Event): void => {
      const { ctrlKey, metaKey, shiftKey } = event as MouseEvent;
      // A new document would not have the token.
      if (!here || ctrlKey || metaKey || shiftKey) return;
      event.preventDefault();
      this.open(run.run_id);
    };
    return el(
      'tr',
      {},
      el('th', { scope: 'row' }, name(run.team)),
      el('td', { 'data-label': 'Task' }, run.task),
      el('td', { 'data-label': 'Hand' }, name(run.hand)),
      el('td', { 'data-label': 'Score', class: 'n' }, run.score === null ? '–' : points(run.score)),
      el('td', { 'data-label': 'Ended' }, dateTime(run.ended_unix_ms)),
      el(
        'td',
        {},
        el(
          'a',
          {
            class: 'button',
            href: `/replay/${encodeURIComponent(run.run_id)}`,
            'aria-label': `Play ${run.task} by ${run.team}, ${run.run_id}`,
            on: { click: play },
          },
          'Play',
        ),
      ),
    );
  }
}
