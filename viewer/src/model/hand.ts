/** The description of a hand from `GET /v1/hands/{name}`, and its forward kinematics. */
import { type Pose, composed, turnAbout } from './pose';
import type { HandDescription, HingeDescription, PoseDescription } from '../wire/messages';

const pose = (p: PoseDescription): Pose => ({ position: p.position, quat: p.quat_xyzw });

function hingePose(hinge: HingeDescription, q: number): Pose {
  const x = hinge.ratio * q + hinge.offset;
  if (hinge.kind === 'revolute') return { position: [0, 0, 0], quat: turnAbout(hinge.axis, x) };
  return { position: [hinge.axis[0] * x, hinge.axis[1] * x, hinge.axis[2] * x], quat: [0, 0, 0, 1] };
}

/** The pose of each link in the frame of `base`'s pose; `q` is in the order of the hand's coordinates. */
export function forwardKinematics(hand: HandDescription, q: ArrayLike<number>, base: Pose): Map<string, Pose> {
  const places = new Map<string, Pose>();
  const place = new Map(hand.coordinates.map((coordinate, k) => [coordinate.name, k]));
  for (const link of hand.links) {
    const parent = link.parent === null ? undefined : places.get(link.parent);
    if (!parent) {
      places.set(link.name, base);
      continue;
    }
    const value = q[place.get(link.coordinate ?? '') ?? -1] ?? 0;
    let at = parent;
    for (const hinge of link.hinges) at = composed(composed(at, pose(hinge.origin)), hingePose(hinge, value));
    places.set(link.name, at);
  }
  return places;
}
