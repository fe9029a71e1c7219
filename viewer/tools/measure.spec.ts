/**
 * The cost of the pages, printed as tables: bytes of a first load, script and draw calls of a frame with everything switched
 * on, frames a second of a live page as it opens, bytes a second of a viewer, and the time from a driver's input to the
 * frame that shows it. Nothing is asserted.
 */
import { spawn } from 'node:child_process';
import { type Page } from '@playwright/test';
import { Example } from '../tests/client';
import { test } from '../tests/server';

interface Measured {
  stage: {
    stats(): { drawCalls: number; triangles: number; scriptMs: number };
    detail: number;
    setOverlay(name: string, on: boolean): void;
    onFrame(f: () => void): void;
    renderer: { render(...given: unknown[]): void };
  };
  live: { socket: { received: number }; newest: { tick: number } | null };
}

const OVERLAYS = ['ghost', 'tension', 'contacts', 'regions', 'frames', 'names', 'com'];

/** The value at a quantile. */
function quantile(sorted: readonly number[], share: number): number {
  return sorted[Math.min(Math.floor(share * sorted.length), sorted.length - 1)] ?? NaN;
}

test('first load', async ({ browser, server }) => {
  console.warn('| page | requests | bytes |\n|---|---|---|');
  for (const path of ['/', '/live', '/live/featured', '/replay', '/drive', '/hands', '/hands/softhand', '/wall', '/admin']) {
    const context = await browser.newContext();
    const page = await context.newPage();
    const session = await context.newCDPSession(page);
    await session.send('Network.enable');
    let [bytes, requests] = [0, 0];
    session.on('Network.loadingFinished', ({ encodedDataLength }) => {
      bytes += encodedDataLength;
      requests += 1;
    });
    await page.goto(`${server.url}${path}`);
    await page.waitForTimeout(1500);
    console.warn(`| ${path} | ${requests} | ${bytes} |`);
    await context.close();
  }
});

/** Shows all overlays and measures the script time of each frame for some seconds, ms, sorted; and the last draw calls. */
function frames(page: Page, seconds: number): Promise<{ script: number[]; drawCalls: number; triangles: number }> {
  return page.evaluate(
    async ([names, wait]) => {
      const { stage } = window.palmares as unknown as Measured;
      for (const name of names) stage.setOverlay(name, true);
      await new Promise((resolve) => setTimeout(resolve, 1500));
      const script: number[] = [];
      stage.onFrame(() => {
        script.push(stage.stats().scriptMs);
      });
      await new Promise((resolve) => setTimeout(resolve, 1000 * wait));
      return { script: script.sort((a, b) => a - b), ...stage.stats() };
    },
    [OVERLAYS, seconds] as const,
  );
}

test('a frame with everything switched on', async ({ browser, server }) => {
  const rows: string[] = [];
  for (const task of ['balls', 'shelf'])
    for (const drawn of [false, true]) {
      const example = Example.start(`${task}_softhand.py`, server.url, '--seed', '1');
      const page = await browser.newPage({ viewport: { width: 640, height: 400 } });
      // Without this, waiting for the software renderer would count as script.
      if (!drawn)
        await page.addInitScript(() => {
          const nothing = (): void => undefined;
          const context = WebGL2RenderingContext.prototype;
          for (const name of ['drawElements', 'drawArrays', 'drawElementsInstanced', 'drawArraysInstanced', 'clear'] as const)
            context[name] = nothing;
          const extension = context.getExtension.bind.bind(context.getExtension) as (
            self: WebGL2RenderingContext,
          ) => (name: string) => object | null;
          context.getExtension = function (this: WebGL2RenderingContext, name: string) {
            const found = extension(this)(name);
            return name === 'WEBGL_multi_draw' && found
              ? Object.assign(found, { multiDrawElementsWEBGL: nothing, multiDrawArraysWEBGL: nothing })
              : found;
          } as typeof context.getExtension;
        });
      await page.goto(`${server.url}/live/featured`);
      await page.waitForFunction(() => ((window.palmares as unknown as Measured | undefined)?.live.newest?.tick ?? 0) > 0);
      const received = (): Promise<number> => page.evaluate(() => (window.palmares as unknown as Measured).live.socket.received);
      const [begun, before] = [Date.now(), await received()];
      const { script, drawCalls, triangles } = await frames(page, 10);
      const bytes = (((await received()) - before) / (Date.now() - begun)) * 1000;
      const figures = [
        task,
        drawn ? 'by software' : 'not at all',
        script.length,
        quantile(script, 0.5).toFixed(2),
        quantile(script, 0.95).toFixed(2),
        drawCalls,
        triangles,
        Math.round(bytes),
      ];
      rows.push(`| ${figures.join(' | ')} |`);
      await page.close();
      await example.played;
    }
  console.warn(
    `| scene | drawn | frames | script, median, ms | script, 95 of 100, ms | draw calls | triangles | bytes a second |\n|---|---|---|---|---|---|---|---|\n${rows.join('\n')}`,
  );
});

