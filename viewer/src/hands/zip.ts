/** Packs files into a ZIP archive without compression, for a hand that is uploaded as single files. */

export interface Entry {
  name: string;
  bytes: Uint8Array;
}

const TABLE = Uint32Array.from({ length: 256 }, (_, n) => {
  let c = n;
  for (let k = 0; k < 8; k += 1) c = c & 1 ? 0xedb88320 ^ (c >>> 1) : c >>> 1;
  return c >>> 0;
});

/** CRC-32 as in ISO 3309. */
export function crc32(bytes: Uint8Array): number {
  let c = 0xffffffff;
  for (const byte of bytes) c = (TABLE[(c ^ byte) & 0xff] ?? 0) ^ (c >>> 8);
  return (c ^ 0xffffffff) >>> 0;
}

/** Little-endian fields, each as [value, bytes]. */
function fields(...all: [number, 2 | 4][]): Uint8Array {
  const view = new DataView(new ArrayBuffer(all.reduce((sum, [, size]) => sum + size, 0)));
  let at = 0;
  for (const [value, size] of all) {
    if (size === 2) view.setUint16(at, value, true);
    else view.setUint32(at, value, true);
    at += size;
  }
  return new Uint8Array(view.buffer);
}

/** 1 January 1980, the first date in ZIP; and the flag for UTF-8 names. */
const [DAY, UTF8] = [0x21, 0x800];

/** The archive. */
export function zip(entries: readonly Entry[]): Uint8Array<ArrayBuffer> {
  const parts: Uint8Array[] = [];
  const directory: Uint8Array[] = [];
  let at = 0;
  const add = (...more: Uint8Array[]): void => {
    for (const part of more) {
      parts.push(part);
      at += part.length;
    }
  };
  for (const { name, bytes } of entries) {
    const title = new TextEncoder().encode(name);
    const about: [number, 2 | 4][] = [
      [20, 2],
      [UTF8, 2],
      [0, 2],
      [0, 2],
      [DAY, 2],
      [crc32(bytes), 4],
      [bytes.length, 4],
      [bytes.length, 4],
      [title.length, 2],
      [0, 2],
    ];
    directory.push(fields([0x02014b50, 4], [20, 2], ...about, [0, 2], [0, 2], [0, 2], [0, 4], [at, 4]), title);
    add(fields([0x04034b50, 4], ...about), title, bytes);
  }
  const begin = at;
  add(...directory);
  add(fields([0x06054b50, 4], [0, 2], [0, 2], [entries.length, 2], [entries.length, 2], [at - begin, 4], [begin, 4], [0, 2]));
  const whole = new Uint8Array(at);
  let to = 0;
  for (const part of parts) {
    whole.set(part, to);
    to += part.length;
  }
  return whole;
}

/** The archive path of a file chosen without its folder: the path of the mesh with that name in the URDF. */
export function pathOf(file: string, urdf: string): string {
  for (const [, said] of urdf.matchAll(/filename\s*=\s*["']([^"']+)["']/g)) {
    const path = (said ?? '').replace(/^package:\/\/[^/]+\//, '').replace(/^\.\//, '');
    if (path === file || path.endsWith(`/${file}`)) return path;
  }
  return file;
}
