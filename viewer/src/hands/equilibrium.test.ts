import { describe, expect, it } from 'vitest';
import type { Vec3 } from '../model/pose';
import { turnTo } from './postures';
import { equilibriumRequest, clampForce, inLink, inWorld, type Load, reactionOf } from './equilibrium';
import type { EquilibriumResponse } from '../wire/messages';

const near = (a: Vec3, b: Vec3): void => a.forEach((x, k) => expect(x).toBeCloseTo(b[k] ?? NaN, 9));

describe('points of links', () => {
  it('are the same after a transform to the world and back', () => {
    const link = { position: [0.1, -0.2, 0.3] as Vec3, quat: turnTo([1, 0, 0], [0, 1, 0], [0, 0, 1], [1, 0, 0]) };
    near(inLink(link, inWorld(link, [0.01, 0.02, 0.03])), [0.01, 0.02, 0.03]);
  });

  it('are pushed with at most the server’s maximum force', () => {
    expect(Math.hypot(...clampForce([300, 400, 0]))).toBeLessThanOrEqual(200);
    expect(clampForce([0.12345, 0, 0])).toEqual([0.123, 0, 0]);
  });
});

describe('loads', () => {
  const load = (id: number, kind: Load['kind'], force: Vec3 = [0, 0, 0]): Load => ({
    id,
    kind,
    link: 'tip',
    point: [0, 0, 0],
    force,
    place: [0, 0, id],
  });
  const loads = [load(1, 'hold'), load(2, 'force', [0, 1, 0]), load(3, 'force'), load(4, 'hold')];

  it('are sent by kind, without zero forces', () => {
    const { forces, contacts, motors } = equilibriumRequest([0.5], { position: [0, 0, 0], quat: [0, 0, 0, 1] }, loads);
    expect(forces).toEqual([{ link: 'tip', point: [0, 0, 0], force: [0, 1, 0] }]);
    expect(contacts?.map((one) => one.position[2])).toEqual([1, 4]);
    expect(motors).toEqual([0.5]);
  });

  it('find their reactions by the order of the request', () => {
    const rest = {
      reactions: [
        { force: [1, 0, 0], gap: 0 },
        { force: [4, 0, 0], gap: 0 },
      ],
    } as unknown as EquilibriumResponse;
    expect(loads.map((one) => reactionOf(one, loads, rest)?.force[0] ?? null)).toEqual([1, null, null, 4]);
    expect(reactionOf(loads[0] as Load, loads, null)).toBeNull();
  });
});
