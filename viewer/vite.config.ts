/** Bundles each page of src/pages into dist/, with a manifest of the hashed file names for the server. */
import { type Plugin, defineConfig } from 'vite';
import { readFileSync, readdirSync, writeFileSync } from 'node:fs';
import { brotliCompressSync, gzipSync } from 'node:zlib';

const pages = readdirSync(new URL('./src/pages/', import.meta.url)).filter((name) => name.endsWith('.ts'));

/** Adds compressed copies of scripts, style sheets and drawings, which the server sends. It reads the written files. */
const compressed: Plugin = {
  name: 'compressed',
  writeBundle({ dir = 'dist/bundle' }, bundle) {
    for (const name of Object.keys(bundle).filter((file) => /\.(js|css|svg)$/.test(file))) {
      const text = readFileSync(`${dir}/${name}`);
      writeFileSync(`${dir}/${name}.gz`, gzipSync(text, { level: 9 }));
      writeFileSync(`${dir}/${name}.br`, brotliCompressSync(text));
    }
  },
};

export default defineConfig({
  base: '/',
  plugins: [compressed],
  build: {
    // The folder dist itself always exists: compiling the server needs it.
    outDir: 'dist/bundle',
    emptyOutDir: true,
    manifest: 'manifest.json',
    assetsInlineLimit: 0,
    modulePreload: { polyfill: false },
    rollupOptions: { input: Object.fromEntries(pages.map((name) => [name.slice(0, -3), `src/pages/${name}`])) },
  },
});
