import { existsSync, readFileSync, readdirSync } from 'node:fs';
import { join } from 'node:path';
import { describe, expect, it } from 'vitest';
import { InvalidReplay, readRecording } from './recording';

/** The replay of `cargo xtask demo`, or the file in PALMARES_REPLAY. */
function demo(): string | null {
  const named = process.env['PALMARES_REPLAY'];
  if (named) return named;
  const folder = join(import.meta.dirname, '../../../target/demo');
  const file = existsSync(folder) ? readdirSync(folder).find((name) => name.endsWith('.mcap')) : undefined;
  return file ? join(folder, file) : null;
}

const file = demo();
if (file === null) console.warn('SKIPPED: no replay to read; `cargo xtask demo` records one, or PALMARES_REPLAY names one.');

describe('a file', () => {
  it('that is not MCAP is refused with a message', async () => {
    await expect(readRecording(new TextEncoder().encode('not a replay at all'))).rejects.toThrow(InvalidReplay);
    await expect(readRecording(new Uint8Array())).rejects.toThrow(/not a complete MCAP file/);
  });

  it.skipIf(file === null)('of a run is read', async () => {
    const progress: number[] = [];
    const recording = await readRecording(new Uint8Array(readFileSync(file ?? '')), (done) => progress.push(done));
    expect(recording.outcome?.ticks).toBe(recording.actions.length);
    expect(recording.duration).toBeGreaterThanOrEqual(recording.actions.length * recording.tickS - 0.05);
    expect(recording.scene.moving.length).toBeGreaterThan(5);
    expect(recording.poses.at(0).length).toBe(7 * recording.scene.moving.length);
    for (const time of [0, recording.duration / 2, recording.duration]) {
      const poses = recording.poses.at(time);
      for (let row = 0; row < poses.length; row += 7) expect(Math.hypot(...poses.subarray(row + 3, row + 7))).toBeCloseTo(1, 3);
    }
    expect(progress.every((done, k) => done <= 1 && done >= (progress[k - 1] ?? 0))).toBe(true);
    for (const event of recording.events) expect(event.time).toBeLessThanOrEqual(recording.duration + recording.tickS);
  });

  it.skipIf(file === null)('that is truncated is refused with a message', async () => {
    const bytes = new Uint8Array(readFileSync(file ?? ''));
    await expect(readRecording(bytes.subarray(0, bytes.length / 2))).rejects.toThrow(InvalidReplay);
  });
});
