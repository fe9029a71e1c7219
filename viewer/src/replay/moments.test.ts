import { describe, expect, it } from 'vitest';
import { record, recorded } from './fixture';
import { momentAt } from './moments';

describe('a moment of a replay', () => {
  const recording = recorded([
    record(10, {
      score: 1,
      command: [0.5],
      position: [0.25],
      motor_tension: [3],
      tension: [4],
      q: [0.1],
      predicted: [0.2],
      work: [0.7],
      finger_force: [1, 2, 3],
      finger_torque: [0, 0, 1],
      touch: [0, 0, 2, 0, 0, 4],
      readings: [7],
    }),
    record(40, { score: 2, contact_a: [0], contact_b: [3], contact_position: [1, 2, 3], contact_force: [0, 3, 4], contact_use: [0.5] }),
  ]);

  it('has the latest record, and none before the first', () => {
    expect(momentAt(recording, 0.09, true).telemetry).toBeUndefined();
    expect(momentAt(recording, 0.09, true).score).toBeNull();
    expect(momentAt(recording, 0.39, true).score).toBe(1);
    expect(momentAt(recording, 0.1, true).telemetry).toEqual({
      motors: [{ command: 0.5, position: 0.25, tension: 3, work: 0.7 }],
      tension: [4],
      q: [0.1],
      predicted: [0.2],
      fingers: [{ force: [1, 2, 3], torque: [0, 0, 1] }],
      touch: [
        [0, 0, 2],
        [0, 0, 4],
      ],
      readings: [7],
    });
    expect(momentAt(recording, 0.4, true).telemetry?.predicted).toBeNull();
    expect(momentAt(recording, 9, true).contacts).toEqual([{ a: 0, b: 3, position: [1, 2, 3], force: [0, 3, 4], use: 0.5 }]);
  });

  it('has recorded poses where a person chose it, and interpolated poses during playback', () => {
    expect(momentAt(recording, 0.06, true).poses[0]).toBeCloseTo(0.04);
    expect(momentAt(recording, 0.06, false).poses[0]).toBeCloseTo(0.06);
    expect(momentAt(recording, 0.06, true).tick).toBe(6);
  });

  it('ends with the score of the result', () => {
    const { outcome } = { outcome: { score: 10, in_goal: 4, outside: 0, reason: 'complete' as const, ticks: 100, events: [] } };
    const whole = { ...recording, outcome };
    expect(momentAt(whole, 0.99, true).score).toBe(2);
    expect(momentAt(whole, whole.duration, true).score).toBe(10);
  });
});
