/** The organizers' page: teams, phases, clocks, runs, hands, announcements, tokens. */
import { expect, type Locator, type Page } from '@playwright/test';
import { claw } from './claw';
import { Control, playing } from './control';
import { complaints } from './looks';
import { EVENT, type Official, test } from './server';

/** Names with markup and right-to-left text. */
const TEAM = '<img src=x onerror=alert(1)> \u0642\u0631\u062f\u0629 crabs';
const OTHER = '\u05e1\u05e8\u05d8\u05e0\u05d9\u05dd & "friends" <script>';

test.describe.configure({ mode: 'serial' });

const tokens = new Map<string, string>();

async function addTeam(official: Official, team: string): Promise<string> {
  const { token } = await official.post('/v1/admin/team/add', { team, reason: null });
  tokens.set(team, token as string);
  return token as string;
}

async function logIn(page: Page, official: Official, token = official.organizer): Promise<void> {
  await page.goto(`${official.url}/admin`);
  await page.getByLabel('Token').fill(token);
  await page.getByRole('button', { name: 'Log in' }).click();
  await expect(page.getByRole('tablist')).toBeVisible();
}

const tab = (page: Page, name: string): Promise<void> => page.getByRole('tab', { name, exact: true }).click();

/** Presses a button, enters a reason in its dialog, and confirms. */
async function decide(
  page: Page,
  pressed: Locator,
  verb: string,
  reason: string,
  fill: (dialog: Locator) => Promise<void> = () => Promise.resolve(),
): Promise<void> {
  await pressed.click();
  const dialog = page.getByRole('dialog');
  await fill(dialog);
  await dialog.getByLabel('Reason').fill(reason);
  await dialog.getByRole('button', { name: verb, exact: true }).click();
  await expect(dialog.getByLabel('Reason')).toHaveCount(0);
}

/** Seconds left, as shown in a row. */
async function left(row: Locator): Promise<number> {
  const parts = (await row.locator('[data-clock=left]').innerText()).split(':').map(Number);
  return parts.reduce((sum, part) => sum * 60 + part, 0);
}

test.beforeAll(async ({ official }) => {
  const { phase } = await official.get('/v1/competition');
  if (phase === 'open') await official.post('/v1/admin/competition/close', { reason: 'from the beginning' });
});

test('only an organizer gets in, and the token stays in memory', async ({ page, official }) => {
  await page.goto(`${official.url}/admin`);
  const [field, go, alert] = [page.getByLabel('Token'), page.getByRole('button', { name: 'Log in' }), page.getByRole('alert')];
  await field.fill('not a token');
  await go.click();
  await expect(alert).toContainText('This is not a token');
  await field.fill(`plm_0123456789abcdef_${'0'.repeat(64)}`);
  await go.click();
  await expect(alert).toHaveText(
    'The server does not know this token. Copy all of it, from plm_ to its end. If it was revoked, ask an organizer for another one.',
  );
  await field.fill(await addTeam(official, OTHER));
  await go.click();
  await expect(alert).toContainText('not an organizer’s');
  await field.fill(official.organizer);
  await field.press('Enter');
  await expect(page.getByRole('tab', { name: 'Sessions' })).toBeVisible();
  expect(
    await page.evaluate(() => JSON.stringify([{ ...localStorage }, { ...sessionStorage }, document.cookie, location.href])),
  ).not.toContain('plm_');
  expect(await page.content()).not.toContain(official.organizer);
  await page.reload();
  await expect(page.getByRole('button', { name: 'Log in' })).toBeVisible();
});

test('a team is added, and its token is shown once', async ({ page, official }) => {
  const wrong = complaints(page);
  await logIn(page, official);
  await tab(page, 'Teams');
  await decide(page, page.getByRole('button', { name: 'Add a team…' }), 'Add', 'paid its fee', (dialog) =>
    dialog.getByLabel('Name').fill(TEAM),
  );
  const token = await page.getByRole('dialog').getByLabel('Token').inputValue();
  expect(token).toMatch(/^plm_[0-9a-f]+_[0-9a-f]+$/);
  tokens.set(TEAM, token);
  await page.getByRole('button', { name: 'I have copied it' }).click();
  const row = page.getByRole('table', { name: 'Teams' }).getByRole('row').filter({ hasText: TEAM });
  await expect(row).toBeVisible();
  expect(await page.content()).not.toContain(token);
  // A similar name is refused with the server's message, and the dialog stays.
  await page.getByRole('button', { name: 'Add a team…' }).click();
  await page.getByRole('dialog').getByLabel('Name').fill(TEAM.replace('crabs', 'cr\u0430bs'));
  await page.getByRole('dialog').getByRole('button', { name: 'Add', exact: true }).click();
  await expect(page.getByRole('dialog').getByRole('alert')).toContainText('looks like');
  await page.getByRole('button', { name: 'Cancel' }).click();
  // The browser itself logs the refusal.
  expect(wrong.filter((text) => !text.includes('status of 409'))).toEqual([]);
});

