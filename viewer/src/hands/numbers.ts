/** Key numbers of a hand, from its description. SI units. */
import { place, surface } from './outline';
import type { HandDescription } from '../wire/messages';

export interface Numbers {
  shapes: number;
  /** Edges of the bounding box at rest, m. */
  size: [number, number, number];
  /** Largest torque on a joint with all tendons at their limits, from R at rest; `strongest` is that joint. */
  torque: number;
  strongest: string;
}

export function numbersOf(hand: HandDescription): Numbers {
  const low = [Infinity, Infinity, Infinity];
  const high = [-Infinity, -Infinity, -Infinity];
  let shapes = 0;
  for (const link of hand.links) {
    for (const placed of link.shapes) {
      shapes += 1;
      const grown = placed.shape.type === 'hull' ? placed.shape.rounding : 0;
      for (const point of surface(placed.shape)) {
        place(link.base_from_link_at_rest, place(placed, point)).forEach((x, axis) => {
          low[axis] = Math.min(low[axis] ?? 0, x - grown);
          high[axis] = Math.max(high[axis] ?? 0, x + grown);
        });
      }
    }
  }
  const torques = hand.coordinates.map((_, k) =>
    hand.tendons.reduce((sum, tendon) => sum + Math.abs(tendon.moment_arms[k] ?? 0) * tendon.force_limit, 0),
  );
  const torque = Math.max(0, ...torques);
  const edge = (axis: number): number => (shapes > 0 ? (high[axis] ?? 0) - (low[axis] ?? 0) : 0);
  return { shapes, size: [edge(0), edge(1), edge(2)], torque, strongest: hand.coordinates[torques.indexOf(torque)]?.name ?? '–' };
}

/** Whether a coordinate is an angle; otherwise it is a length. */
export function isAngle(hand: HandDescription, coordinate: string): boolean {
  return hand.links.every((link) => link.coordinate !== coordinate || link.hinges.every((hinge) => hinge.kind === 'revolute'));
}

/** Initial arrow scale, N for 5 cm: at 5 cm from a joint of median stiffness this force turns it by about 0.5 rad. */
export function usualForce(hand: HandDescription): number {
  const stiff = hand.coordinates
    .map((c) => c.stiffness)
    .filter((e) => e > 0)
    .sort((a, b) => a - b);
  const wanted = ((stiff[Math.floor(stiff.length / 2)] ?? 1) * 0.5) / 0.05;
  return FORCES.reduce((best, one) => (Math.abs(Math.log(one / wanted)) < Math.abs(Math.log(best / wanted)) ? one : best));
}

/** Arrow scales to choose from, N for 5 cm. */
export const FORCES: readonly number[] = [0.05, 0.1, 0.2, 0.5, 1, 2, 5, 10, 20, 50, 100];
