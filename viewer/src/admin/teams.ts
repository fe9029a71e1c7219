/** Teams, and all tokens. A new token is shown once. */
import { dateTime } from '../ui/format';
import { button, el, name } from '../ui/elements';
import { confirmAction, type ActionDialog, showToken } from './dialog';
import type { AdminClient, Tab } from './admin_client';
import { KeyedTable } from './keyed_table';
import type { IssuedToken, TeamRow, TokenRow } from '../wire/messages';

/** The tab. */
export function teamsTab(admin: AdminClient): Tab {
  const teams = new KeyedTable<TeamRow>(
    [
      { head: 'Team' },
      { head: 'Sessions', class: 'n' },
      { head: 'Valid tokens', class: 'n' },
      { head: 'Added' },
      { head: '', class: 'wide' },
    ],
    (team) => team.team,
    (team) => [
      name(team.team),
      team.sessions,
      team.live_tokens,
      dateTime(team.created_unix_ms),
      el(
        'div',
        { class: 'row' },
        button('New token…', () => void issue(rotate(team.team)), { class: 'small' }),
        team.live_tokens > 0 && button('Revoke…', () => void confirmAction(revokeTeam(team.team)), { class: 'small danger' }),
      ),
    ],
    { label: 'Teams', empty: 'No team yet.' },
  );
  const tokens = new KeyedTable<TokenRow>(
    [{ head: 'Owner' }, { head: 'Role' }, { head: 'Id' }, { head: 'Created' }, { head: 'Revoked' }, { head: '', class: 'wide' }],
    (token) => token.token_id,
    (token) => [
      [
        token.team !== null ? name(token.team) : token.label !== '' ? name(token.label) : '–',
        ' ',
        token.token_id === admin.tokenId ? el('span', { class: 'badge info' }, 'yours') : null,
      ],
      token.role,
      el('code', {}, token.token_id),
      dateTime(token.created_unix_ms),
      token.revoked_unix_ms === null ? '–' : dateTime(token.revoked_unix_ms),
      el(
        'div',
        { class: 'row' },
        token.revoked_unix_ms === null && button('Revoke…', () => void confirmAction(revoke(token)), { class: 'small danger' }),
      ),
    ],
    { label: 'Tokens', empty: 'No tokens.' },
  );
  const revoked = el('input', { type: 'checkbox', on: { change: () => show() } });
  let all: TokenRow[] = [];
  const show = (): void => tokens.show(revoked.checked ? all : all.filter((token) => token.revoked_unix_ms === null));

  /** Opens the dialog, and shows the new token. */
  async function issue(
    dialog: Omit<ActionDialog, 'act'> & { make: (reason: string | null, values: Readonly<Record<string, string>>) => Promise<IssuedToken> },
  ): Promise<void> {
    let issued: IssuedToken | null = null;
    const act = async (reason: string | null, values: Readonly<Record<string, string>>): Promise<undefined> => {
      issued = await dialog.make(reason, values);
    };
    if (!(await confirmAction({ ...dialog, act }))) return;
    const made = issued as IssuedToken | null;
    if (made !== null) await showToken(name(made.team ?? `the ${made.role ?? ''}`), made.token);
    await tab.refresh();
  }

  const add = (): Promise<void> =>
    issue({
      title: 'Add a team',
      text: 'The team gets a token, which is shown once.',
      verb: 'Add',
      fields: [{ name: 'team', label: 'Name', maxlength: 200, hint: '1 to 64 characters; must not look like another team’s name' }],
      make: (reason, { team }) => admin.post<IssuedToken>('/v1/admin/team/add', { team, reason }),
    });
  const rotate = (team: string): Parameters<typeof issue>[0] => ({
    title: ['New token for ', name(team)],
    text: 'The old token becomes invalid at once and its connections close; the team continues its session with the new one.',
    verb: 'Create',
    make: (reason) => admin.post<IssuedToken>('/v1/admin/team/rotate', { team, reason }),
  });
  const addToken = (): Promise<void> =>
    issue({
      title: 'New token',
      text: 'Organizers may do everything on this page; viewers may watch runs.',
      verb: 'Create',
      fields: [
        { name: 'role', label: 'Role', type: 'select', options: ['viewer', 'organizer'] },
        { name: 'label', label: 'Owner', maxlength: 64 },
      ],
      make: (reason, { role, label }) => admin.post<IssuedToken>('/v1/admin/token/add', { role, label, reason }),
    });
  const revokeTeam = (team: string): ActionDialog => ({
    title: ['Revoke the tokens of ', name(team)],
    text: 'The team’s connections close. With a new token it can connect again.',
    verb: 'Revoke',
    danger: true,
    act: async (reason) => {
      await admin.post('/v1/admin/team/revoke', { team, reason });
      await tab.refresh();
      return 'Revoked.';
    },
  });
  const revoke = (token: TokenRow): ActionDialog => ({
    title: 'Revoke a token',
    danger: true,
    verb: 'Revoke',
    text: el(
      'span',
      {},
      `${token.role} `,
      name(token.team ?? token.label),
      ', ',
      el('code', {}, token.token_id),
      '. ',
      token.token_id === admin.tokenId
        ? el('b', {}, 'This is your own token: you will be logged out.')
        : 'Connections that use it are closed.',
    ),
    act: async (reason) => {
      await admin.post('/v1/admin/token/revoke', { token_id: token.token_id, reason });
      await tab.refresh();
      return 'Revoked.';
    },
  });

  const tab: Tab = {
    id: 'teams',
    title: 'Teams',
    period: 10_000,
    element: el(
      'div',
      { class: 'stack' },
      el(
        'section',
        { class: 'panel' },
        el(
          'div',
          { class: 'row head' },
          el('h2', {}, 'Teams'),
          button('Add a team…', () => void add(), { class: 'primary end' }),
        ),
        teams.element,
      ),
      el(
        'section',
        { class: 'panel' },
        el(
          'div',
          { class: 'row head' },
          el('h2', {}, 'Tokens'),
          el('label', { class: 'check' }, revoked, 'show revoked'),
          button('New token…', () => void addToken(), { class: 'end' }),
        ),
        tokens.element,
      ),
    ),
    async refresh() {
      const [list, { tokens: found }] = await Promise.all([
        admin.get<{ teams: TeamRow[] }>('/v1/admin/teams'),
        admin.get<{ tokens: TokenRow[] }>('/v1/admin/tokens'),
      ]);
      teams.show(list.teams);
      all = found;
      show();
    },
  };
  return tab;
}
