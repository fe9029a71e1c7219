/** Without WebGL a message replaces the 3D view, and the rest of each page works. */
import { expect } from '@playwright/test';
import { APPLE, Control, grasp, playing } from './control';
import { complaints } from './looks';
import { test } from './server';

const SENTENCE = 'This browser has no WebGL';

test('pages work without WebGL', async ({ page, server }) => {
  await page.addInitScript(() => {
    const real = HTMLCanvasElement.prototype.getContext;
    Object.assign(HTMLCanvasElement.prototype, {
      getContext(this: HTMLCanvasElement, kind: string, ...more: unknown[]) {
        return kind.startsWith('webgl') ? null : (Reflect.apply(real, this, [kind, ...more]) as unknown);
      },
    });
  });
  const control = await Control.open(server.url);
  const run = await control.begin('blind', 'grasp', { seed: APPLE });
  await grasp(control, 60);
  await control.ask('stop');
  control.end();
  const wrong = complaints(page);

  const going = await playing(server.url, 'blind');
  await page.goto(
    `${server.url}/live/${((await (await fetch(`${server.url}/v1/runs/${going.run}`)).json()) as { session_id: string }).session_id}`,
  );
  await expect(page.getByText(SENTENCE)).toHaveCount(1);
  await expect(page.getByText(SENTENCE)).toBeVisible();
  await expect(page.getByRole('heading', { name: /blind/ })).toBeVisible();
  const clock = page.locator('dt:text("Run") + dd').first();
  const first = await clock.innerText();
  await expect.poll(() => clock.innerText()).not.toBe(first);
  await page.getByLabel('Highlight').selectOption({ index: 1 });
  await expect(page.getByText(/counts:|does not count:/)).toBeVisible();

  await page.goto(`${server.url}/wall`);
  await expect(page.locator('.ranking tbody tr').first()).toBeVisible();
  await expect.poll(() => page.evaluate(() => (window.palmares as { live: { ready: boolean } }).live.ready)).toBe(true);
  await expect(page.locator('.live').getByText(SENTENCE)).toBeAttached();
  await going.stop();

  await page.goto(`${server.url}/replay/${run}`);
  await expect(page.getByText(SENTENCE)).toBeVisible();
  await expect(page.getByRole('heading', { name: /blind/ })).toBeVisible();
  await page.getByRole('button', { name: /Play/ }).first().click();
  await expect.poll(() => page.evaluate(() => (window.palmares as { time(): number }).time())).toBeGreaterThan(0.1);

  await page.goto(`${server.url}/drive`);
  await expect(page.getByText(SENTENCE)).toBeVisible();
  await page.getByLabel('Name on the leaderboard').fill('blind');
  await page.getByRole('button', { name: 'Start', exact: true }).click();
  await expect
    .poll(() => page.evaluate(() => (window.palmares as unknown as { drive: { driver: { tick: number } } }).drive.driver.tick))
    .toBeGreaterThan(10);
  expect(wrong).toEqual([]);
});
