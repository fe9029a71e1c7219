import { describe, expect, it } from 'vitest';
import { DETAILS, DetailControl } from './detail';

/** Draws at a frame rate for some seconds; returns the levels that were used. */
function draw(control: DetailControl, rate: (level: number) => number, seconds: number): number[] {
  const used = [control.index];
  for (let now = 0; now < 1000 * seconds; now += 1000 / rate(control.index)) {
    if (control.frame(now, true)) used.push(control.index);
  }
  return used;
}

describe('the detail of the 3D view', () => {
  it('is full where frames are fast, and plain where they are slow', () => {
    expect(draw(new DetailControl(0), () => 60, 60)).toEqual([0]);
    expect(draw(new DetailControl(0), () => 12, 60)).toEqual([0, 1, 2, 3]);
    // At a frame in five seconds every step counts.
    expect(draw(new DetailControl(0), (level) => [0.2, 1, 10, 18][level] ?? 0, 120)).toEqual([0, 2, 3]);
  });

  it('grows again where frames are fast, and tries a level that was too slow ever more rarely', () => {
    expect(draw(new DetailControl(2), () => 60, 60)).toEqual([2, 1, 0]);
    expect(draw(new DetailControl(2), (level) => (level < 1 ? 15 : 60), 30)).toEqual([2, 1, 0, 1]);
    const tries = (seconds: number): number =>
      draw(new DetailControl(2), (level) => (level < 1 ? 15 : 60), seconds).filter((level) => level === 0).length;
    expect([tries(60), tries(130), tries(260)]).toEqual([2, 3, 4]);
  });

  it('grows again after the machine was busy', () => {
    const control = new DetailControl(1);
    let busy = true;
    draw(control, () => (busy ? 10 : 60), 10);
    expect(control.index).toBe(3);
    busy = false;
    draw(control, () => 60, 60);
    expect(control.index).toBe(0);
  });

  it('ignores a view that stands still, and the first frame of a scene', () => {
    const control = new DetailControl(0);
    for (let now = 0; now < 60_000; now += 500) expect(control.frame(now, now % 1000 === 0)).toBe(false);
    for (let k = 0; k < 20; k += 1) {
      control.restart();
      control.frame(0, true);
      expect(control.frame(3000, true)).toBe(false);
    }
    expect(control.index).toBe(0);
  });

  it('is plain where a person wants it, and free again afterwards', () => {
    const control = new DetailControl(0);
    control.setPlain(true);
    expect(draw(control, () => 60, 30)).toEqual([DETAILS.length - 1]);
    control.setPlain(false);
    expect(control.index).toBe(0);
  });
});
