/** Teams, and the tokens of everybody. A new token is shown once. */
import { dateTime } from '../ui/format';
import { button, el, name } from '../ui/elements';
import { confirmAction, type ActionDialog, showToken } from './dialog';
import type { AdminClient, Tab } from './admin_client';
import { KeyedTable } from './keyed_table';
import type { Issued, Team, Token } from './types';

/** The tab. */
export function teamsTab(desk: AdminClient): Tab {
  const teams = new KeyedTable<Team>(
    [{ head: 'Team' }, { head: 'Sessions', class: 'n' }, { head: 'Live tokens', class: 'n' }, { head: 'Added' }, { head: '', class: 'wide' }],
    (team) => team.team,
    (team) => [name(team.team), team.sessions, team.live_tokens, dateTime(team.created_unix_ms), el('div', { class: 'row' },
      button('New token…', () => { void issue(rotate(team.team)); }, { class: 'small' }),
      team.live_tokens > 0 && button('Revoke…', () => { void confirmAction(revokeTeam(team.team)); }, { class: 'small danger' }))],
    { label: 'Teams', empty: 'No team yet.' });
  const tokens = new KeyedTable<Token>(
    [{ head: 'Whose' }, { head: 'Role' }, { head: 'Id' }, { head: 'Made' }, { head: 'Revoked' }, { head: '', class: 'wide' }],
    (token) => token.token_id,
    (token) => [
      [token.team !== null ? name(token.team) : token.label !== '' ? name(token.label) : '–', ' ', token.token_id === desk.tokenId ? el('span', { class: 'badge info' }, 'this one') : null],
      token.role, el('code', {}, token.token_id), dateTime(token.created_unix_ms), token.revoked_unix_ms === null ? '–' : dateTime(token.revoked_unix_ms),
      el('div', { class: 'row' }, token.revoked_unix_ms === null && button('Revoke…', () => { void confirmAction(revoke(token)); }, { class: 'small danger' })),
    ],
    { label: 'Tokens', empty: 'No token.' });
  const revoked = el('input', { type: 'checkbox', on: { change: () => { show(); } } });
  let all: Token[] = [];
  const show = (): void => { tokens.show(revoked.checked ? all : all.filter((token) => token.revoked_unix_ms === null)); };

  /** Asks, does it, and shows the token that came of it. */
  async function issue(question: Omit<ActionDialog, 'act'> & { make: (reason: string | null, values: Readonly<Record<string, string>>) => Promise<Issued> }): Promise<void> {
    let issued: Issued | null = null;
    const act = async (reason: string | null, values: Readonly<Record<string, string>>): Promise<undefined> => {
      issued = await question.make(reason, values);
    };
    if (!await confirmAction({ ...question, act })) return;
    const made = issued as Issued | null;
    if (made !== null) await showToken(name(made.team ?? `the ${made.role ?? ''}`), made.token);
    await tab.refresh();
  }

  const add = (): Promise<void> => issue({
    title: 'Add a team', text: 'It gets a token, which is shown once.', verb: 'Add',
    fields: [{ name: 'team', label: 'Name', maxlength: 200, hint: '1 to 64 characters; not like another team’s' }],
    make: (reason, { team }) => desk.post<Issued>('/v1/admin/team/add', { team, reason }),
  });
  const rotate = (team: string): Parameters<typeof issue>[0] => ({
    title: ['New token for ', name(team)], text: 'The old one ends at once and its connections close; the team’s session goes on under the new one.', verb: 'Make',
    make: (reason) => desk.post<Issued>('/v1/admin/team/rotate', { team, reason }),
  });
  const addToken = (): Promise<void> => issue({
    title: 'New token', text: 'Organizers may do everything that stands on this page; viewers may watch runs.', verb: 'Make',
    fields: [{ name: 'role', label: 'For', type: 'select', options: ['viewer', 'organizer'] }, { name: 'label', label: 'Whose it is', maxlength: 64 }],
    make: (reason, { role, label }) => desk.post<Issued>('/v1/admin/token/add', { role, label, reason }),
  });
  const revokeTeam = (team: string): ActionDialog => ({
    title: ['Revoke the tokens of ', name(team)], text: 'Its connections close. A new token lets it in again.', verb: 'Revoke', danger: true,
    act: async (reason) => {
      await desk.post('/v1/admin/team/revoke', { team, reason });
      await tab.refresh();
      return 'Revoked.';
    },
  });
  const revoke = (token: Token): ActionDialog => ({
    title: 'Revoke a token', danger: true, verb: 'Revoke',
    text: el('span', {}, `${token.role} `, name(token.team ?? token.label), ', ', el('code', {}, token.token_id), '. ',
      token.token_id === desk.tokenId ? el('b', {}, 'It is the one you are logged in with: this page closes.') : 'Whoever uses it is thrown out.'),
    act: async (reason) => {
      await desk.post('/v1/admin/token/revoke', { token_id: token.token_id, reason });
      await tab.refresh();
      return 'Revoked.';
    },
  });

  const tab: Tab = {
    id: 'teams', title: 'Teams', period: 10_000,
    element: el('div', { class: 'stack' },
      el('section', { class: 'panel' }, el('div', { class: 'row head' }, el('h2', {}, 'Teams'), button('Add a team…', () => { void add(); }, { class: 'primary end' })), teams.element),
      el('section', { class: 'panel' }, el('div', { class: 'row head' }, el('h2', {}, 'Tokens'), el('label', { class: 'check' }, revoked, 'revoked ones too'),
        button('New token…', () => { void addToken(); }, { class: 'end' })), tokens.element)),
    async refresh() {
      const [list, { tokens: found }] = await Promise.all([desk.get<{ teams: Team[] }>('/v1/admin/teams'), desk.get<{ tokens: Token[] }>('/v1/admin/tokens')]);
      teams.show(list.teams);
      all = found;
      show();
    },
  };
  return tab;
}
