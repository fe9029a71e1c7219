import { describe, expect, it } from 'vitest';
import { Player } from './player';

describe('the clock of a replay', () => {
  it('runs at its speed and ends at the end', () => {
    const player = new Player(10, 0.01);
    const times: number[] = [];
    player.onTime((time) => times.push(time));
    player.setSpeed(4);
    player.play(1000);
    player.advance(1500);
    expect(player.time).toBeCloseTo(2);
    player.advance(9000);
    expect(player.time).toBe(10);
    expect(player.playing).toBe(false);
    expect(times.at(-1)).toBe(10);
  });

  it('steps by ticks, and not beyond the run', () => {
    const player = new Player(0.05, 0.01);
    player.step(1);
    expect(player.time).toBeCloseTo(0.01);
    player.seek(0.034);
    player.step(1);
    expect(player.time).toBeCloseTo(0.04);
    player.step(10);
    expect(player.time).toBe(0.05);
    player.step(-100);
    expect(player.time).toBe(0);
  });
});
