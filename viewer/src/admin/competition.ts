/** The competition: its phases, announcements, tables to take home, and the backup. */
import { getJson } from '../net/api';
import { dateTime } from '../ui/format';
import { button, el, facts, name } from '../ui/elements';
import type { Announcement, CompetitionInfo } from '../board/model';
import { confirmAction, type ActionDialog } from './dialog';
import { type AdminClient, errorText, type Tab } from './admin_client';

const WORDS = {
  closed: 'Closed: no session can begin; those that are open go on.',
  open: 'Open: a team’s first hello opens its session.',
  revealed: 'Over: seeds and replays are open to everybody.',
} as const;

/** The tab of phases and tables. */
export function competitionTab(desk: AdminClient, told: (info: CompetitionInfo) => void): Tab {
  const now = el('section', { class: 'panel' });

  const enter = (verb: string, path: string, text: string, more: Partial<ActionDialog> = {}): HTMLButtonElement => {
    const question: ActionDialog = {
      title: `${verb} the competition`, text, verb, ...more,
      act: async (reason) => {
        await desk.post(`/v1/admin/competition/${path}`, { reason });
        await tab.refresh();
        return `${verb}: done.`;
      },
    };
    return button(`${verb}…`, () => { void confirmAction(question); }, { class: more.danger === true ? 'danger' : path === 'open' ? 'primary' : undefined });
  };

  function show(info: CompetitionInfo): void {
    told(info);
    const phase = info.phase ?? null;
    now.replaceChildren(
      el('h2', {}, name(info.name)),
      el('p', {}, phase === null ? 'A practice server: there are no phases.' : WORDS[phase]),
      el('div', { class: 'row' },
        phase === 'closed' && enter('Open', 'open', 'From now on a team’s first hello opens its session.', { typed: info.name }),
        phase === 'open' && enter('Close', 'close', 'No further session can begin; those that are open go on.', { typed: info.name }),
        phase !== null && phase !== 'revealed' && enter('Reveal', 'reveal', 'There is no way back: the secret behind the seeds becomes public, replays open to everybody, and the competition is over.', { typed: info.name, danger: true })),
      el('h3', {}, 'Publish these before'),
      facts([['SHA-256 of the seeds’ secret', el('code', {}, info.seed_secret_sha256 ?? '–')], ['replay key', el('code', {}, info.replay_key ?? '–')],
        ['the secret', info.seed_secret === undefined || info.seed_secret === null ? 'hidden until the reveal' : el('code', {}, info.seed_secret)]]));
  }

  const table = (what: string): HTMLElement => el('li', { class: 'row' }, el('span', { class: 'grow' }, what),
    ...['csv', 'json'].map((format) => button(format.toUpperCase(), () => { void desk.save(`/v1/admin/export/${what}?format=${format}`, `${what}.${format}`); }, { class: 'small', 'aria-label': `${what} as ${format.toUpperCase()}` })));
  const home = el('section', { class: 'panel' }, el('h2', {}, 'Tables to take home'), el('ul', { class: 'plain' }, ...['leaderboard', 'sessions', 'runs', 'audit'].map(table)),
    el('h3', {}, 'Backup'), el('p', {}, 'Everything as one archive, secrets included: whoever has it can run the competition.'),
    button('Fetch the backup', () => { void desk.save('/v1/admin/backup', 'palmares-backup.zip'); }));

  const tab: Tab = {
    id: 'competition', title: 'Competition', period: 10_000,
    element: el('div', { class: 'columns' }, now, home),
    async refresh() {
      const info = await getJson<CompetitionInfo>('/v1/competition');
      const signature = JSON.stringify(info);
      if (now.dataset['shown'] === signature) return;
      now.dataset['shown'] = signature;
      show(info);
    },
  };
  return tab;
}

/** The tab of announcements. */
export function announceTab(desk: AdminClient): Tab {
  const list = el('ol', { class: 'log announcements' });
  const line = el('p', { class: 'soft', role: 'status' });
  const announce = (): Promise<boolean> => confirmAction({
    title: 'Tell everybody', text: 'It stands on the leaderboard, on the wall and on the live pages.', verb: 'Announce',
    fields: [{ name: 'text', label: 'What', type: 'textarea', maxlength: 500 }],
    act: async (reason, { text }) => {
      await desk.post('/v1/admin/announcement', { text, reason });
      await tab.refresh();
      return 'Announced.';
    },
  });
  const away = (): Promise<boolean> => confirmAction({
    title: 'Take it away', text: 'The newest announcement goes off the pages; it stays in this list.', verb: 'Take away',
    act: async (reason) => {
      await desk.post('/v1/admin/announcement', { text: '', reason });
      await tab.refresh();
      return 'Taken away.';
    },
  });
  const remove = button('Take it away…', () => { void away(); }, { hidden: true });
  const tab: Tab = {
    id: 'announce', title: 'Announcements', period: 10_000,
    element: el('section', { class: 'panel' }, el('div', { class: 'row head' }, el('h2', {}, 'Announcements'), el('span', { class: 'end row' }, remove, button('Tell everybody…', () => { void announce(); }, { class: 'primary' }))), line, list),
    async refresh() {
      try {
        const { announcements } = await getJson<{ announcements: Announcement[] }>('/v1/announcements');
        const newest = [...announcements].sort((a, b) => b.unix_ms - a.unix_ms);
        line.textContent = newest.length === 0 ? 'Nothing has been announced.' : '';
        remove.hidden = (newest[0]?.text ?? '') === '';
        list.replaceChildren(...newest.map((one) => el('li', {}, el('time', { datetime: new Date(one.unix_ms).toISOString() }, dateTime(one.unix_ms)), one.text === '' ? el('span', { class: 'soft' }, 'what stood there was taken away') : name(one.text))));
      } catch (error) {
        line.textContent = errorText(error);
      }
    },
  };
  return tab;
}
