/** A team's own hand, for uploads. */
import { readFileSync } from 'node:fs';
import { zip } from '../src/hands/zip';

/** The pinch hand under another name, as a ZIP archive. */
export function claw(): Uint8Array<ArrayBuffer> {
  const file = (name: string): string => readFileSync(new URL(`../../models/hands/pinch/${name}`, import.meta.url), 'utf8');
  return zip(
    [
      ['hand.urdf', file('hand.urdf')],
      ['hand.toml', file('hand.toml').replace('name = "pinch"', 'name = "claw-1"')],
    ].map(([name, text]) => ({ name: name ?? '', bytes: new TextEncoder().encode(text) })),
  );
}
