/** Everything is reachable by keyboard, with a visible focus. */
import { expect, type Page } from '@playwright/test';
import { playing } from './control';
import { test } from './server';

interface Found {
  all: string[];
  missed: string[];
  unseen: string[];
}

/** Tabs once around the page. `unseen`: focused elements without an outline, or outside the window. */
async function around(page: Page): Promise<Found> {
  await page.evaluate(() => {
    const all = [...document.querySelectorAll<HTMLElement>('a[href], button, input, select, textarea, summary, [tabindex]')].filter(
      (one) =>
        one.checkVisibility({ visibilityProperty: true }) &&
        one.getBoundingClientRect().width > 0 &&
        !one.matches(':disabled') &&
        one.tabIndex >= 0 &&
        one.closest('[inert]') === null,
    );
    Object.assign(window, { around: { all, seen: new Set<Element>(), unseen: [] as string[] } });
    (document.activeElement as HTMLElement | null)?.blur();
    document.body.tabIndex = -1;
    document.body.focus();
    document.body.removeAttribute('tabindex');
  });
  for (let k = 0; k < 150; k += 1) {
    await page.keyboard.press('Tab');
    const over = await page.evaluate(() => {
      const { seen, unseen } = (window as unknown as { around: { seen: Set<Element>; unseen: string[] } }).around;
      const at = document.activeElement;
      if (at === null || at === document.body || seen.has(at)) return true;
      seen.add(at);
      const [style, box] = [getComputedStyle(at), at.getBoundingClientRect()];
      const outlined = style.outlineStyle !== 'none' && parseFloat(style.outlineWidth) >= 2;
      if (!outlined || box.bottom < 0 || box.top > innerHeight || box.right < 0 || box.left > innerWidth)
        unseen.push(at.outerHTML.slice(0, 120));
      return false;
    });
    if (over) break;
  }
  return page.evaluate(() => {
    const { all, seen, unseen } = (window as unknown as { around: { all: Element[]; seen: Set<Element>; unseen: string[] } }).around;
    const words = (one: Element): string => one.outerHTML.slice(0, 120);
    return {
      all: all.map(words),
      missed: all.filter((one) => one.isConnected && !one.matches(':disabled') && !seen.has(one)).map(words),
      unseen,
    };
  });
}

test('the live page works without a pointer', async ({ page, server }) => {
  const going = await playing(server.url, 'keys');
  await page.goto(`${server.url}/live/featured`);
  await page.waitForFunction(() => ((window.palmares?.['live'] as { newest?: { tick: number } } | undefined)?.newest?.tick ?? 0) > 0);
  const { all, missed, unseen } = await around(page);
  expect(all.length).toBeGreaterThan(15);
  expect(missed).toEqual([]);
  expect(unseen).toEqual([]);
  // Turn the camera, highlight an object, switch an overlay.
  const camera = (): Promise<number[]> =>
    page.evaluate(() => (window.palmares as { stage: { camera: { position: { toArray(): number[] } } } }).stage.camera.position.toArray());
  const before = await camera();
  await page.locator('.stage canvas').focus();
  await page.keyboard.press('ArrowLeft');
  await expect.poll(camera).not.toEqual(before);
  await page.getByLabel('Highlight').focus();
  await page.keyboard.press('ArrowDown');
  await expect(page.getByLabel('Highlight')).not.toHaveValue('');
  await page.getByLabel('Names').focus();
  await page.keyboard.press('Space');
  await expect(page.locator('.stage-label').first()).toBeAttached();
  await going.stop();
});

test('the organizers’ page works without a pointer', async ({ page, official }) => {
  const { token } = await official.post('/v1/admin/team/add', { team: 'keyboarders', reason: null });
  const { phase } = await official.get('/v1/competition');
  if (phase === 'closed') await official.post('/v1/admin/competition/open', { reason: 'keys' });
  const going = await playing(official.url, 'x', token as string);
  await page.goto(`${official.url}/admin`);
  await expect(page.getByLabel('Token')).toBeFocused();
  await page.keyboard.type(official.organizer);
  await page.keyboard.press('Enter');
  await page.getByRole('tab', { selected: true }).focus();
  for (let k = 0; k < 8; k += 1) {
    await page.waitForLoadState('networkidle');
    const { missed, unseen } = await around(page);
    expect.soft([k, missed, unseen]).toEqual([k, [], []]);
    await page.getByRole('tab', { selected: true }).focus();
    await page.keyboard.press('ArrowRight');
    await expect(page.getByRole('tab', { selected: true })).toBeFocused();
  }
  await expect(page.getByRole('tab', { name: 'Sessions' })).toBeFocused();
  // A dialog is opened, cancelled and confirmed by keys; the focus returns to its button.
  const pause = page.getByRole('row').filter({ hasText: 'keyboarders' }).getByRole('button', { name: 'Pause…' });
  await pause.focus();
  await page.keyboard.press('Enter');
  await expect(page.getByRole('dialog').getByLabel('Reason')).toBeFocused();
  await page.keyboard.press('Escape');
  await expect(pause).toBeFocused();
  await page.keyboard.press('Enter');
  await page.keyboard.type('a cable came off');
  await page.keyboard.press('Enter');
  await expect(page.getByRole('row').filter({ hasText: 'keyboarders' }).getByText('paused')).toBeVisible();
  await expect(page.getByRole('row').filter({ hasText: 'keyboarders' }).getByRole('button', { name: 'Resume…' })).toBeFocused();
  going.control.end();
});
