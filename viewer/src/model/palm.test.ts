import { describe, expect, it } from 'vitest';
import { palmOf } from './palm';
import softhand from './testdata/softhand.json';
import type { HandDescription } from '../wire/messages';

describe('the palm', () =>
  it('of the anthropomorphic hand faces +x, as in its model', () => {
    const hand = softhand as unknown as HandDescription;
    const coordinates = hand.coordinates.map((c) => ({ ...c, minimum: 0, maximum: 1.5 }));
    const { direction, middle } = palmOf({ ...hand, coordinates });
    expect(direction[0]).toBeGreaterThan(0.8);
    expect(middle[2]).toBeGreaterThan(0.08);
  }));
