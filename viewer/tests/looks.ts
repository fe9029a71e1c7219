/** Checks for every page: no console errors, no requests to other servers, no accessibility problems. */
import { AxeBuilder } from '@axe-core/playwright';
import type { Page } from '@playwright/test';

/** Collects console errors of these pages from now on, and requests to other servers. */
export function complaints(...pages: Page[]): string[] {
  const heard: string[] = [];
  for (const page of pages) {
    page.on('pageerror', (error) => heard.push(error.message));
    page.on('console', (message) => {
      if (message.type() === 'error') heard.push(`${page.url()}: ${message.text()}`);
    });
    page.on('request', (request) => {
      const { protocol, origin } = new URL(request.url());
      if (protocol !== 'data:' && protocol !== 'blob:' && page.url() !== 'about:blank' && origin !== new URL(page.url()).origin)
        heard.push(`left the server: ${request.url()}`);
    });
  }
  return heard;
}

/** Serious and critical findings of axe. Legacy mode opens no extra page, which only frames would need. */
export async function barriers(page: Page): Promise<string[]> {
  const { violations } = await new AxeBuilder({ page })
    .setLegacyMode(true)
    .options({ preload: false, resultTypes: ['violations'] })
    .analyze();
  return violations
    .filter((one) => one.impact === 'serious' || one.impact === 'critical')
    .map((one) => `${one.id}: ${one.nodes[0]?.html} ${one.nodes[0]?.failureSummary ?? ''}`);
}

/** Horizontal overflow of the page, px. */
export const sideways = (page: Page): Promise<number> =>
  page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);

/** Path of a screenshot. */
export const screen = (name: string): string => `../target/viewer-tests/screens/${name}.png`;
