/** Bundles every page of src/pages into dist/, with a manifest from which the server takes the hashed names. */
import { defineConfig } from 'vite';
import { readdirSync } from 'node:fs';

const pages = readdirSync(new URL('./src/pages/', import.meta.url)).filter((name) => name.endsWith('.ts'));

export default defineConfig({
  base: '/',
  build: {
    manifest: 'manifest.json',
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    rollupOptions: { input: Object.fromEntries(pages.map((name) => [name.slice(0, -3), `src/pages/${name}`])) },
  },
});
