import { describe, expect, it } from 'vitest';
import { PoseTable, compose } from './poses';

const half = Math.SQRT1_2;

describe('poses of a replay', () => {
  it('compose through parent frames', () => {
    // A quarter turn about z, and a step along the turned x.
    const pose = compose([1, 0, 0, 0, 0, half, half], [2, 0, 0, 0, 0, 0, 1]);
    [1, 2, 0, 0, 0, half, half].forEach((x, k) => expect(pose[k]).toBeCloseTo(x, 12));
    const table = new PoseTable(
      ['hand/base', 'hand/tip'],
      [
        {
          time: 0,
          transforms: [
            { parent: 'hand/base', child: 'hand/tip', pose: [2, 0, 0, 0, 0, 0, 1] },
            { parent: 'world', child: 'hand/base', pose: [1, 0, 0, 0, 0, half, half] },
          ],
        },
      ],
    );
    expect([...table.at(0).slice(7, 10)].map((x) => Math.round(1e6 * x) / 1e6)).toEqual([1, 2, 0]);
  });

  it('stay until a message changes them', () => {
    const at = (x: number) => [x, 0, 0, 0, 0, 0, 1];
    const table = new PoseTable(
      ['a', 'b'],
      [
        {
          time: 0,
          transforms: [
            { parent: 'world', child: 'a', pose: at(1) },
            { parent: 'world', child: 'b', pose: at(5) },
          ],
        },
        { time: 1, transforms: [{ parent: 'world', child: 'a', pose: at(2) }] },
      ],
    );
    expect(table.at(0.99)[0]).toBe(1);
    expect(table.at(1)[0]).toBe(2);
    expect(table.at(1)[7]).toBe(5);
    expect(table.at(99)[0]).toBe(2);
  });

  it('are interpolated between two messages, and constant in a gap', () => {
    const turned = (angle: number) => [angle, 0, 0, 0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];
    const message = (time: number, angle: number) => ({ time, transforms: [{ parent: 'world', child: 'a', pose: turned(angle) }] });
    const table = new PoseTable(['a'], [message(0, 0), message(0.04, 0.4), message(1, 0.6)]);
    expect(table.between(0.02)[0]).toBeCloseTo(0.2);
    expect(table.between(0.02)[5]).toBeCloseTo(Math.sin(0.1), 3);
    expect(table.between(0.5)[0]).toBeCloseTo(0.4);
    expect(table.between(0.95)[0]).toBeCloseTo(0.5);
    expect(table.between(7)[0]).toBeCloseTo(0.6);
  });

  it('rotate the short way, for either sign of the quaternion', () => {
    const table = new PoseTable(
      ['a'],
      [
        { time: 0, transforms: [{ parent: 'world', child: 'a', pose: [0, 0, 0, 0, 0, 0, 1] }] },
        { time: 0.04, transforms: [{ parent: 'world', child: 'a', pose: [0, 0, 0, 0, 0, 0, -1] }] },
      ],
    );
    expect([...table.between(0.02)].map(Math.abs)).toEqual([0, 0, 0, 0, 0, 0, 1]);
  });

  it('know their parents', () => {
    const table = new PoseTable(
      ['a', 'b'],
      [
        {
          time: 0,
          transforms: [
            { parent: 'world', child: 'a', pose: [] },
            { parent: 'a', child: 'b', pose: [] },
          ],
        },
      ],
    );
    expect(table.parents).toEqual([-1, 0]);
  });
});
