import { describe, expect, it } from 'vitest';
import { palmOf } from '../model/palm';
import { turned, type Vec3 } from '../model/pose';
import softhand from '../model/testdata/softhand.json';
import { baseTurn, turnTo } from './postures';
import type { HandDescription } from '../wire/messages';

const near = (a: Vec3, b: Vec3): void => a.forEach((x, k) => expect(x).toBeCloseTo(b[k] ?? NaN, 9));

describe('postures', () => {
  const hand = softhand as unknown as HandDescription;
  it('turn the palm to their direction', () => {
    const { direction } = palmOf(hand);
    near(turned(baseTurn(hand, 'palm-up'), direction), [0, 0, 1]);
    near(turned(baseTurn(hand, 'palm-down'), direction), [0, 0, -1]);
    near(turned(baseTurn(hand, 'palm-side'), direction), [0, -1, 0]);
  });

  it('work for a gripper, whose palm faces along its fingers', () => {
    near(turned(turnTo([0, 0, 1], [0, 0, -1], [0, 0, 1], [1, 0, 0]), [0, 0, 1]), [0, 0, -1]);
    near(turned(turnTo([1, 0, 0], [0, 0, 1], [1, 0, 0], [1, 0, 0]), [1, 0, 0]), [0, 0, 1]);
  });
});
