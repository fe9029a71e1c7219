/** What measures the pages and takes their pictures: `npm run tools -- measure`, `npm run tools -- pictures`. */
import { defineConfig } from '@playwright/test';
import tests from './playwright.config';

export default defineConfig({ ...tests, testDir: 'tools', timeout: 600_000 });
