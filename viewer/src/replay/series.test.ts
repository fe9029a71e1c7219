import { describe, expect, it } from 'vitest';
import { record, recorded } from './fixture';
import { Series, placeAt, range, valueAt } from './series';

describe('lines of a run', () => {
  it('keep their value until the next, and have none before the first', () => {
    expect([0, 1, 1.5, 2, 9].map((time) => placeAt([1, 2, 3], time))).toEqual([-1, 0, 0, 1, 2]);
    const line = { label: '', unit: '', times: [1, 2], values: [5, 7] };
    expect([0.5, 1, 1.9, 2, 9].map((time) => valueAt(line, time))).toEqual([null, 5, 5, 7, 7]);
    expect(range(line)).toBe(2);
    expect(range({ ...line, values: [null] })).toBe(0);
  });

  it('are read from the telemetry, to the end of the run', () => {
    const series = new Series(
      recorded([
        record(0, { command: [1], position: [0], q: [0, 0], predicted: [0.5, 0] }),
        record(20, { command: [1], position: [0.5], q: [0.1, 1], predicted: [0.5, 0], score: 3 }),
      ]),
    );
    const [command, reached] = series.motors();
    expect(command?.dashed).toBe(true);
    expect(reached?.times).toEqual([0, 0.2, 1]);
    expect(reached?.values).toEqual([0, 0.5, 0.5]);
    // The joint that moves most is first.
    expect(series.joints()).toEqual(['joint 2', 'joint 1']);
    expect(series.joint('joint 1').map((line) => valueAt(line, 0.5)?.toFixed(3))).toEqual(['5.730', '28.648']);
    expect(series.score()[0]?.values.at(-1)).toBe(3);
  });

  it('have the contact force on an object, by the hand and by other bodies', () => {
    const series = new Series(
      recorded([
        record(0, {
          contact_a: [0, 1, 1],
          contact_b: [3, 0, 3],
          contact_force: [3, 4, 0, 0, 0, 2, 9, 9, 9],
        }),
      ]),
    );
    expect(series.forces(0).map((line) => valueAt(line, 0))).toEqual([5, 2]);
  });

  it('are computed from actions and poses if a file has no telemetry', () => {
    const series = new Series(recorded([]));
    expect(series.hasTelemetry).toBe(false);
    expect(series.motors().map((line) => valueAt(line, 0.6))).toEqual([1]);
    expect(series.joints()).toEqual(['finger']);
    const [turned] = series.joint('finger');
    expect(turned && valueAt(turned, 1)).toBeCloseTo(180 / Math.PI, 3);
    expect(series.score()).toEqual([]);
  });
});
