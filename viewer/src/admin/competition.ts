/** The competition: its phases, announcements, downloads, and the backup. */
import { getJson } from '../net/api';
import { clock, dateTime } from '../ui/format';
import { button, el, facts, name, setText } from '../ui/elements';
import { confirmAction, type ActionDialog } from './dialog';
import { type AdminClient, errorText, type Tab } from './admin_client';
import type { Announcement, CompetitionResponse } from '../wire/messages';

const WORDS = {
  closed: 'Closed: no session can begin; open sessions continue.',
  open: 'Open: a team’s session begins when its client connects.',
  revealed: 'Over: seeds and replays are public.',
} as const;

/** The forecast as a sentence. */
function free(within: number | null): string {
  if (within === 0) return 'A team that comes now finds one.';
  return within === null
    ? 'No running clock bounds the time until the next is free.'
    : `A team that comes now finds one in at most ${clock(within)}.`;
}

/** The tab with phases and downloads. */
export function competitionTab(admin: AdminClient, shown: (info: CompetitionResponse) => void): Tab {
  const now = el('section', { class: 'panel' });
  const places = el('p', { role: 'status' });

  const enter = (verb: string, path: string, text: string, more: Partial<ActionDialog> = {}): HTMLButtonElement => {
    const dialog: ActionDialog = {
      title: `${verb} the competition`,
      text,
      verb,
      ...more,
      act: async (reason) => {
        await admin.post(`/v1/admin/competition/${path}`, { reason });
        await tab.refresh();
        return `${verb}: done.`;
      },
    };
    return button(`${verb}…`, () => void confirmAction(dialog), {
      class: more.danger === true ? 'danger' : path === 'open' ? 'primary' : undefined,
    });
  };

  function show(info: CompetitionResponse): void {
    shown(info);
    const phase = info.phase ?? null;
    const paused = typeof info.paused_unix_ms === 'number';
    now.replaceChildren(
      el('h2', {}, name(info.name)),
      el('p', {}, phase === null ? 'A practice server has no phases.' : WORDS[phase]),
      el('p', { class: 'notice', hidden: !paused }, `Paused since ${dateTime(info.paused_unix_ms)}: all clocks and worlds are stopped.`),
      places,
      el(
        'div',
        { class: 'row' },
        phase === 'closed' && enter('Open', 'open', 'From now on a team’s session begins when its client connects.', { typed: info.name }),
        phase === 'open' && enter('Close', 'close', 'No further session can begin; open sessions continue.', { typed: info.name }),
        phase !== null &&
          phase !== 'revealed' &&
          !paused &&
          enter('Pause', 'pause', 'The clocks and worlds of all sessions stop, also of sessions that begin later. No team loses time.', {
            typed: info.name,
          }),
        phase !== 'revealed' &&
          paused &&
          enter('Resume', 'resume', 'The clocks and worlds of all sessions continue.', { typed: info.name }),
        phase !== null &&
          phase !== 'revealed' &&
          enter('End', 'end', 'All sessions end for good, their open runs are scored, and the competition closes.', {
            typed: info.name,
            danger: true,
          }),
        phase !== null &&
          phase !== 'revealed' &&
          enter(
            'Reveal',
            'reveal',
            'This cannot be undone: the secret of the seeds and all replays become public, and the competition is over.',
            { typed: info.name, danger: true },
          ),
      ),
      el('h3', {}, 'Publish these before the start'),
      facts([
        ['SHA-256 of the seed secret', el('code', {}, info.seed_secret_sha256 ?? '–')],
        ['Replay key', el('code', {}, info.replay_key ?? '–')],
        [
          'Seed secret',
          info.seed_secret === undefined || info.seed_secret === null ? 'hidden until revealed' : el('code', {}, info.seed_secret),
        ],
      ]),
    );
  }

  const table = (what: string): HTMLElement =>
    el(
      'li',
      { class: 'row' },
      el('span', { class: 'grow' }, what),
      ...['csv', 'json'].map((format) =>
        button(format.toUpperCase(), () => void admin.save(`/v1/admin/export/${what}?format=${format}`, `${what}.${format}`), {
          class: 'small',
          'aria-label': `${what} as ${format.toUpperCase()}`,
        }),
      ),
    );
  const downloads = el(
    'section',
    { class: 'panel' },
    el('h2', {}, 'Downloads'),
    el('ul', { class: 'plain' }, ...['leaderboard', 'sessions', 'runs', 'audit'].map(table)),
    el('h3', {}, 'Backup'),
    el('p', {}, 'One archive with all data and secrets: anyone who has it can run the competition.'),
    button('Download the backup', () => void admin.save('/v1/admin/backup', 'palmares-backup.zip')),
  );

  const tab: Tab = {
    id: 'competition',
    title: 'Competition',
    period: 10_000,
    element: el('div', { class: 'columns' }, now, downloads),
    async refresh() {
      const info = await getJson<CompetitionResponse>('/v1/competition');
      places.hidden = info.places === undefined || info.places === null;
      if (info.places)
        setText(places, `Places: ${info.places.playing} of ${info.places.total} in use. ${free(info.places.free_within_s ?? null)}`);
      // Without the forecast, which changes all the time: buttons keep their focus.
      const signature = JSON.stringify({ ...info, places: null });
      if (now.dataset['shown'] === signature) return;
      now.dataset['shown'] = signature;
      show(info);
    },
  };
  return tab;
}

/** The tab with announcements. */
export function announceTab(admin: AdminClient): Tab {
  const list = el('ol', { class: 'log announcements' });
  const line = el('p', { class: 'soft', role: 'status' });
  const announce = (): Promise<boolean> =>
    confirmAction({
      title: 'New announcement',
      text: 'It appears on the leaderboard, the wall and the live pages.',
      verb: 'Announce',
      fields: [{ name: 'text', label: 'Text', type: 'textarea', maxlength: 500 }],
      act: async (reason, { text }) => {
        await admin.post('/v1/admin/announcement', { text, reason });
        await tab.refresh();
        return 'Announced.';
      },
    });
  const hide = (): Promise<boolean> =>
    confirmAction({
      title: 'Hide the announcement',
      text: 'The newest announcement disappears from the pages; it stays in this list.',
      verb: 'Hide',
      act: async (reason) => {
        await admin.post('/v1/admin/announcement', { text: '', reason });
        await tab.refresh();
        return 'Hidden.';
      },
    });
  const remove = button('Hide the newest…', () => void hide(), { hidden: true });
  const tab: Tab = {
    id: 'announce',
    title: 'Announcements',
    period: 10_000,
    element: el(
      'section',
      { class: 'panel' },
      el(
        'div',
        { class: 'row head' },
        el('h2', {}, 'Announcements'),
        el(
          'span',
          { class: 'end row' },
          remove,
          button('New announcement…', () => void announce(), { class: 'primary' }),
        ),
      ),
      line,
      list,
    ),
    async refresh() {
      try {
        const { announcements } = await getJson<{ announcements: Announcement[] }>('/v1/announcements');
        const newest = [...announcements].sort((a, b) => b.unix_ms - a.unix_ms);
        line.textContent = newest.length === 0 ? 'No announcements yet.' : '';
        remove.hidden = (newest[0]?.text ?? '') === '';
        list.replaceChildren(
          ...newest.map((one) =>
            el(
              'li',
              {},
              el('time', { datetime: new Date(one.unix_ms).toISOString() }, dateTime(one.unix_ms)),
              one.text === '' ? el('span', { class: 'soft' }, 'announcement hidden') : name(one.text),
            ),
          ),
        );
      } catch (error) {
        line.textContent = errorText(error);
      }
    },
  };
  return tab;
}
