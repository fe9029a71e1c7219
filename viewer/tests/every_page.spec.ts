/** Every page at two widths and in both themes: readable, without errors or external requests. Screenshots are kept. */
import { expect, type Page } from '@playwright/test';
import { claw } from './claw';
import { APPLE, Control, grasp, playing } from './control';
import { barriers, complaints, screen, sideways } from './looks';
import { type Official, test } from './server';

const SIZES = [
  [1280, 800],
  [390, 844],
] as const;
const THEMES = ['light', 'dark'] as const;

test.setTimeout(150_000);

/** Checks a page at both widths and in both themes. */
async function look(page: Page, name: string): Promise<void> {
  for (const [width, height] of SIZES) {
    await page.setViewportSize({ width, height });
    for (const colorScheme of THEMES) {
      await page.emulateMedia({ colorScheme, reducedMotion: 'reduce' });
      // The theme changes after a frame.
      await page.evaluate(() => new Promise((go) => requestAnimationFrame(() => requestAnimationFrame(go))));
      const where = `${name}, ${width} px, ${colorScheme}`;
      expect.soft(await sideways(page), `${where}: moved sideways`).toBe(0);
      // The navigation is one line; the name leads to the leaderboard.
      const links = await page.locator('header.nav :is(.brand, nav a)').evaluateAll((all) =>
        all
          .map((one) => one.getBoundingClientRect())
          .filter((box) => box.width > 0)
          .map(({ top, bottom, right }) => ({ top, bottom, right })),
      );
      expect.soft(links.length, where).toBeGreaterThanOrEqual(7);
      expect
        .soft(Math.max(...links.map(({ top }) => top)), `${where}: navigation of several lines`)
        .toBeLessThan(Math.min(...links.map(({ bottom }) => bottom)));
      expect.soft(Math.max(...links.map(({ right }) => right)), `${where}: a link beyond the window`).toBeLessThanOrEqual(width);
      // On a 3D page nothing is below the window.
      if (width > 1000 && (await page.locator('main.stage-page').count()) > 0) {
        await expect.soft
          .poll(() => page.evaluate(() => document.documentElement.scrollHeight - innerHeight), {
            message: `${where}: longer than the window`,
          })
          .toBeLessThanOrEqual(0);
      }
      // Colours do not depend on the width: both themes are checked for wide windows, one for narrow ones.
      if (width > 1000 || colorScheme === 'dark') expect.soft(await barriers(page), where).toEqual([]);
      await page.screenshot({ path: screen(`${name}-${width}-${colorScheme}`), fullPage: true });
    }
  }
}

/** Most bytes of a page's first load. */
const FIRST_LOAD = 250_000;

/** Bytes of a page with its scripts and styles, as they were sent; without pictures, and without the data that it asks for. */
const sent = (page: Page): Promise<number> =>
  page.evaluate(() => {
    const entries = [
      ...performance.getEntriesByType('navigation'),
      ...performance.getEntriesByType('resource'),
    ] as PerformanceResourceTiming[];
    return entries
      .filter(({ initiatorType }) => !['fetch', 'xmlhttprequest', 'img'].includes(initiatorType))
      .reduce((sum, { encodedBodySize }) => sum + encodedBodySize, 0);
  });

/** Pages of a practice server, and how to wait for each. */
const pages = (run: string): [name: string, address: string, ready: (page: Page) => Promise<unknown>][] => [
  ['leaderboard', '/', (page) => page.getByText('Live.').waitFor()],
  [
    'live',
    '/live',
    (page) =>
      page
        .getByRole('link', { name: /^Watch/ })
        .first()
        .waitFor(),
  ],
  [
    'live-featured',
    '/live/featured',
    (page) => page.waitForFunction(() => ((window.palmares?.['live'] as { newest?: { tick: number } } | undefined)?.newest?.tick ?? 0) > 0),
  ],
  ['replay', '/replay', (page) => page.getByLabel('Open an MCAP file').waitFor()],
  ['replay-run', `/replay/${run}`, (page) => page.waitForFunction(() => window.palmares?.['player'] !== undefined)],
  ['replay-closing', `/replay/${run}`, (page) => page.getByRole('button', { name: 'Closing: measured and predicted' }).click()],
  ['drive', '/drive', (page) => page.getByRole('button', { name: 'Start', exact: true }).waitFor()],
  ['hands', '/hands', (page) => page.getByText('softhand').first().waitFor()],
  ['hands-softhand', '/hands/softhand', (page) => page.getByRole('slider').first().waitFor()],
  ['docs-teams', '/docs/teams', (page) => page.getByRole('heading', { level: 1 }).waitFor()],
  ['docs-search', '/docs/search?q=tendon%20friction', (page) => page.locator('.hits li').first().waitFor()],
  ['team', '/teams/prawns%20%D9%82%D8%B1%D8%AF%D8%A9', (page) => page.getByRole('heading', { name: 'Scores in time' }).waitFor()],
  ['wall', '/wall', (page) => page.locator('.ranking tbody tr').first().waitFor()],
];

