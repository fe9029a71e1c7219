/** Runs to their last tick: the list of replays, goals, the final score; the plain picture on every page. */
import { expect, type Page } from '@playwright/test';
import { Example } from './client';
import { barriers, complaints, sideways } from './looks';
import { test } from './server';

test.setTimeout(240_000);

const detail = (page: Page): Promise<number> => page.evaluate(() => (window.palmares as { stage: { detail: number } }).stage.detail);

test('the list leads to a replay, which ends with the last goal and the score of the result', async ({ page, server }) => {
  const { run_id: run, score } = await Example.start('peg_softhand.py', server.url, '--seed', '1', '--team', 'pegs').played;
  const wrong = complaints(page);
  await page.goto(`${server.url}/replay`);
  expect(await barriers(page)).toEqual([]);
  await page.getByRole('link', { name: new RegExp(run) }).click();
  await expect(page).toHaveURL(new RegExp(`/replay/${run}$`));
  await page.waitForFunction(() => window.palmares?.['player'] !== undefined);
  const stored = (await (await fetch(`${server.url}/v1/runs/${run}`)).json()) as { in_goal: number; events: { tick: number }[] };
  expect(stored.in_goal).toBeGreaterThan(2);
  await expect(page.getByText(`${stored.in_goal} of 4 goals`)).toBeVisible();
  await page.keyboard.press('End');
  await expect(page.locator('.hud.top-left')).toContainText(`pegs, ${score.toFixed(1)} points`);
  // Every goal of the result is in the list, also one that is reached while the world settles.
  await expect(page.getByRole('listitem').filter({ hasText: /reached goal \d of 4/ })).toHaveCount(stored.in_goal);
  const end = await page.evaluate(() => (window.palmares as { recording: { duration: number } }).recording.duration);
  expect(end + 1e-9).toBeGreaterThanOrEqual((stored.events.at(-1)?.tick ?? 0) * 0.01);
  expect(wrong).toEqual([]);
});

test('a software renderer gets a plainer picture, and a person the plainest on every page', async ({ page, server }) => {
  await page.goto(`${server.url}/hands/softhand`);
  await page.getByRole('slider').first().waitFor();
  expect(await detail(page)).toBeGreaterThan(0);
  await page.goto(`${server.url}/drive`);
  await page.getByLabel('Plain picture, for slow machines').check();
  expect(await detail(page)).toBe(3);
  await page.reload();
  await expect(page.getByLabel('Plain picture, for slow machines')).toBeChecked();
  expect(await detail(page)).toBe(3);
  const [drawn, wide] = await page.evaluate(() => [
    document.querySelector('canvas')?.width ?? 0,
    document.querySelector('canvas')?.clientWidth ?? 0,
  ]);
  expect(drawn).toBe(Math.floor(wide / 2));
  await page.getByLabel('Plain picture, for slow machines').uncheck();
  expect(await detail(page)).toBeLessThan(4);
});

test('an unknown address has a page with links', async ({ page, server }) => {
  expect((await page.goto(`${server.url}/scores`))?.status()).toBe(404);
  await expect(page.getByRole('heading', { name: 'No page here' })).toBeVisible();
  for (const width of [1280, 390]) {
    await page.setViewportSize({ width, height: 800 });
    expect(await sideways(page)).toBe(0);
  }
  expect(await barriers(page)).toEqual([]);
  await page.getByRole('main').getByRole('link', { name: 'Live' }).click();
  await expect(page).toHaveURL(`${server.url}/live`);
});
