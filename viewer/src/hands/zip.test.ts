import { execFileSync } from 'node:child_process';
import { mkdtempSync, rmSync, writeFileSync } from 'node:fs';
import { tmpdir } from 'node:os';
import { join } from 'node:path';
import { expect, it } from 'vitest';
import { crc32, pathOf, zip } from './zip';

const bytes = (text: string): Uint8Array => new TextEncoder().encode(text);

it('sums are those of the standard', () => expect(crc32(bytes('123456789'))).toBe(0xcbf43926));

it('another program reads the archive', ({ skip }) => {
  const folder = mkdtempSync(join(tmpdir(), 'zip-'));
  try {
    const file = join(folder, 'hand.zip');
    writeFileSync(
      file,
      zip([
        { name: 'hand.urdf', bytes: bytes('<robot/>') },
        { name: 'meshes/fingertip-é.stl', bytes: new Uint8Array(3000).fill(7) },
      ]),
    );
    const program =
      'import sys, zipfile; z = zipfile.ZipFile(sys.argv[1]); assert z.testzip() is None; print([(i.filename, i.file_size) for i in z.infolist()])';
    let listed: string;
    try {
      listed = execFileSync('python3', ['-X', 'utf8', '-c', program, file], { encoding: 'utf8' });
    } catch (error) {
      if ((error as NodeJS.ErrnoException).code === 'ENOENT') return skip('no python3 here');
      throw error;
    }
    expect(listed.trim()).toBe("[('hand.urdf', 8), ('meshes/fingertip-é.stl', 3000)]");
  } finally {
    rmSync(folder, { recursive: true });
  }
});

it('a mesh goes where the URDF looks for it', () => {
  const urdf = '<mesh filename="package://my_hand/meshes/tip.stl"/><mesh filename="palm.stl"/>';
  expect(pathOf('tip.stl', urdf)).toBe('meshes/tip.stl');
  expect(pathOf('palm.stl', urdf)).toBe('palm.stl');
  expect(pathOf('hand.toml', urdf)).toBe('hand.toml');
});