test('a session is opened, paused, extended and ended; a run is voided; the audit has the reasons', async ({ page, official }) => {
  const wrong = complaints(page);
  await logIn(page, official);
  await tab(page, 'Competition');
  await page.getByRole('button', { name: 'Open…' }).click();
  await page.getByRole('dialog').getByLabel('To confirm').fill('Cup');
  await page.getByRole('dialog').getByRole('button', { name: 'Open' }).click();
  await expect(page.getByRole('alert').filter({ hasText: 'does not match' })).toBeVisible();
  await page.getByRole('button', { name: 'Cancel' }).click();
  await decide(page, page.getByRole('button', { name: 'Open…' }), 'Open', 'nine o’clock', (dialog) =>
    dialog.getByLabel('To confirm').fill(EVENT),
  );
  await expect(page.getByText('Open: a team’s session begins when its client connects.')).toBeVisible();

  const control = await Control.open(official.url, tokens.get(TEAM));
  await control.begin('whatever', 'balls');
  await control.step(20, { hand: [0.4] });
  await tab(page, 'Sessions');
  const row = page.getByRole('table', { name: 'Sessions' }).getByRole('row').filter({ hasText: TEAM });
  await expect(row.getByText('running')).toBeVisible();
  const before = await left(row);
  expect(before).toBeLessThan(1800);
  await expect.poll(() => left(row)).toBeLessThan(before);

  await decide(page, row.getByRole('button', { name: 'Pause…' }), 'Pause', 'fire alarm');
  await expect(row.getByText('paused')).toBeVisible();
  const held = await left(row);
  await page.waitForTimeout(2500);
  expect(await left(row)).toBe(held);
  await decide(page, row.getByRole('button', { name: 'Resume…' }), 'Resume', 'a false alarm');
  await expect(row.getByText('running')).toBeVisible();
  await decide(page, row.getByRole('button', { name: 'Add time…' }), 'Add', 'the alarm', (dialog) =>
    dialog.getByLabel('Seconds').fill('120'),
  );
  await expect.poll(() => left(row)).toBeGreaterThan(held + 60);
  // Adding time needs a reason.
  await row.getByRole('button', { name: 'Add time…' }).click();
  await page.getByRole('dialog').getByRole('button', { name: 'Add', exact: true }).click();
  await expect(page.getByRole('dialog').getByRole('alert')).toContainText('Enter a reason');
  await page.getByRole('button', { name: 'Cancel' }).click();

  const run = (await control.ask('stop'))['run_id'] as string;
  await tab(page, 'Verification');
  await page.getByLabel('all runs').check();
  const played = page.getByRole('table', { name: 'Runs' }).getByRole('row').filter({ hasText: run });
  await expect(played).toContainText(TEAM);
  await decide(page, played.getByRole('button', { name: 'Void…' }), 'Void', 'the ball was <b>pushed</b>');
  await expect(played.getByText('voided', { exact: true })).toBeVisible();
  await decide(page, played.getByRole('button', { name: 'Count again…' }), 'Count again', 'nobody pushed it');
  await expect(played.getByText('verified', { exact: true })).toBeVisible({ timeout: 20_000 });

  await tab(page, 'Sessions');
  await decide(page, row.getByRole('button', { name: 'End…' }), 'End', 'the team went home');
  await expect(row.getByText('ended')).toBeVisible();
  control.end();

  await tab(page, 'Audit');
  const audit = page.getByRole('table', { name: 'Audit' });
  for (const [action, reason] of [
    ['competition.open', 'nine o’clock'],
    ['session.pause', 'fire alarm'],
    ['session.resume', 'a false alarm'],
    ['session.grant 120 s', 'the alarm'],
    ['run.void', 'the ball was <b>pushed</b>'],
    ['run.unvoid', 'nobody pushed it'],
    ['session.end', 'the team went home'],
    ['team.add', 'paid its fee'],
  ] as const) {
    await expect(audit.getByRole('row').filter({ hasText: action }).filter({ hasText: reason }).first()).toBeVisible();
  }
  expect(wrong).toEqual([]);
});

