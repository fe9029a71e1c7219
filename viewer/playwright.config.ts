/** Tests of the pages in Chromium; they start their own servers (`PALMARES_SERVER_BIN`). */
import { defineConfig } from '@playwright/test';

export default defineConfig({
  testDir: 'tests',
  timeout: 90_000,
  // A single worker uses little more than one of two cores; each worker has its own servers.
  workers: 2,
  reporter: [['list']],
  outputDir: '../target/viewer-tests',
  use: {
    // A missing element must not use up the time of the whole test.
    actionTimeout: 20_000,
    launchOptions: {
      executablePath: process.env['PALMARES_CHROMIUM'] ?? '/usr/bin/chromium',
      args: ['--no-sandbox', '--use-angle=swiftshader', '--enable-unsafe-swiftshader'],
    },
  },
});
