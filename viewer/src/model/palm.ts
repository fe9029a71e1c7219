/** Where a hand's palm looks: guessed from how its fingers close, for hands of any make. */
import { forwardKinematics } from './hand';
import type { Vec3 } from './pose';
import type { HandDescription } from '../wire/messages';

/** In the frame of the base: a point amid the fingers (m), and from where the camera sees into the hand (a unit vector). */
export interface Palm { middle: Vec3; direction: Vec3 }

/** How far the coordinates are closed to see where the fingers go, rad. */
const CLOSED = 0.3;
/** Without a description: as the hand that comes with the server. */
const UNKNOWN: Palm = { middle: [0, 0, 0.12], direction: [1, 0, 0] };

const length = (v: Vec3): number => Math.hypot(...v);
const mean = (all: Vec3[]): Vec3 => [0, 1, 2].map((axis) => all.reduce((sum, v) => sum + (v[axis] ?? 0), 0) / all.length) as Vec3;

/**
 * Fingers that close the same way show where the palm looks. Where they close towards each other, as a gripper's, the camera
 * looks into the hand from beyond their tips.
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
  const moves = tips.map((tip): Vec3 => { const [a, b] = [at(open, tip), at(shut, tip)]; return [b[0] - a[0], b[1] - a[1], b[2] - a[2]]; });
  if (tips.length === 0) return UNKNOWN;
  const ends = mean(tips.map((tip) => at(open, tip)));
  const way = mean(moves);
  const alike = length(way) > 0.5 * (moves.reduce((sum, v) => sum + length(v), 0) / moves.length);
  // What the fingers' own length adds to the way is left out: the camera stands beside the fingers, not before them.
  const along = length(ends) > 0 ? (way[0] * ends[0] + way[1] * ends[1] + way[2] * ends[2]) / length(ends) ** 2 : 0;
  const towards: Vec3 = alike ? [way[0] - along * ends[0], way[1] - along * ends[1], way[2] - along * ends[2]] : ends;
  const norm = length(towards);
  return norm > 1e-6
    ? { middle: [0.6 * ends[0], 0.6 * ends[1], 0.6 * ends[2]], direction: [towards[0] / norm, towards[1] / norm, towards[2] / norm] }
    : UNKNOWN;
}