test('an announcement appears on leaderboard and wall without a reload, until it is hidden', async ({ browser, official }) => {
  const context = await browser.newContext();
  const [page, board, wall] = [await context.newPage(), await context.newPage(), await context.newPage()];
  const wrong = complaints(page, board, wall);
  await board.goto(`${official.url}/`);
  await wall.goto(`${official.url}/wall`);
  await expect(board.getByText('Live.')).toBeVisible();
  await expect(board.getByText(EVENT).first()).toBeVisible();
  await expect(wall.getByRole('heading', { name: EVENT })).toBeVisible();
  await logIn(page, official);
  await tab(page, 'Announcements');
  // A background page is slow.
  await page.bringToFront();
  const said = 'Lunch at noon <i>in the hall</i> \u063a\u062f\u0627\u0621';
  await decide(page, page.getByRole('button', { name: 'New announcement…' }), 'Announce', 'so that all come', (dialog) =>
    dialog.getByLabel('Text').fill(said),
  );
  await expect(page.getByRole('listitem').filter({ hasText: said })).toBeVisible();
  await expect(board.getByText(said)).toBeVisible();
  await expect(wall.getByText(said)).toBeVisible();
  await decide(page, page.getByRole('button', { name: 'Hide the newest…' }), 'Hide', 'all have eaten');
  await expect(board.getByText(said)).toBeHidden();
  await expect(wall.getByText(said)).toBeHidden();
  expect(wrong).toEqual([]);
  await context.close();
});

test('a team’s hand is inspected, approved and rejected', async ({ page, official }) => {
  const wrong = complaints(page);
  const team = { Authorization: `Bearer ${tokens.get(OTHER)}` };
  const sent = await fetch(`${official.url}/v1/hands`, { method: 'POST', headers: team, body: claw() });
  expect([sent.status, ((await sent.json()) as { name: string }).name]).toEqual([201, 'claw-1']);
  await logIn(page, official);
  await tab(page, 'Hands');
  const row = page.getByRole('table', { name: 'Teams’ own hands' }).getByRole('row').filter({ hasText: OTHER });
  await expect(row.getByText('pending')).toBeVisible();
  await row.getByRole('button', { name: 'Details' }).click();
  const turning = page.getByRole('img', { name: 'claw-1, turned' });
  await expect(turning).toBeVisible();
  expect(await page.getByRole('img', { name: /^claw-1/ }).count()).toBe(4);
  const seen = (): Promise<string | null> => turning.locator('polygon').last().getAttribute('points');
  const first = await seen();
  await expect.poll(seen).not.toBe(first);
  const figures = page.getByRole('region', { name: 'Figures' });
  await expect(figures.getByRole('columnheader', { name: 'Most of others' })).toBeVisible();
  await expect(
    figures
      .getByRole('row')
      .filter({ hasText: /mass of the hand/i })
      .first(),
  ).toContainText('≤ 5');

  await decide(page, row.getByRole('button', { name: 'Approve…' }), 'Approve', 'it is a hand');
  await expect(row.getByText('approved')).toBeVisible();
  await row.getByRole('button', { name: 'Reject…' }).click();
  await page.getByRole('dialog').getByRole('button', { name: 'Reject' }).click();
  await expect(page.getByRole('dialog').getByRole('alert')).toContainText('Enter a reason');
  await page.getByRole('dialog').getByLabel('Reason').fill('its fingers are <u>blades</u>');
  await page.getByRole('dialog').getByRole('button', { name: 'Reject' }).click();
  await expect(row.getByText('rejected')).toBeVisible();
  const { own } = (await official.get('/v1/hands', tokens.get(OTHER))) as { own: { note: string }[] };
  expect(own.map((hand) => hand.note)).toEqual(['its fingers are <u>blades</u>']);
  await expect(page.getByText('its fingers are <u>blades</u>').first()).toBeVisible();
  expect(wrong).toEqual([]);
});

