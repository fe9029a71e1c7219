/** `/live`: links to the runs that can be watched now. */
import { el, name, setText } from '../ui/elements';
import { WatchSocket } from '../net/watch';
import { LiveView } from './view';
import type { WatchRun } from '../wire/messages';

/** Time between two requests of the list, ms. */
const PERIOD_MS = 2000;

export class RunList {
  private readonly rows = el('tbody');
  private readonly status = el('p', { class: 'soft', role: 'status' }, 'Looking for open runs …');
  private readonly table = el(
    'div',
    { class: 'scroll', hidden: true },
    el(
      'table',
      { class: 'cards' },
      el('thead', {}, el('tr', {}, ...['Team', 'Task', 'Hand', ''].map((head) => el('th', { scope: 'col' }, head)))),
      this.rows,
    ),
  );
  private socket: WatchSocket | null = null;
  private known = '';
  private token: string | null = null;
  private readonly timer: number;

  constructor(private readonly app: HTMLElement) {
    const token = el('input', { type: 'password', id: 'token', autocomplete: 'off', spellcheck: 'false' });
    const form = el(
      'form',
      {
        on: {
          submit: (event) => {
            event.preventDefault();
            this.open(token.value.trim() || null);
          },
        },
      },
      el(
        'div',
        { class: 'field' },
        el('label', { for: 'token' }, 'Token of a viewer or an organizer'),
        token,
        el('p', { class: 'hint' }, 'You need one to see official runs. This page keeps it only in memory.'),
      ),
      el('button', { type: 'submit' }, 'Use this token'),
    );
    app.replaceChildren(
      el('div', { class: 'title' }, el('h1', {}, 'Live'), el('p', { class: 'lead' }, 'Choose a run to watch.')),
      el('div', { class: 'row' }, this.status, el('a', { class: 'button end', href: '/live/featured' }, 'Watch the featured run')),
      this.table,
      el('details', { class: 'panel' }, el('summary', {}, 'I have a token'), form),
    );
    this.open(null);
    this.timer = window.setInterval(() => {
      if (!document.hidden) this.socket?.list();
    }, PERIOD_MS);
  }

  private open(token: string | null): void {
    this.socket?.close();
    this.token = token;
    const nothing = (): void => undefined;
    this.socket = new WatchSocket(
      null,
      {
        scene: nothing,
        moment: nothing,
        score: nothing,
        events: nothing,
        clock: nothing,
        verdicts: nothing,
        ended: nothing,
        runs: (runs) => this.show(runs),
        state: (state) => {
          if (state === 'connecting' && this.known === '') setText(this.status, 'Connecting …');
        },
        refused: (message) => setText(this.status, message),
      },
      token,
    );
  }

  private show(runs: WatchRun[]): void {
    const now = JSON.stringify(runs);
    if (now === this.known) return;
    this.known = now;
    this.table.hidden = runs.length === 0;
    setText(
      this.status,
      runs.length === 0
        ? 'No run is being played. A run appears here when it begins.'
        : `${runs.length} open ${runs.length === 1 ? 'run' : 'runs'}.`,
    );
    this.rows.replaceChildren(
      ...runs.map((run) =>
        el(
          'tr',
          {},
          el('th', { scope: 'row' }, name(run.team)),
          el('td', { 'data-label': 'Task' }, run.task),
          el('td', { 'data-label': 'Hand' }, name(run.hand)),
          el(
            'td',
            {},
            el(
              'a',
              {
                class: 'button',
                href: `/live/${encodeURIComponent(run.session_id)}`,
                'aria-label': `Watch ${run.team}`,
                on: { click: (event) => this.watch(event as MouseEvent, run.session_id) },
              },
              'Watch',
            ),
            run.official ? el('span', { class: 'badge info' }, 'official') : null,
          ),
        ),
      ),
    );
  }

  /** A new document would not have the token: with a token the run opens in this document. */
  private watch(event: MouseEvent, session: string): void {
    if (this.token === null || event.ctrlKey || event.metaKey || event.shiftKey) return;
    event.preventDefault();
    this.socket?.close();
    window.clearInterval(this.timer);
    history.pushState(null, '', `/live/${encodeURIComponent(session)}`);
    window.addEventListener('popstate', () => location.reload());
    new LiveView(this.app, { session_id: session }, this.token);
  }
}