test('pages of a practice server', async ({ page, server }) => {
  const control = await Control.open(server.url);
  const run = await control.begin('prawns \u0642\u0631\u062f\u0629', 'grasp', { seed: APPLE });
  await grasp(control, 60);
  await control.ask('stop');
  control.end();
  // A second run stays open and pauses.
  const going = await Control.open(server.url);
  await going.begin('<b>lobsters</b>', 'grasp', { seed: APPLE });
  await grasp(going, 1);
  const wrong = complaints(page);
  for (const [name, address, ready] of pages(run)) {
    await page.goto(server.url + address);
    if (await page.getByText('compiled without its viewer').isVisible()) {
      console.warn(`skipped: ${address} is not in the viewer that this server has`);
      continue;
    }
    await ready(page);
    const bytes = await sent(page);
    // The library that draws is larger.
    expect.soft(bytes, `${name}: first load`).toBeGreaterThan((await page.locator('main.stage-page').count()) > 0 ? 100_000 : 1000);
    expect.soft(bytes, `${name}: first load`).toBeLessThanOrEqual(FIRST_LOAD);
    await look(page, name);
  }
  // The wall shows the paused run beside the ranking.
  await expect(page.locator('.live .score')).toHaveText('Score 1.0');
  await expect
    .poll(() =>
      page.evaluate(() => (window.palmares as { live: { drawing: { placeOf(id: number): number[] } } }).live.drawing.placeOf(0)[2]),
    )
    .toBeGreaterThan(0.1);
  going.end();
  expect(wrong).toEqual([]);
});

/** Creates content for every tab. */
async function furnish(official: Official): Promise<() => Promise<void>> {
  const { phase } = await official.get('/v1/competition');
  if (phase === 'closed') await official.post('/v1/admin/competition/open', { reason: 'a look around' });
  const first = await official.post('/v1/admin/team/add', {
    team: 'a team with a long name, and <em>markup</em> in it, \u0648\u0639\u0631\u0628\u064a',
    reason: null,
  });
  const second = await official.post('/v1/admin/team/add', { team: 'lobsters', reason: null });
  await official.post('/v1/admin/announcement', { text: 'Lunch at noon', reason: 'so that all come' });
  const played = await playing(official.url, 'x', second['token'] as string);
  await played.stop();
  const going = await playing(official.url, 'x', first['token'] as string);
  await fetch(`${official.url}/v1/hands`, {
    method: 'POST',
    headers: { Authorization: `Bearer ${String(second['token'])}` },
    body: claw(),
  });
  return () => going.stop();
}

test('tabs of the organizers’ page', async ({ page, official }) => {
  const done = await furnish(official);
  const wrong = complaints(page);
  await page.goto(`${official.url}/admin`);
  await look(page, 'admin-login');
  await page.getByLabel('Token').fill(official.organizer);
  await page.getByRole('button', { name: 'Log in' }).click();
  const tabs = page.getByRole('tab');
  await expect(tabs).toHaveCount(8);
  for (const tab of await tabs.all()) {
    const name = (await tab.innerText()).toLowerCase();
    await tab.click();
    await page.waitForLoadState('networkidle');
    if (name === 'verification') await page.getByLabel('all runs').check();
    if (name === 'hands') {
      await page.getByRole('button', { name: 'Details' }).first().click();
      await page.getByRole('img', { name: /turned$/ }).waitFor();
    }
    await look(page, `admin-${name}`);
  }
  await tabs.first().click();
  await page.getByRole('button', { name: 'Add time…' }).first().click();
  await look(page, 'admin-asks');
  await done();
  expect(wrong).toEqual([]);
});
