/** Sessions with their clocks: pause, resume, add time, end, void. */
import { clock, clockInWords, dateTime } from '../ui/format';
import { button, el, name, setText } from '../ui/elements';
import { confirmAction, type ActionDialog } from './dialog';
import { inOrder, leftAt, readClock, type ClockReading, state } from './clocks';
import type { AdminClient, Tab } from './admin_client';
import { KeyedTable } from './keyed_table';
import type { Session } from '../wire/messages';

/** The tab. */
export function sessionsTab(admin: AdminClient): Tab {
  const readings = new Map<string, ClockReading>();
  let all: Session[] = [];
  const openOnly = el('input', { type: 'checkbox', on: { change: () => show() } });
  const table = new KeyedTable<Session>(
    [
      { head: 'Team' },
      { head: 'State' },
      { head: 'Left', class: 'n' },
      { head: 'Used', class: 'n' },
      { head: 'Added', class: 'n' },
      { head: 'Pauses', class: 'n' },
      { head: 'Runs', class: 'n' },
      { head: 'Started' },
      { head: '', class: 'wide' },
    ],
    (session) => session.session_id,
    (session) => cells(session),
    {
      label: 'Sessions',
      empty: 'No session yet. While the competition is open, a team’s session begins when its client connects.',
      // Without the clocks, which tick() updates.
      signature: (session) =>
        JSON.stringify([
          { ...session, elapsed_s: session.elapsed_s > 0, left_s: (session.left_s ?? 1) > 0, clock_wall_s: 0, clock_simulated_s: 0 },
          readings.get(session.session_id)?.going,
        ]),
    },
  );

  function cells(session: Session): (Node | Node[] | string | number)[] {
    const { word, colour } = state(session, readings.get(session.session_id)?.going ?? false);
    const open = session.status === 'open';
    return [
      [name(session.team), el('span', { class: 'id' }, session.session_id)],
      el('span', { class: `badge ${colour}` }, word),
      el('span', { class: 'clock', 'data-clock': 'left' }),
      el('span', { class: 'num', 'data-clock': 'used' }),
      clock(session.refunded_s),
      session.pauses,
      session.runs,
      dateTime(session.created_unix_ms),
      el(
        'div',
        { class: 'row' },
        open && session.paused_unix_ms === null && act(session, 'Pause', 'pause', 'Its clock and its runs stop until it is resumed.'),
        open && session.paused_unix_ms !== null && act(session, 'Resume', 'resume', 'Its clock and its runs continue.'),
        session.status !== 'voided' && button('Add time…', () => void confirmAction(grant(session)), { class: 'small' }),
        open && act(session, 'End', 'end', 'The open run is scored, and the session is over.', { danger: true }),
        session.status !== 'voided' &&
          act(session, 'Void', 'void', 'None of its runs counts any more, and the team may have another session.', {
            danger: true,
            needsReason: true,
          }),
        open && el('a', { class: 'button small', href: `/live/${encodeURIComponent(session.session_id)}` }, 'Watch'),
      ),
    ];
  }

  function act(session: Session, verb: string, path: string, text: string, more: Partial<ActionDialog> = {}): HTMLButtonElement {
    const dialog: ActionDialog = {
      title: [`${verb} the session of `, name(session.team)],
      text,
      verb,
      ...more,
      act: async (reason) => {
        await admin.post(`/v1/admin/session/${path}`, { session_id: session.session_id, reason });
        await tab.refresh();
        return `${verb}: done.`;
      },
    };
    return button(`${verb}…`, () => void confirmAction(dialog), { class: more.danger === true ? 'small danger' : 'small' });
  }

  function grant(session: Session): ActionDialog {
    return {
      title: ['Add time for ', name(session.team)],
      text: 'Adds time; an expired session reopens.',
      verb: 'Add',
      needsReason: true,
      fields: [{ name: 'seconds', label: 'Seconds', type: 'number', value: '60', min: 1, max: 86_400 }],
      act: async (reason, { seconds }) => {
        await admin.post('/v1/admin/session/grant', { session_id: session.session_id, reason, seconds: Number(seconds) });
        await tab.refresh();
        return `Added: ${seconds ?? ''} s.`;
      },
    };
  }

  function show(): void {
    table.show(inOrder(openOnly.checked ? all.filter((session) => session.status === 'open') : all));
    tick();
  }

  /** Updates the clocks. */
  function tick(): void {
    const now = performance.now();
    for (const session of all) {
      const [line, reading] = [table.row(session.session_id), readings.get(session.session_id)];
      if (line === undefined || reading === undefined) continue;
      const left = leftAt(reading, now);
      const [shown, used] = [line.querySelector('[data-clock=left]'), line.querySelector('[data-clock=used]')];
      if (shown !== null) {
        setText(shown, clock(left));
        shown.setAttribute('title', clockInWords(left));
        shown.classList.toggle('warn', left !== null && left < 120 && session.status === 'open');
      }
      if (used !== null)
        setText(used, clock(Math.floor(reading.elapsed + (left === null || reading.left === null ? 0 : reading.left - left))));
    }
  }

  const tab: Tab = {
    id: 'sessions',
    title: 'Sessions',
    period: 2000,
    element: el('div', {}, el('label', { class: 'check' }, openOnly, 'only open sessions'), table.element),
    async refresh() {
      const { sessions } = await admin.get<{ sessions: Session[] }>('/v1/sessions');
      const now = performance.now();
      for (const session of sessions) readings.set(session.session_id, readClock(session, now, readings.get(session.session_id)));
      all = sessions;
      show();
    },
  };
  const timer = window.setInterval(() => {
    if (tab.element.isConnected) tick();
    else if (readings.size > 0) window.clearInterval(timer);
  }, 250);
  return tab;
}
