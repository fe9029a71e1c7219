/** Tests of the pages in Chromium; they start their own servers (`PALMARES_SERVER_BIN`). */
import { defineConfig } from '@playwright/test';

export default defineConfig({
  testDir: 'tests',
  timeout: 90_000,
  // Two cores step a world, serve it and draw it: a second worker would make the tests of motion unreliable.
  workers: 1,
  reporter: [['list']],
  outputDir: '../target/viewer-tests',
  use: {
    // A missing element must not use up the time of the whole test.
    actionTimeout: 20_000,
    launchOptions: {
      executablePath: process.env['PALMARES_CHROMIUM'] ?? '/usr/bin/chromium',
      args: ['--no-sandbox', '--enable-unsafe-swiftshader'],
    },
  },
});