test('a viewer’s token shows clocks and runs, until it is revoked', async ({ browser, official }) => {
  const context = await browser.newContext();
  const [wall, live] = [await context.newPage(), await context.newPage()];
  const wrong = complaints(wall, live);
  const { token, token_id } = await official.post('/v1/admin/token/add', { role: 'viewer', label: 'the hall', reason: null });
  const { control, over, stop } = await playing(official.url, 'x', tokens.get(OTHER));

  await wall.goto(`${official.url}/wall`);
  await wall.keyboard.press('t');
  await wall.getByRole('textbox', { name: 'Token' }).fill(`plm_0123456789abcdef_${'0'.repeat(64)}`);
  await wall.getByRole('button', { name: 'Use this token' }).click();
  await expect(wall.getByRole('alert')).toHaveText(
    'The server does not know this token. Copy all of it, from plm_ to its end. If it was revoked, ask an organizer for another one.',
  );
  await wall.getByRole('textbox', { name: 'Token' }).fill(token as string);
  await wall.getByRole('button', { name: 'Use this token' }).click();
  await expect(wall.getByRole('dialog')).toHaveCount(0);
  await expect.poll(() => wall.evaluate(() => (window.palmares as { live: { ready: boolean } }).live.ready)).toBe(true);
  const time = wall.locator('.clock-card').filter({ hasText: OTHER }).locator('.time');
  await expect(time).toHaveCount(1);
  const first = await time.textContent();
  await expect.poll(() => time.textContent()).not.toBe(first);
  await expect(wall.locator('.live .who')).toHaveText(OTHER);

  await live.bringToFront();
  await live.goto(`${official.url}/live`);
  await expect(live.getByText('No run is being played')).toBeVisible();
  await live.getByText('I have a token').click();
  for (const wrongToken of ['not a token', `plm_0123456789abcdef_${'0'.repeat(64)}`]) {
    await live.getByLabel('Token').fill(wrongToken);
    await live.getByRole('button', { name: 'Use this token' }).click();
    await expect(live.getByRole('status').first()).toHaveText(
      wrongToken === 'not a token' ? /^This is not a token/ : /^The server does not know this token/,
    );
  }
  await live.getByLabel('Token').fill(token as string);
  await live.getByRole('button', { name: 'Use this token' }).click();
  // The document keeps the token when a run is opened.
  await live.getByRole('link', { name: `Watch ${OTHER}` }).click();
  await expect(live.getByRole('heading', { level: 1 })).toContainText(OTHER);
  expect(live.url()).toContain('/live/ses_');
  await official.post('/v1/admin/announcement', { text: 'five minutes', reason: null });
  await expect(live.getByText('five minutes')).toBeVisible();

  // An answer that was asked for before comes after it, and shows nothing any more.
  let asked = 0;
  let answered = 0;
  await wall.route('**/v1/sessions', async (route) => {
    const response = await route.fetch();
    asked += 1;
    await expect(wall.getByRole('alert')).toContainText('The token was revoked');
    await route.fulfill({ response });
    answered += 1;
  });
  await expect.poll(() => asked).toBeGreaterThan(0);
  await official.post('/v1/admin/token/revoke', { token_id, reason: 'it was on a photograph' });
  await expect(wall.getByRole('alert')).toContainText('The token was revoked');
  await expect.poll(() => answered).toBeGreaterThan(0);
  await wall.waitForTimeout(300);
  await expect(wall.locator('.clocks .who')).toHaveCount(0);
  await expect(wall.locator('.live')).toBeHidden();
  await expect(live.getByText(/revoked/).first()).toBeVisible();

  // Revoking a team's token ends its connection.
  const { tokens: known } = (await official.get('/v1/admin/tokens')) as { tokens: { token_id: string; team: string | null }[] };
  await official.post('/v1/admin/token/revoke', { token_id: known.find((one) => one.team === OTHER)?.token_id, reason: 'it leaked' });
  await expect(over).rejects.toThrow();
  await stop();
  await expect.poll(() => control.closed).toBe(4401);
  await expect(Control.open(official.url, tokens.get(OTHER))).rejects.toThrow('401');
  expect(wrong.filter((text) => !/status of 40[13]|401|HTTP Authentication failed/.test(text))).toEqual([]);
  await context.close();
});

test('an organizer whose token is revoked is logged out', async ({ page, official }) => {
  const { token } = await official.post('/v1/admin/token/add', { role: 'organizer', label: 'anna', reason: null });
  await logIn(page, official, token as string);
  await tab(page, 'Teams');
  const own = page.getByRole('table', { name: 'Tokens' }).getByRole('row').filter({ hasText: 'yours' });
  await expect(own).toContainText('anna');
  await decide(page, own.getByRole('button', { name: 'Revoke…' }), 'Revoke', 'it leaked');
  await expect(page.getByRole('alert')).toContainText('was revoked');
  await expect(page.getByRole('button', { name: 'Log in' })).toBeVisible();
  expect(await page.getByRole('table').count()).toBe(0);

  // Also without any input.
  const other = await official.post('/v1/admin/token/add', { role: 'organizer', label: 'bert', reason: null });
  await logIn(page, official, other['token'] as string);
  await page.getByLabel('only open sessions').waitFor();
  await official.post('/v1/admin/token/revoke', { token_id: other['token_id'], reason: 'bert left' });
  await expect(page.getByRole('alert')).toContainText('was revoked', { timeout: 6000 });
});

