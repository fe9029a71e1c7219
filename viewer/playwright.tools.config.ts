/** Measures the pages and takes screenshots for the docs: `npm run tools -- measure`, `npm run tools -- pictures`. */
import { defineConfig } from '@playwright/test';
import tests from './playwright.config';

export default defineConfig({ ...tests, testDir: 'tools', timeout: 600_000 });
