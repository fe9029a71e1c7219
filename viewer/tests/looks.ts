/** What is asked of every page: it says nothing on the console, asks nobody else, and reads well. */
import { AxeBuilder } from '@axe-core/playwright';
import type { Page } from '@playwright/test';

/** All that these pages complain of from now on, and every request of theirs that leaves the server. */
export function complaints(...pages: Page[]): string[] {
  const heard: string[] = [];
  for (const page of pages) {
    page.on('pageerror', (error) => { heard.push(error.message); });
    page.on('console', (message) => { if (message.type() === 'error') heard.push(`${page.url()}: ${message.text()}`); });
    page.on('request', (request) => {
      const { protocol, origin } = new URL(request.url());
      if (protocol !== 'data:' && protocol !== 'blob:' && page.url() !== 'about:blank' && origin !== new URL(page.url()).origin) heard.push(`left the server: ${request.url()}`);
    });
  }
  return heard;
}

/** What axe calls serious or critical. Legacy mode: it opens no page of its own for its sum, for there are no frames here. */
export async function barriers(page: Page): Promise<string[]> {
  const { violations } = await new AxeBuilder({ page }).setLegacyMode(true).options({ preload: false, resultTypes: ['violations'] }).analyze();
  return violations.filter((one) => one.impact === 'serious' || one.impact === 'critical').map((one) => `${one.id}: ${one.nodes[0]?.html} ${one.nodes[0]?.failureSummary ?? ''}`);
}

/** By how much the page can be moved sideways, px. */
export const sideways = (page: Page): Promise<number> => page.evaluate(() => document.documentElement.scrollWidth - document.documentElement.clientWidth);

/** Where a screenshot is kept. */
export const screen = (name: string): string => `../target/viewer-tests/screens/${name}.png`;