test('a pause, the places and the time slots', async ({ page, official }) => {
  const wrong = complaints(page);
  await logIn(page, official);
  await tab(page, 'Competition');
  await expect(page.getByText(/Places: \d+ of 32 in use\. A team that comes now finds one\./)).toBeVisible();
  await decide(page, page.getByRole('button', { name: 'Pause…' }), 'Pause', 'fire alarm', (dialog) =>
    dialog.getByLabel('To confirm').fill(EVENT),
  );
  await expect(page.getByText(/Paused since .*: all clocks and worlds are stopped/)).toBeVisible();
  await expect(page.locator('.title .badge.warn')).toHaveText('paused');
  const board = await page.context().newPage();
  await board.goto(`${official.url}/`);
  await expect(board.getByText('The competition is paused: all clocks are stopped.')).toBeVisible();
  await board.close();
  await decide(page, page.getByRole('button', { name: 'Resume…' }), 'Resume', 'false alarm', (dialog) =>
    dialog.getByLabel('To confirm').fill(EVENT),
  );
  await expect(page.locator('.title .badge.warn')).toBeHidden();

  await tab(page, 'Schedule');
  await expect(page.getByText('No schedule: every team can begin')).toBeVisible();
  const slot = (team: string, hours: number): string =>
    `"${team.replaceAll('"', '""')}",${new Date(Date.now() + hours * 3_600_000).toISOString()},${new Date(Date.now() + (hours + 1) * 3_600_000).toISOString()}`;
  await page
    .getByLabel('CSV file')
    .setInputFiles({ name: 'slots.csv', mimeType: 'text/csv', buffer: Buffer.from(`team,begins_at,ends_at\n${slot(TEAM, -0.5)}\n`) });
  await page.getByRole('dialog').getByRole('button', { name: 'Import' }).click();
  const rows = page.getByRole('table', { name: 'Schedule' }).locator('tbody tr');
  await expect(rows).toHaveCount(1);
  await expect(rows.first()).toContainText('now');
  await expect(page.getByText('teams without a slot cannot play')).toBeVisible();
  await decide(page, page.getByRole('button', { name: 'Add a slot…' }), 'Add', 'the draw', (dialog) =>
    dialog.getByLabel('Team').fill(OTHER),
  );
  await expect(rows).toHaveCount(2);
  await decide(page, page.getByRole('button', { name: 'Move all…' }), 'Move', 'we are late', (dialog) =>
    dialog.getByLabel('Minutes').fill('30'),
  );
  await decide(page, rows.nth(1).getByRole('button', { name: 'Move…' }), 'Move', 'on request', async (dialog) => {
    await dialog.getByLabel('Begins').fill('2099-01-01T09:00');
    await dialog.getByLabel('Ends').fill('2099-01-01T09:40');
  });
  await expect(rows.nth(1)).toContainText('2099-01-01 09:00:00');
  await expect(rows.nth(1)).toContainText('40');
  await decide(page, page.getByRole('button', { name: 'Remove…' }), 'Remove', 'no slots after all');
  await expect(rows).toHaveCount(0);
  expect(wrong).toEqual([]);
});

test('the end opens seeds and replays, after the name was typed', async ({ page, official }) => {
  await logIn(page, official);
  await tab(page, 'Competition');
  await expect(page.getByText('hidden until revealed')).toBeVisible();
  // Not before the last session is over; the page says so in the server's words.
  await page.getByRole('button', { name: 'Reveal…' }).click();
  await page.getByRole('dialog').getByLabel('To confirm').fill(EVENT);
  await page.getByRole('dialog').getByRole('button', { name: 'Reveal' }).click();
  await expect(page.getByRole('dialog').getByRole('alert')).toContainText('palmares admin end');
  await page.getByRole('button', { name: 'Cancel' }).click();
  await decide(page, page.getByRole('button', { name: 'Close…' }), 'Close', 'six o’clock', (dialog) =>
    dialog.getByLabel('To confirm').fill(EVENT),
  );
  const { sessions } = (await official.get('/v1/sessions')) as { sessions: { session_id: string; status: string }[] };
  for (const one of sessions.filter((session) => session.status === 'open'))
    await official.post('/v1/admin/session/end', { session_id: one.session_id, reason: null });
  await decide(page, page.getByRole('button', { name: 'Reveal…' }), 'Reveal', 'six o’clock', (dialog) =>
    dialog.getByLabel('To confirm').fill(EVENT),
  );
  await expect(page.getByText('Over: seeds and replays are public.')).toBeVisible();
  const { seed_secret } = await official.get('/v1/competition');
  await expect(page.getByText(seed_secret as string)).toBeVisible();
  await page.goto(`${official.url}/`);
  await expect(page.getByText('The competition is over.')).toBeVisible();
});
