/** A hand without objects as a scene, and the poses of its links. m. */
import { place, surface } from './outline';
import { forwardKinematics } from '../model/hand';
import { type Moment, POSE } from '../model/moment';
import { composed, type Pose } from '../model/pose';
import type { Body, Quat, SceneInfo, Vec3 } from '../model/scene';
import { inWorld } from './equilibrium';
import type { EquilibriumResponse, HandDescription } from '../wire/messages';

/** Colours of links and, a little darker, of the base. */
const LINK: Vec3 = [0.78, 0.8, 0.84];
const BASE: Vec3 = [0.55, 0.58, 0.63];
/** Gap between the ground and the lowest point of the hand, open or closed, m. */
const GAP_M = 0.02;

/** World poses of the links at q. */
export function placesOf(hand: HandDescription, q: readonly number[], base: Pose): Map<string, Pose> {
  return forwardKinematics(hand, q, base);
}

/** World poses of the links in a response. */
export function placesAt(equilibrium: EquilibriumResponse): Map<string, Pose> {
  return new Map(equilibrium.links.map((link) => [link.name, { position: link.position, quat: link.quat_xyzw }]));
}

/** The scene, with the base at its pose and the links at rest. A link's id is its index in the description. */
export function sceneOfHand(hand: HandDescription, base: Pose): SceneInfo {
  const links = hand.links.map((link, id): Body => {
    const at = composed(base, { position: link.base_from_link_at_rest.position, quat: link.base_from_link_at_rest.quat_xyzw });
    return {
      id,
      name: link.name,
      kind: 'hand',
      position: at.position,
      quat: at.quat,
      color: link.parent === null ? BASE : LINK,
      parts: link.shapes.map((shape) => ({ position: shape.position, quat: shape.quat_xyzw, shape: shape.shape })),
    };
  });
  return { bodies: links, moving: links.map((link) => link.id), regions: [], hand };
}

/** Height of the base, m, at which the hand is above the ground, open and with all joints at their upper limits. */
export function heightOf(hand: HandDescription, quat: Quat): number {
  let lowest = 0;
  for (const q of [hand.coordinates.map((c) => c.rest), hand.coordinates.map((c) => c.maximum ?? c.rest)]) {
    const places = placesOf(hand, q, { position: [0, 0, 0], quat });
    for (const link of hand.links) {
      const at = places.get(link.name);
      if (!at) continue;
      for (const placed of link.shapes)
        for (const point of surface(placed.shape)) lowest = Math.min(lowest, inWorld(at, place(placed, point))[2]);
    }
  }
  // Whole centimetres, since the page shows the number.
  return Math.ceil(100 * (GAP_M - lowest) - 1e-9) / 100;
}

/** The links' poses as a moment. */
export function momentOf(hand: HandDescription, places: ReadonlyMap<string, Pose>): Moment {
  const poses = new Float32Array(POSE * hand.links.length);
  hand.links.forEach((link, row) => {
    const at = places.get(link.name);
    if (!at) return;
    poses.set(at.position, POSE * row);
    poses.set(at.quat, POSE * row + 3);
  });
  return { tick: 0, time: 0, score: null, poses };
}

/** The grasp centre: the mean of the fingertip links' centres of mass. */
export function graspCentre(hand: HandDescription, places: ReadonlyMap<string, Pose>): Vec3 | null {
  const parents = new Set(hand.links.map((link) => link.parent));
  const tips = hand.links.filter((link) => link.parent !== null && !parents.has(link.name));
  const sum: Vec3 = [0, 0, 0];
  for (const tip of tips) {
    const at = places.get(tip.name);
    if (!at) return null;
    composed(at, { position: tip.com, quat: [0, 0, 0, 1] }).position.forEach((x, k) => {
      sum[k] = (sum[k] ?? 0) + x / tips.length;
    });
  }
  return tips.length > 0 ? sum : null;
}
