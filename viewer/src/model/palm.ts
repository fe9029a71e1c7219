/** The direction in which a hand's palm faces, estimated from how its fingers close. */
import { forwardKinematics } from './hand';
import type { Vec3 } from './pose';
import type { HandDescription } from '../wire/messages';

/** In the frame of the base: a point between the fingers (m), and the unit vector from the hand to a camera that looks into it. */
export interface Palm {
  middle: Vec3;
  direction: Vec3;
}

/** Closing angle for the estimate, rad. */
const CLOSED = 0.3;
/** Without a description: the values of the SoftHand. */
const UNKNOWN: Palm = { middle: [0, 0, 0.12], direction: [1, 0, 0] };

const length = (v: Vec3): number => Math.hypot(...v);
const mean = (all: Vec3[]): Vec3 => [0, 1, 2].map((axis) => all.reduce((sum, v) => sum + (v[axis] ?? 0), 0) / all.length) as Vec3;

/**
 * If the fingers close in one direction, the palm faces that way. If they close towards each other, as in a gripper, the camera
 * looks into the hand from beyond the fingertips.
 */
export function palmOf(hand: HandDescription | undefined): Palm {
  if (!hand) return UNKNOWN;
  const rest = hand.coordinates.map((c) => c.rest);
  const closed = hand.coordinates.map((c) => {
    const opens = c.minimum !== null && c.maximum !== null && c.rest - c.minimum > c.maximum - c.rest;
    return c.rest + (opens ? -CLOSED : CLOSED);
  });
  const base = { position: [0, 0, 0] as Vec3, quat: [0, 0, 0, 1] as [number, number, number, number] };
  const [open, shut] = [forwardKinematics(hand, rest, base), forwardKinematics(hand, closed, base)];
  const parents = new Set(hand.links.map((link) => link.parent));
  const tips = hand.links.filter((link) => link.parent !== null && !parents.has(link.name)).map((link) => link.name);
  const at = (places: typeof open, name: string): Vec3 => places.get(name)?.position ?? [0, 0, 0];
  const moves = tips.map((tip): Vec3 => {
    const [a, b] = [at(open, tip), at(shut, tip)];
    return [b[0] - a[0], b[1] - a[1], b[2] - a[2]];
  });
  if (tips.length === 0) return UNKNOWN;
  const ends = mean(tips.map((tip) => at(open, tip)));
  const way = mean(moves);
  const alike = length(way) > 0.5 * (moves.reduce((sum, v) => sum + length(v), 0) / moves.length);
  // The part along the fingers is removed: the camera is at the palm's side, not in front of the fingertips.
  const along = length(ends) > 0 ? (way[0] * ends[0] + way[1] * ends[1] + way[2] * ends[2]) / length(ends) ** 2 : 0;
  const towards: Vec3 = alike ? [way[0] - along * ends[0], way[1] - along * ends[1], way[2] - along * ends[2]] : ends;
  const norm = length(towards);
  return norm > 1e-6
    ? { middle: [0.6 * ends[0], 0.6 * ends[1], 0.6 * ends[2]], direction: [towards[0] / norm, towards[1] / norm, towards[2] / norm] }
    : UNKNOWN;
}
