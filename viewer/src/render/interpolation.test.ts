import { describe, expect, it } from 'vitest';
import { type Moment, POSE } from '../model/moment';
import { PoseInterpolator } from './interpolation';

const moment = (x: number): Moment => ({ tick: 0, time: 0, score: 0, poses: new Float32Array([x, 0, 0, 0, 0, 0, 1]) });

describe('interpolation of a live run', () => {
  it('moves between frames and ends at the newest', () => {
    const blend = new PoseInterpolator();
    blend.push(moment(0), 1000);
    blend.push(moment(1), 1033);
    expect(blend.advance(1049.5)).toBe(true);
    expect(blend.poses[0]).toBeCloseTo(0.5, 2);
    blend.advance(1100);
    expect(blend.poses[0]).toBe(1);
    expect(blend.advance(1200)).toBe(false);
    expect(blend.poses.length).toBe(POSE);
  });

  it('reaches the newest frame in time after a burst of frames', () => {
    const blend = new PoseInterpolator();
    blend.push(moment(0), 0);
    for (let k = 1; k <= 50; k += 1) blend.push(moment(k), 40 + k / 100);
    blend.advance(200);
    expect(blend.poses[0]).toBe(50);
  });
});
