/** A controller carries balls: the live page and the replay show it. */
import { expect, type Page } from '@playwright/test';
import { Example } from './client';
import { test } from './server';

interface Shown {
  stage: { placeOf(id: number): number[] | null; camera: { position: { clone(): Point } } };
  live: { info: { bodies: { id: number; kind: string }[]; regions: { role?: string; min: number[]; max: number[] }[] } | null };
}
interface Point {
  x: number;
  y: number;
  set(x: number, y: number, z: number): Point;
  project(camera: unknown): Point;
}

/** Number of balls whose screen position is inside the projected region with this role. */
const drawnIn = (page: Page, role: string): Promise<number> =>
  page.evaluate((wanted) => {
    const { stage, live } = window.palmares as unknown as Shown;
    const box = live.info?.regions.find((region) => region.role === wanted);
    if (!live.info || !box) return -1;
    const onScreen = (x: number, y: number, z: number): Point => stage.camera.position.clone().set(x, y, z).project(stage.camera);
    const corners = [0, 1, 2, 3, 4, 5, 6, 7].map((k) =>
      onScreen(...([0, 1, 2].map((axis) => ((k >> axis) & 1 ? box.max : box.min)[axis] ?? 0) as [number, number, number])),
    );
    const within = (at: number, of: (point: Point) => number): boolean =>
      at > Math.min(...corners.map(of)) && at < Math.max(...corners.map(of));
    return live.info.bodies.filter((body) => {
      const place = body.kind === 'object' ? stage.placeOf(body.id) : null;
      if (!place) return false;
      const { x, y } = onScreen(...(place as [number, number, number]));
      return within(x, (point) => point.x) && within(y, (point) => point.y);
    }).length;
  }, role);

test('balls move from box to box on the screen, and an event of the replay opens its moment', async ({ page, server }) => {
  const example = Example.start('balls_softhand.py', server.url, '--seed', '1', '--team', 'carriers');
  const atFirst = async (): Promise<void> => {
    await page.goto(`${server.url}/live/featured`);
    await page.getByRole('button', { name: 'Top' }).click();
    await expect.poll(() => drawnIn(page, 'start'), { timeout: 20_000 }).toBe(10);
  };
  await example.slowedUntil(atFirst());
  expect(await drawnIn(page, 'goal')).toBe(0);
  await expect.poll(() => drawnIn(page, 'goal'), { timeout: 60_000 }).toBeGreaterThan(1);
  await expect(page.getByText('is in the goal').first()).toBeVisible();
  // The page explains why the chosen ball counts or not.
  await page.getByLabel('Highlight').selectOption({ index: 1 });
  await expect(page.getByText(/^ball.*counts|^ball.*does not count/)).toBeVisible();

  const { run_id: run, score } = await example.played;
  expect(score).toBeGreaterThan(5);
  await page.goto(`${server.url}/replay/${run}`);
  const event = page.getByRole('listitem').filter({ hasText: 'is in the goal' }).nth(3);
  await event.getByRole('button').click();
  const found = await page.evaluate(() => {
    const { stage, recording, time } = window.palmares as unknown as {
      stage: Shown['stage'];
      time(): number;
      recording: { events: { kind: string; time: number }[]; scene: { moving: number[] }; poses: { at(time: number): Float32Array } };
    };
    const wanted = recording.events.filter((one) => one.kind === 'in_goal')[3]?.time ?? NaN;
    const poses = recording.poses.at(wanted);
    const distances = recording.scene.moving.map((id, row) =>
      Math.hypot(...(stage.placeOf(id) ?? [9, 9, 9]).map((x, k) => x - (poses[7 * row + k] ?? 0))),
    );
    return { wanted, time: time(), distance: Math.max(...distances) };
  });
  expect(found.time).toBeCloseTo(found.wanted, 6);
  expect(found.distance).toBeLessThan(1e-6);
});
