import { describe, expect, it } from 'vitest';
import { forwardKinematics } from './hand';
import { type Pose, composed } from './pose';
import softhand from './testdata/softhand.json';
import type { HandDescription, LinkDescription } from '../wire/messages';

// The file is the answer of GET /v1/hands/softhand without masses and shapes.
const hand = softhand as unknown as HandDescription;
const rest = hand.coordinates.map((coordinate) => coordinate.rest);
const ORIGIN: Pose = { position: [0, 0, 0], quat: [0, 0, 0, 1] };

/** Distance of two poses: m, and the angle between them in rad. */
function distance(a: Pose | undefined, b: Pose): { metres: number; radians: number } {
  if (!a) return { metres: Infinity, radians: Infinity };
  const chord = (sign: number): number => Math.hypot(...a.quat.map((x, k) => x - sign * (b.quat[k] ?? 0)));
  return { metres: Math.hypot(...a.position.map((x, k) => x - (b.position[k] ?? 0))), radians: 2 * Math.min(chord(1), chord(-1)) };
}

const described = (link: LinkDescription): Pose => ({
  position: link.base_from_link_at_rest.position,
  quat: link.base_from_link_at_rest.quat_xyzw,
});

describe('forward kinematics', () => {
  it('places every link at rest as the server describes it', () => {
    const places = forwardKinematics(hand, rest, ORIGIN);
    expect(places.size).toBe(hand.links.length);
    for (const link of hand.links) {
      const by = distance(places.get(link.name), described(link));
      expect(by.metres, link.name).toBeLessThan(1e-7);
      expect(by.radians, link.name).toBeLessThan(1e-7);
    }
  });

  it('moves with the base', () => {
    const base: Pose = { position: [1, 2, 3], quat: [0, Math.SQRT1_2, 0, Math.SQRT1_2] };
    const places = forwardKinematics(hand, rest, base);
    for (const link of hand.links)
      expect(distance(places.get(link.name), composed(base, described(link))).metres, link.name).toBeLessThan(1e-7);
  });

  it('turns a link by its coordinate times the ratio of its hinges', () => {
    const k = hand.links.findIndex((link) => link.parent === 'base' && link.hinges.length === 1 && link.hinges[0]?.kind === 'revolute');
    const link = hand.links[k];
    const q = hand.coordinates.map((coordinate, c) => (coordinate.name === link?.coordinate ? 0.3 : 0) + (rest[c] ?? 0));
    expect(distance(forwardKinematics(hand, q, ORIGIN).get(link?.name ?? ''), described(link as LinkDescription)).radians).toBeCloseTo(
      0.3,
      2,
    );
  });
});
