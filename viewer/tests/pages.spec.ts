/** The live page, the leaderboard and the replay of one run. */
import { expect, type Page } from '@playwright/test';
import { complaints } from './looks';
import { drive, test } from './server';

interface Driven {
  driven: { stop: boolean; result: { run_id: string; score: number } | null };
}

/** Position of the hand's base on the live page, px. */
const handOnScreen = (page: Page): Promise<{ x: number; y: number }> =>
  page.evaluate(() => {
    const { stage, live } = window.palmares as {
      stage: { screenPosition(id: number): { x: number; y: number } };
      live: { info: { bodies: { id: number; kind: string }[] } };
    };
    return stage.screenPosition(live.info.bodies.find((body) => body.kind === 'hand')?.id ?? -1);
  });

test('a run is live, enters the ranking, and has a replay', async ({ browser, server }) => {
  const driver = await browser.newPage();
  await driver.goto(`${server.url}/`);
  const [board, live, replay] = [await browser.newPage(), await browser.newPage(), await browser.newPage()];
  const wrong = complaints(board, live, replay);
  await board.goto(`${server.url}/`);
  await expect(board.getByText('Live.')).toBeVisible();
  await expect(board.getByRole('rowheader', { name: 'crabs', exact: true })).toHaveCount(0);
  await driver.evaluate(drive, 'crabs');

  await live.bringToFront();
  await live.goto(`${server.url}/live`);
  await live.getByRole('link', { name: 'Watch crabs' }).click();
  await expect(live.getByRole('heading', { name: /crabs/ })).toBeVisible();
  await live.waitForFunction(() => ((window.palmares?.['live'] as { newest?: { tick: number } } | undefined)?.newest?.tick ?? 0) > 0);
  const before = await handOnScreen(live);
  await expect
    .poll(
      async () => {
        const now = await handOnScreen(live);
        return Math.hypot(now.x - before.x, now.y - before.y);
      },
      { timeout: 20_000 },
    )
    .toBeGreaterThan(10);
  await live.screenshot({ path: '../target/viewer-tests/live.png' });

  await driver.evaluate(() => {
    (window as unknown as Driven).driven.stop = true;
  });
  await driver.waitForFunction(() => (window as unknown as Driven).driven.result !== null);
  const stopped = Date.now();
  await expect(board.getByRole('rowheader', { name: 'crabs' })).toBeVisible();
  // The time is printed, not asserted.
  console.warn(`the ranking showed the run after ${Date.now() - stopped} ms`);
  const run = await driver.evaluate(() => (window as unknown as Driven).driven.result?.run_id ?? '');

  await replay.bringToFront();
  await replay.goto(`${server.url}/replay/${run}`);
  await expect(replay.getByRole('heading', { name: /crabs/ })).toBeVisible();
  const distance = await replay.evaluate(async () => {
    const { stage, recording, player } = window.palmares as {
      stage: { placeOf(id: number): number[] | null };
      recording: { scene: { moving: number[] }; duration: number; poses: { at(time: number): Float32Array } };
      player: { seek(time: number): void };
    };
    const time = recording.duration / 2;
    player.seek(time);
    const wanted = recording.poses.at(time);
    return Math.max(
      ...recording.scene.moving.map((id, row) =>
        Math.hypot(...(stage.placeOf(id) ?? [9, 9, 9]).map((x, k) => x - (wanted[7 * row + k] ?? 0))),
      ),
    );
  });
  expect(distance).toBeLessThan(1e-6);
  await replay.screenshot({ path: '../target/viewer-tests/replay.png' });
  expect(wrong).toEqual([]);
});

test('a file that is not a replay is refused', async ({ page, server }) => {
  await page.goto(`${server.url}/replay`);
  await page.setInputFiles('#file', { name: 'a.mcap', mimeType: 'application/octet-stream', buffer: Buffer.from('not a replay') });
  await expect(page.getByText('This is not a complete MCAP file')).toBeVisible();
});
