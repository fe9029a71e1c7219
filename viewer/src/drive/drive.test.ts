import { describe, expect, it } from 'vitest';
import { padState } from './gamepad';
import { twistOf } from './motion';
import { Pace } from './pace';
import { pythonOf } from './python';
import { ActionRecording } from './action_recording';
import { Targets } from './targets';
import type { Opened } from '../wire/messages';

const RUN: Opened = {
  task: 'balls',
  hand: 'softhand',
  mode: 'lockstep',
  sensing: 'truth',
  noise: 'none',
  seed: 7,
  tick_s: 0.01,
  time_limit_s: 600,
};
const recording = (): ActionRecording => new ActionRecording(RUN, 'driver', new Date(0));
const held = { linear: [0.1, 0, 0] as [number, number, number], angular: [0, 0, 0] as [number, number, number] };

describe('the pace', () => {
  it('follows the clock times the factor', () => {
    const pace = new Pace(10);
    let ticks = 0;
    for (let now = 0; now <= 1000; now += 1000 / 60) ticks += pace.due(now, 1, false);
    expect(ticks).toBeGreaterThanOrEqual(100);
    expect(ticks).toBeLessThanOrEqual(102);
    const slow = new Pace(10);
    ticks = 0;
    for (let now = 0; now <= 1000; now += 1000 / 60) ticks += slow.due(now, 0.1, false);
    expect(ticks).toBeGreaterThanOrEqual(10);
    expect(ticks).toBeLessThanOrEqual(11);
  });

  it('takes a tick early for an input, and one less later', () => {
    const pace = new Pace(10);
    expect(pace.due(0, 1, false)).toBe(1);
    expect(pace.due(4, 1, true)).toBe(1);
    expect(pace.due(5, 1, true)).toBe(0);
    expect(pace.due(12, 1, false)).toBe(0);
    expect(pace.due(21, 1, false)).toBe(1);
  });

  it('does not catch up after a long gap or a pause', () => {
    const pace = new Pace(10);
    pace.due(0, 1, false);
    expect(pace.due(5000, 1, false)).toBe(10);
    pace.rest();
    expect(pace.due(9000, 1, false)).toBe(1);
  });
});

describe('targets', () => {
  it('are sent only when they change', () => {
    const targets = new Targets([0]);
    expect(targets.changes()).toEqual({});
    targets.drive(held);
    targets.hand = [0.5];
    expect(targets.changes()).toEqual({ base: held, hand: [0.5] });
    targets.drive({ ...held });
    expect(targets.changes()).toEqual({});
  });

  it('push once, or while the arrow is held', () => {
    const targets = new Targets([0]);
    targets.push({ link: 'a', force: [1, 0, 0], torque: [0, 0, 0], duration_s: 2 });
    targets.held = () => ({ link: 'b', force: [0, 1, 0], torque: [0, 0, 0] });
    expect(targets.pushes(0.02).map((push) => [push.link, push.duration_s])).toEqual([
      ['a', 2],
      ['b', 0.02],
    ]);
    expect(targets.pushes(0.01).map((push) => [push.link, push.duration_s])).toEqual([['b', 0.01]]);
  });
});

describe('a recording', () => {
  it('joins steps without changes', () => {
    const made = recording();
    made.step(2, {});
    made.step(1, { hand: [0.25] });
    made.step(2, {});
    made.push({ link: 'tip', force: [0, 0, -2], torque: [0, 0, 0], duration_s: 0.5 });
    made.step(3, {});
    made.step(1, { base: held });
    expect(made.entries).toEqual([
      { kind: 'step', ticks: 2, action: {} },
      { kind: 'step', ticks: 3, action: { hand: [0.25] } },
      { kind: 'push', push: { link: 'tip', force: [0, 0, -2], torque: [0, 0, 0], duration_s: 0.5 } },
      { kind: 'step', ticks: 3, action: {} },
      { kind: 'step', ticks: 1, action: { base: held } },
    ]);
    expect(made.ticks).toBe(9);
  });

  it('has gaps where it was off, and the targets at the end of a gap', () => {
    const made = recording();
    made.step(2, {});
    made.record(false);
    made.step(4, { hand: [1] });
    made.step(1, {});
    made.record(true);
    made.step(3, { base: held });
    made.step(1, {});
    expect(made.entries).toEqual([
      { kind: 'step', ticks: 2, action: {} },
      { kind: 'gap', ticks: 5 },
      { kind: 'step', ticks: 4, action: { hand: [1], base: held } },
    ]);
    expect(made.whole).toBe(false);
    expect(pythonOf(made)).toContain('DRIVEN = None');
  });

  it('becomes a Python file with exactly the same numbers', () => {
    const made = recording();
    made.step(7, { base: { position: [0.12345, -0.5, 0.75], quat_xyzw: [0, 1, 0, 0] }, hand: [0.1] });
    made.push({ link: 'tip', force: [0, 0, -2], torque: [1e-7, 0, 0], duration_s: 0.5 });
    made.events.push({ tick: 5, kind: 'in_goal', object: 0, name: 'ball_0\n"""' });
    made.result = {
      id: 1,
      task: 'balls',
      task_hash: 'cd',
      hand: 'softhand',
      mode: 'lockstep',
      status: 'practice',
      sim_time_s: 0.07,
      events: [],
      session_left_s: null,
      missed_ticks: 0,
      late_ticks: 0,
      late_max_s: 0,
      dropped_obs: 0,
      run_id: 'run_1',
      score: 0.5,
      in_goal: 1,
      outside: 0,
      reason: 'stopped',
      ticks: 7,
      state_hash: 'ab',
    };
    const file = pythonOf(made);
    expect(file).toContain('    (7, pose((0.12345, -0.5, 0.75), (0, 1, 0, 0)), (0.1,)),');
    expect(file).toContain('    Push("tip", (0, 0, -2), (1e-7, 0, 0), 0.5),');
    expect(file).toContain('DRIVEN = {"ticks": 7, "score": 0.5, "state_hash": "ab"}');
    expect(file).toContain("    # tick 5: ball_0/u{A}''' in_goal");
  });
});

describe('input', () => {
  it('moves in the direction of the camera, parallel to the ground', () => {
    const { linear } = twistOf({ move: [0, 1, 0], turn: [0, 0, 0] }, 'view', [0, 2, 0.3], [0, 0, 0, 1], 0.5, 1);
    expect(linear).toEqual([-0.5, 0, 0]);
  });

  it('moves along the hand’s axes', () => {
    const { linear, angular } = twistOf({ move: [0, 0, 1], turn: [1, 0, 0] }, 'hand', [1, 0, 0], [0, 1, 0, 0], 0.5, 2);
    expect(linear).toEqual([0, 0, -0.5]);
    expect(angular).toEqual([-2, 0, 0]);
  });

  it('of a gamepad ignores small deflections', () => {
    const buttons = Array.from({ length: 17 }, (_, k) => ({ pressed: false, touched: false, value: k === 7 ? 0.5 : 0 }));
    const state = padState({ axes: [0.1, -1, 0, 0.05], buttons });
    expect(state.axes.move).toEqual([0, 1, 0]);
    expect(state.closing).toBe(0.5);
  });
});