test('frames a second of a live page, as it opens', async ({ browser, server }) => {
  const rows: string[] = [];
  for (const task of ['balls', 'shelf'])
    for (const [width, height] of [
      [640, 400],
      [1280, 800],
      [1920, 1080],
    ] as const) {
      const example = Example.start(`${task}_softhand.py`, server.url, '--seed', '1');
      const page = await browser.newPage({ viewport: { width, height } });
      await page.goto(`${server.url}/live/featured`);
      await page.waitForFunction(() => ((window.palmares as unknown as Measured | undefined)?.live.newest?.tick ?? 0) > 0);
      // The level of detail settles first.
      await page.waitForTimeout(3000);
      const [drawn, level] = await page.evaluate(async () => {
        const { stage } = window.palmares as unknown as Measured;
        const { renderer } = stage;
        const render = renderer.render.bind(renderer);
        let count = 0;
        renderer.render = (...given) => {
          count += 1;
          render(...given);
        };
        const begun = performance.now();
        await new Promise((resolve) => setTimeout(resolve, 10_000));
        return [(1000 * count) / (performance.now() - begun), stage.detail] as const;
      });
      rows.push(`| ${task} | ${width}x${height} | ${drawn.toFixed(1)} | ${level} |`);
      await page.close();
      await example.played;
    }
  console.warn(`| scene | window, px | frames a second | level of detail |\n|---|---|---|---|\n${rows.join('\n')}`);
});

test('from a driver’s input to the frame that shows it, with fifty viewers', async ({ page, server }) => {
  const program = process.env['PALMARES_VIEWERS'];
  await page.setViewportSize({ width: 640, height: 400 });
  await page.goto(`${server.url}/drive`);
  await page.getByRole('button', { name: 'Start', exact: true }).click();
  await page.waitForFunction(
    () => ((window.palmares as unknown as { drive?: { driver?: { tick: number } } } | undefined)?.drive?.driver?.tick ?? 0) > 10,
  );
  const crowd = program
    ? spawn(program, ['--url', server.url.replace('http', 'ws'), '--only-watch', '--viewers', '50'], { stdio: 'inherit' })
    : null;
  if (!crowd) console.warn('without viewers: PALMARES_VIEWERS does not name the example `viewers`');
  await page.waitForTimeout(2000);
  console.warn('| picture | inputs | median, ms | 95 of 100, ms |\n|---|---|---|---|');
  for (const drawn of [true, false]) {
    if (!drawn)
      await page.evaluate(() => {
        (window.palmares as unknown as Measured).stage.renderer.render = () => undefined;
      });
    await page.waitForTimeout(1000);
    await page.evaluate(() => {
      (window.palmares as unknown as { drive: { latencies: number[] } }).drive.latencies.length = 0;
    });
    for (let k = 0; k < 60; k += 1) {
      const key = k % 2 ? 'a' : 'd';
      await page.keyboard.down(key);
      await page.waitForTimeout(60);
      await page.keyboard.up(key);
      await page.waitForTimeout(90);
    }
    const latencies = await page.evaluate(() =>
      (window.palmares as unknown as { drive: { latencies: number[] } }).drive.latencies.slice().sort((a, b) => a - b),
    );
    console.warn(
      `| ${drawn ? 'drawn by software' : 'handed over, not drawn'} | ${latencies.length} | ${quantile(latencies, 0.5).toFixed(1)} | ${quantile(latencies, 0.95).toFixed(1)} |`,
    );
  }
  crowd?.kill();
});
