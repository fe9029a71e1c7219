/** The leaderboard and the wall with sixty teams whose names have the maximum length. */
import { expect, type Page } from '@playwright/test';
import { APPLE, Control, grasp } from './control';
import { complaints, screen, sideways } from './looks';
import { CROWD, test } from './server';

/** Sizes of the ranking's rows and names, px. */
const rows = (page: Page): Promise<{ height: number; name: number; beyond: boolean; size: number }[]> => page.evaluate(() =>
  [...document.querySelectorAll('main table tbody tr')].map((row) => {
    const name = row.querySelector('th[scope=row], th') ?? row;
    const seen = row.getBoundingClientRect();
    return { height: seen.height, name: name.getBoundingClientRect().width, beyond: seen.right > document.documentElement.clientWidth + 1, size: parseFloat(getComputedStyle(name).fontSize) };
  }));

for (const javaScriptEnabled of [true, false]) {
  test(`sixty teams are readable on a phone ${javaScriptEnabled ? 'with scripts' : 'without scripts'}`, async ({ browser, crowded }) => {
    const page = await (await browser.newContext({ viewport: { width: 390, height: 844 }, javaScriptEnabled })).newPage();
    await page.goto(`${crowded.url}/`);
    await expect(page.locator('main table tbody tr')).toHaveCount(CROWD);
    if (javaScriptEnabled) await expect(page.getByText('60 teams. Live.')).toBeVisible();
    const seen = javaScriptEnabled ? await rows(page) : [];
    expect(await page.locator('main table tbody tr th').first().evaluate((name) => name.textContent.length)).toBeGreaterThanOrEqual(64);
    if (javaScriptEnabled) {
      expect(Math.min(...seen.map((row) => row.name))).toBeGreaterThan(100);
      expect(seen.filter((row) => row.beyond)).toEqual([]);
      expect(await sideways(page)).toBe(0);
      // The figures are below the name.
      expect(await page.locator('main table tbody tr').first().evaluate((row) => getComputedStyle(row).display)).toBe('grid');
    } else {
      const first = await page.locator('main table tbody tr th').first().boundingBox();
      expect(first?.width).toBeGreaterThan(100);
      expect((first?.x ?? 0) + (first?.width ?? 999)).toBeLessThanOrEqual(390);
    }
    // Markup in a name stays text.
    await expect(page.getByText('<img src=x onerror=alert(1)>').first()).toBeVisible();
    expect(await page.locator('main table img').count()).toBe(0);
    await page.screenshot({ path: screen(`sixty-390-${javaScriptEnabled ? 'scripts' : 'plain'}`) });
    await page.context().close();
  });
}

test('a new score updates ranking and wall at once, marks who moved, and links to its replay', async ({ browser, crowded }) => {
  const context = await browser.newContext({ viewport: { width: 1280, height: 800 } });
  const board = await context.newPage();
  const wall = await context.newPage();
  const wrong = complaints(board, wall);
  let loads = 0;
  board.on('load', () => { loads += 1; });
  await wall.goto(`${crowded.url}/wall`);
  await board.goto(`${crowded.url}/`);
  await expect(board.getByText('60 teams. Live.')).toBeVisible();
  await expect(wall.locator('.ranking tbody tr')).toHaveCount(8);

  const team = await board.locator('table tbody tr th bdi').nth(30).innerText();
  const control = await Control.open(crowded.url);
  const run = await control.begin(team, 'grasp', { seed: APPLE });
  await grasp(control, 260);
  const stopped = Date.now();
  await control.ask('stop');
  const row = board.locator('table tbody tr', { has: board.getByText(team, { exact: true }) });
  await expect(row.locator('.total')).toHaveText('4.0');
  console.warn(`the ranking showed the score ${Date.now() - stopped} ms after the run was stopped`);
  control.end();
  await expect(row.locator('.rank')).toHaveText('1');
  await expect(row.locator('.move.up')).toContainText('▲30');
  await expect(row.locator('.move.up')).toContainText('up 30 places');
  await expect(board.locator('table .move.down').first()).toContainText('▼1');
  expect(loads).toBe(1);
  await expect(wall.locator('.ranking tbody tr').first()).toContainText(team);
  await expect(wall.locator('.ranking tbody tr').first().locator('.total')).toHaveText('4.0');
  await expect(row.getByRole('link')).toHaveAttribute('href', `/replay/${run}`);
  await board.bringToFront();
  await row.getByRole('link').click();
  await expect(board).toHaveURL(`${crowded.url}/replay/${run}`);
  await expect(board.getByRole('heading', { name: team })).toBeVisible();
  expect(wrong).toEqual([]);
  await context.close();
});

test('the wall shows its panes in turn, readable from 10 m', async ({ browser, crowded }) => {
  const page = await (await browser.newContext({ viewport: { width: 1920, height: 1080 } })).newPage();
  const wrong = complaints(page);
  await page.clock.install();
  await page.goto(`${crowded.url}/wall`);
  await expect(page.locator('.ranking tbody tr')).toHaveCount(8);
  // Text is at least a thirtieth of the height: 5 cm on a screen 1.5 m high.
  const sizes = await rows(page);
  expect(Math.min(...sizes.slice(0, 8).map((row) => row.size))).toBeGreaterThanOrEqual(1080 / 30);
  expect(sizes.slice(0, 8).some((row) => row.beyond)).toBe(false);
  const fits = await page.evaluate(() => {
    const pane = document.querySelector('.pane.ranking');
    return pane !== null && pane.scrollHeight <= pane.clientHeight + 1;
  });
  expect(fits).toBe(true);
  await expect(page.locator('.pane.ranking')).toHaveCSS('opacity', '1');
  await page.screenshot({ path: screen('wall-sixty-1920') });
  const first = page.getByText('1–8 of 60 teams');
  await expect(first).toBeVisible();
  await page.clock.runFor(10_000);
  await expect(page.getByText('9–16 of 60 teams')).toBeVisible();
  await page.clock.runFor(10_000);
  await expect(page.getByText('17–24 of 60 teams')).toBeVisible();
  // By keyboard: back, and paused.
  await page.keyboard.press('ArrowLeft');
  await expect(page.getByText('9–16 of 60 teams')).toBeVisible();
  await page.keyboard.press(' ');
  await page.clock.runFor(60_000);
  await expect(page.getByText('9–16 of 60 teams')).toBeVisible();
  expect(wrong).toEqual([]);
  await page.context().close();
});
