/** The documents: their pictures, links, contents and search, as a person uses them. */
import { expect } from '@playwright/test';
import { complaints } from './looks';
import { test } from './server';

test('a reader follows a link to a heading of another document, and sees its pictures', async ({ page, server }) => {
  const wrong = complaints(page);
  await page.goto(server.url);
  await page.getByRole('navigation', { name: 'Pages' }).getByRole('link', { name: 'Docs' }).click();
  await expect(page.getByRole('heading', { level: 1 })).toHaveText('Palmares');
  const pictures = await page.locator('.document img').all();
  expect(pictures.length).toBeGreaterThan(3);
  for (const picture of pictures) {
    await picture.scrollIntoViewIfNeeded();
    await expect.poll(() => picture.evaluate((image: HTMLImageElement) => image.naturalWidth)).toBeGreaterThan(0);
  }
  await page.locator('.document').getByRole('link', { name: 'table', exact: true }).click();
  await expect(page).toHaveURL(`${server.url}/docs/hands#built-in-hands`);
  await expect(page.locator('#built-in-hands')).toBeInViewport();
  // The contents beside the text.
  const list = page.getByRole('navigation', { name: 'Documents' });
  await expect(list.locator('[aria-current=page]')).toHaveText('A hand of your own');
  const last = list.locator('.contents a').last();
  await last.click();
  await expect(page.locator(new URL(page.url()).hash)).toBeInViewport();
  expect(wrong).toEqual([]);
});

test('the search finds a section while its words are typed, and without scripts', async ({ page, server, browser }) => {
  const wrong = complaints(page);
  await page.goto(`${server.url}/docs/teams`);
  await page.getByRole('searchbox').pressSequentially('chain signature');
  const first = page.locator('.hits a').first();
  await expect(first).toHaveText('Replays – Chain and signature');
  await expect(page).toHaveURL(/\/docs\/search\?q=chain%20signature$/);
  await first.click();
  await expect(page).toHaveURL(`${server.url}/docs/replays#chain-and-signature`);
  expect(wrong).toEqual([]);

  const plain = await browser.newContext({ javaScriptEnabled: false });
  const other = await plain.newPage();
  await other.goto(`${server.url}/docs`);
  const ask = async (words: string): Promise<void> => {
    await other.getByRole('searchbox').fill(words);
    await other.getByRole('button', { name: 'Search' }).click();
  };
  await ask('capstan <zyzzyva>');
  await expect(other.getByRole('status')).toContainText('No section has all of these words.');
  await expect(other.locator('.hits mark').first()).toHaveText(/capstan/i);
  await ask('zyzzyva');
  await expect(other.getByRole('status')).toContainText('No section has any of these words.');
  await expect(other.locator('#results').getByRole('link', { name: 'Writing a controller' })).toBeVisible();
  await ask('jupiter');
  await expect(other.getByRole('status')).toContainText('Did you mean jupyter?');
  await expect(other.locator('.hits a').first()).toHaveText('The engine in your process – Notebooks');
  await other.getByRole('status').getByRole('link', { name: 'jupyter' }).click();
  await expect(other.getByRole('status')).not.toContainText('Did you mean');
  await ask('capstan');
  await expect(other.locator('.hits mark').first()).toHaveText(/capstan/i);
  await plain.close();
});

for (const width of [1280, 390]) {
  test(`no code of the documents is cut at ${width} px`, async ({ browser, server }) => {
    const page = await (await browser.newContext({ viewport: { width, height: 800 } })).newPage();
    let blocks = 0;
    for (const name of ['protocol', 'teams', 'replays', 'organizers', 'architecture']) {
      await page.goto(`${server.url}/docs/${name}`);
      const code = await page.locator('.document pre').evaluateAll((all) =>
        all.map((one) => ({
          beyond: one.scrollWidth - one.clientWidth,
          drawing: one.classList.contains('drawing'),
          text: one.textContent.slice(0, 60),
        })),
      );
      // A drawing of lines scrolls.
      expect(code.filter(({ beyond, drawing }) => beyond > 0 && !drawing)).toEqual([]);
      blocks += code.length;
    }
    expect(blocks).toBeGreaterThan(30);
    await page.context().close();
  });
}
