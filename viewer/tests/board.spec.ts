/** The leaderboard and the wall with sixty teams whose names have the maximum length. */
import { expect, type Page } from '@playwright/test';
import { APPLE, Control, grasp } from './control';
import { complaints, screen, sideways } from './looks';
import { CROWD, test } from './server';

/** Sizes of the ranking's rows and names, px. */
const rows = (page: Page): Promise<{ height: number; name: number; beyond: boolean; size: number }[]> =>
  page.evaluate(() =>
    [...document.querySelectorAll('main table tbody tr')].map((row) => {
      const name = row.querySelector('th[scope=row], th') ?? row;
      const seen = row.getBoundingClientRect();
      return {
        height: seen.height,
        name: name.getBoundingClientRect().width,
        beyond: seen.right > document.documentElement.clientWidth + 1,
        size: parseFloat(getComputedStyle(name).fontSize),
      };
    }),
  );

for (const javaScriptEnabled of [true, false]) {
  test(`sixty teams are readable on a phone ${javaScriptEnabled ? 'with scripts' : 'without scripts'}`, async ({ browser, crowded }) => {
    const page = await (await browser.newContext({ viewport: { width: 390, height: 844 }, javaScriptEnabled })).newPage();
    await page.goto(`${crowded.url}/`);
    await expect(page.locator('main table tbody tr')).toHaveCount(CROWD);
    if (javaScriptEnabled) await expect(page.getByText('60 teams. Live.')).toBeVisible();
    const seen = javaScriptEnabled ? await rows(page) : [];
    expect(
      await page
        .locator('main table tbody tr th')
        .first()
        .evaluate((name) => name.textContent.length),
    ).toBeGreaterThanOrEqual(64);
    if (javaScriptEnabled) {
      expect(Math.min(...seen.map((row) => row.name))).toBeGreaterThan(100);
      expect(seen.filter((row) => row.beyond)).toEqual([]);
      expect(await sideways(page)).toBe(0);
      // The figures are below the name.
      expect(
        await page
          .locator('main table tbody tr')
          .first()
          .evaluate((row) => getComputedStyle(row).display),
      ).toBe('grid');
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
  board.on('load', () => {
    loads += 1;
  });
  await wall.goto(`${crowded.url}/wall`);
  await board.goto(`${crowded.url}/`);
  await expect(board.getByText('60 teams. Live.')).toBeVisible();
  await expect(wall.locator('.ranking tbody tr')).toHaveCount(20);

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
  const replay = row.locator('td a');
  await expect(replay).toHaveAttribute('href', `/replay/${run}`);
  await board.bringToFront();
  await replay.click();
  await expect(board).toHaveURL(`${crowded.url}/replay/${run}`);
  await expect(board.getByRole('heading', { name: team })).toBeVisible();
  expect(wrong).toEqual([]);
  await context.close();
});

for (const [width, height] of [
  [1920, 1080],
  [1280, 720],
] as const) {
  for (const teams of [5, CROWD]) {
    test(`the wall fills ${width} × ${height} with ranking and picture for ${teams} teams, readable from the back of a hall`, async ({
      browser,
      crowded,
      few,
    }) => {
      const { url } = teams === CROWD ? crowded : few;
      const page = await (await browser.newContext({ viewport: { width, height } })).newPage();
      const wrong = complaints(page);
      await page.goto(`${url}/wall`);
      const table = page.locator('.ranking tbody tr');
      // Without a run the ranking has the width.
      await expect(table).toHaveCount(Math.min(teams, 20));
      const wide = await page.locator('.ranking').boundingBox();
      expect(wide?.width).toBeGreaterThan(0.99 * width);
      await page.screenshot({ path: screen(`wall-${teams}-${width}-alone`) });

      const team = await table.nth(1).locator('bdi').innerText();
      const control = await Control.open(url);
      await control.begin(team, 'grasp', { seed: APPLE });
      await grasp(control, 40);
      await expect(page.locator('.live .who')).toHaveText(team);
      await expect(table).toHaveCount(Math.min(teams, 10));
      const [ranking, picture] = [await page.locator('.ranking').boundingBox(), await page.locator('.live canvas').boundingBox()];
      if (ranking === null || picture === null) throw new Error('ranking and picture are shown together');
      expect(ranking.width).toBeGreaterThan(0.4 * width);
      expect(ranking.width + picture.width).toBeGreaterThan(0.98 * width);
      expect(picture.height).toBeGreaterThan(0.55 * height);
      const [first, last] = [await table.first().boundingBox(), await table.last().boundingBox()];
      expect((last?.y ?? 0) + (last?.height ?? 0) - (first?.y ?? 0)).toBeGreaterThan(0.75 * height);
      expect((last?.y ?? 0) + (last?.height ?? 0)).toBeLessThanOrEqual(height);
      // Text is at least a thirtieth of the height: 5 cm on a screen 1.5 m high.
      const sizes = await page.evaluate(() =>
        [...document.querySelectorAll('main :is(.ranking, .beside) *, .wall-head *')]
          .filter(
            (one) =>
              [...one.childNodes].some((node) => node.nodeType === Node.TEXT_NODE && node.textContent?.trim() !== '') &&
              !one.closest('.visually-hidden, [hidden], .stage'),
          )
          .map((one) => parseFloat(getComputedStyle(one).fontSize)),
      );
      expect(Math.min(...sizes)).toBeGreaterThanOrEqual(height / 30);
      expect((await rows(page)).filter((row) => row.beyond)).toEqual([]);
      await page.screenshot({ path: screen(`wall-${teams}-${width}`) });
      await control.ask('stop');
      control.end();
      expect(wrong).toEqual([]);
      await page.context().close();
    });
  }
}

test('the wall turns the pages of its ranking, unless it is held', async ({ browser, crowded }) => {
  const page = await (await browser.newContext({ viewport: { width: 1920, height: 1080 } })).newPage();
  await page.clock.install();
  await page.goto(`${crowded.url}/wall`);
  await expect(page.getByText(/^1–20 of 60 teams/)).toBeVisible();
  await page.clock.runFor(10_000);
  await expect(page.getByText(/^21–40 of 60 teams/)).toBeVisible();
  // By keyboard: back, and paused.
  await page.keyboard.press('ArrowLeft');
  await expect(page.getByText(/^1–20 of 60 teams/)).toBeVisible();
  await page.keyboard.press(' ');
  await page.clock.runFor(60_000);
  await expect(page.getByText(/^1–20 of 60 teams/)).toBeVisible();
  await page.context().close();
});

test('a team has a page with its place, its scores in time and its replays', async ({ browser, crowded }) => {
  const page = await (await browser.newContext({ viewport: { width: 1280, height: 800 } })).newPage();
  const wrong = complaints(page);
  const team = 'the <i>patient</i>/ones?';
  const runs: string[] = [];
  for (const ticks of [1, 60, 2]) {
    const control = await Control.open(crowded.url);
    runs.push(await control.begin(team, 'grasp', { seed: APPLE }));
    if (ticks > 10) await grasp(control, ticks);
    else await control.step(ticks);
    await control.ask('stop');
    control.end();
  }
  await page.goto(`${crowded.url}/`);
  await page.getByRole('rowheader', { name: team }).getByRole('link').click();
  await expect(page.getByRole('heading', { level: 1 })).toHaveText(team);
  await expect(page.getByText('3 runs')).toBeVisible();
  await expect(page.getByRole('group', { name: 'Scores of 3 runs of grasp; the best is 1.0' })).toBeVisible();
  await expect(page.locator('.scores circle.run')).toHaveCount(3);
  const best = page
    .getByRole('row', { name: /^grasp 1\.0/ })
    .first()
    .getByRole('link', { name: /Replay/ });
  await expect(best).toHaveAttribute('href', `/replay/${runs[1]}`);
  for (const run of runs) await expect(page.locator(`table a[href="/replay/${run}"]`).first()).toBeVisible();
  await page.goto(`${crowded.url}/teams/nobody`);
  await expect(page.getByRole('heading', { name: 'No finished run' })).toBeVisible();
  expect(wrong).toEqual([]);
  await page.context().close();
});
