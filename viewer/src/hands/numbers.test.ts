import { expect, it } from 'vitest';
import { isAngle, numbersOf, usualForce } from './numbers';
import type { HandDescription } from '../wire/messages';

const at = { position: [0, 0, 0] as [number, number, number], quat_xyzw: [0, 0, 0, 1] as [number, number, number, number] };
const hinge = { kind: 'revolute' as const, origin: at, axis: [1, 0, 0] as [number, number, number], ratio: 1, offset: 0 };
const hand: HandDescription = {
  name: 'two',
  description: '',
  mass: 1,
  gravity_compensation: true,
  motors: [],
  fingers: [],
  tactile: [],
  specs: [],
  sensors: {} as HandDescription['sensors'],
  links: [
    {
      name: 'base',
      parent: null,
      coordinate: null,
      hinges: [],
      mass: 0.5,
      com: [0, 0, 0],
      base_from_link_at_rest: at,
      shapes: [{ ...at, friction: 1, shape: { type: 'box', half_extents: [0.1, 0.2, 0.05], rounding: 0 } }],
    },
    {
      name: 'tip',
      parent: 'base',
      coordinate: 'a',
      hinges: [hinge],
      mass: 0.5,
      com: [0, 0, 0],
      base_from_link_at_rest: { ...at, position: [0, 0, 0.1] },
      shapes: [{ ...at, friction: 1, shape: { type: 'box', half_extents: [0.01, 0.01, 0.05], rounding: 0 } }],
    },
    {
      name: 'slide',
      parent: 'base',
      coordinate: 'b',
      hinges: [{ ...hinge, kind: 'prismatic' }],
      mass: 0,
      com: [0, 0, 0],
      base_from_link_at_rest: at,
      shapes: [],
    },
  ],
  coordinates: ['a', 'b'].map((name) => ({ name, minimum: null, maximum: null, stiffness: 0.1, damping: 0, rest: 0 })),
  tendons: [
    { name: 't', motor: 'm', moment_arms: [0.01, -0.02], elements: [], both_ways: false, stiffness: 1, damping: 0, force_limit: 50 },
  ],
};

it('computes size and largest torque', () => {
  const { size, torque, strongest, shapes } = numbersOf(hand);
  [0.2, 0.4, 0.2].forEach((edge, axis) => expect(size[axis]).toBeCloseTo(edge, 9));
  expect([shapes, torque, strongest]).toEqual([2, 1, 'b']);
});

it('distinguishes angles and lengths', () => expect([isAngle(hand, 'a'), isAngle(hand, 'b')]).toEqual([true, false]));

it('scales arrows by the hand’s springs', () => expect(usualForce(hand)).toBe(1));
