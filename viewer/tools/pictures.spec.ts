/** Screenshots for README and docs, from the running program: `cargo xtask pages pictures`. Look at each before committing it. */
import { fileURLToPath } from 'node:url';
import type { Page } from '@playwright/test';
import { Example } from '../tests/client';
import { test } from '../tests/server';

/** `PALMARES_PICTURES` names another folder. */
const FOLDER = `${process.env['PALMARES_PICTURES'] ?? fileURLToPath(new URL('../../docs/pictures', import.meta.url))}/`;
const WIDE = { width: 1280, height: 800 };

test.use({ viewport: WIDE, colorScheme: 'light' });

/** Draws with every detail from now on, however long a frame takes. */
async function fine(page: Page): Promise<void> {
  await page.waitForFunction(() => window.palmares?.['stage'] !== undefined);
  await page.evaluate(() => {
    const { stage } = window.palmares as unknown as {
      stage: { control: { level: number; frame(): boolean }; applyDetail(): void };
    };
    stage.control.level = 0;
    stage.control.frame = () => false;
    stage.applyDetail();
  });
  // Its first frames.
  await page.waitForTimeout(3000);
}

/** Shows only the 3D view, from nearer: `near` is the share of the camera's distance. */
async function alone(page: Page, near: number): Promise<void> {
  await page.evaluate((share) => {
    const { stage } = window.palmares as unknown as {
      stage: {
        camera: { position: { lerp(to: unknown, share: number): void } };
        controls: { target: unknown; update(): void };
        lookAs(other: unknown): void;
      };
    };
    stage.camera.position.lerp(stage.controls.target, 1 - share);
    stage.controls.update();
    // The camera stays where it is now.
    stage.lookAs(stage);
    for (const card of document.querySelectorAll<HTMLElement>('.hud')) card.hidden = true;
  }, near);
  // Shadows and labels appear after a few frames.
  await page.waitForTimeout(2000);
}

/** Time of the n-th event of a kind, s. */
function timeOf(page: Page, kind: string, n: number): Promise<number> {
  return page.evaluate(
    ([wanted, place]) => {
      const { recording } = window.palmares as unknown as { recording: { events: { kind: string; time: number }[]; duration: number } };
      return recording.events.filter((event) => event.kind === wanted)[place]?.time ?? recording.duration / 2;
    },
    [kind, n] as const,
  );
}

test('the tasks, and a replay with its charts', async ({ page, server }) => {
  for (const [task, before, near] of [
    ['balls', 1.6, 0.75],
    ['shelf', 2.2, 1],
  ] as const) {
    const { run_id: run } = await Example.start(`${task}_softhand.py`, server.url, '--seed', '1', '--team', 'crabs').played;
    await page.goto(`${server.url}/replay/${run}`);
    await page.waitForFunction(() => window.palmares?.['recording'] !== undefined);
    const time = (await timeOf(page, 'in_goal', 2)) - before;
    if (task === 'balls') {
      await page.goto(`${server.url}/replay/${run}#t=${time}`);
      for (const label of ['Contact forces', 'Predicted equilibrium']) await page.getByLabel(label).check();
      await page.getByRole('button', { name: 'Palm', exact: true }).click();
      await fine(page);
      await page.screenshot({ path: `${FOLDER}replay.png` });
    }
    await page.setViewportSize({ width: WIDE.width, height: 1100 });
    await page.goto('about:blank');
    await page.goto(`${server.url}/replay/${run}#t=${time}`);
    await page.getByRole('button', { name: 'Whole', exact: true }).click();
    await fine(page);
    await alone(page, near);
    await page.locator('.stage canvas').screenshot({ path: `${FOLDER}${task}.png` });
    await page.setViewportSize(WIDE);
  }
});

test('a world as it is played', async ({ page, server }) => {
  const example = Example.start('balls_softhand.py', server.url, '--seed', '3', '--team', 'crabs');
  await page.goto(`${server.url}/live/featured`);
  for (const label of ['Contact forces', 'Names']) await page.getByLabel(label).check();
  await page.getByLabel('Highlight').selectOption({ index: 4 });
  await page.locator('.side').evaluate((side) => {
    side.scrollTop = 0;
  });
  await page.getByText('is in the goal').nth(1).waitFor();
  // Software rendering is behind the numbers: wait for it.
  example.hold();
  await fine(page);
  await page.screenshot({ path: `${FOLDER}live.png` });
  example.stop();
});

test('closing on an object, sensed against predicted', async ({ page, server }) => {
  const { run_id: run } = await Example.start('grasp_softhand.py', server.url, '--seed', '1', '--team', 'crabs').played;
  await page.goto(`${server.url}/replay/${run}`);
  await page.getByRole('button', { name: 'Closing: measured and predicted' }).click();
  await page.waitForTimeout(1000);
  await page.getByRole('dialog').screenshot({ path: `${FOLDER}closing.png` });
});

test('each hand, half closed, with its frames and names', async ({ page, server }) => {
  await page.setViewportSize({ width: WIDE.width, height: 1100 });
  for (const [hand, near] of [
    ['softhand', 0.8],
    ['reflex', 1.05],
    ['pinch', 1],
  ] as const) {
    await page.goto(`${server.url}/hands/${hand}`);
    await page.getByRole('button', { name: 'Half', exact: true }).click();
    for (const label of ['Names of links', 'Frames: base, palm']) await page.getByLabel(label).check();
    await fine(page);
    await alone(page, near);
    await page.locator('.stage').screenshot({ path: `${FOLDER}${hand}.png` });
  }
});
