/** The description of a hand from `GET /v1/hands/{name}`, and its forward kinematics. */
import { type Pose, type Quat, type Vec3, composed, turnAbout } from './pose';
import type { Shape } from './shape';

export interface PoseDescription { position: Vec3; quat_xyzw: Quat }
export interface Hinge { kind: 'revolute' | 'prismatic'; origin: PoseDescription; axis: Vec3; ratio: number; offset: number }
export interface LinkDescription {
  name: string;
  parent: string | null;
  coordinate: string | null;
  hinges: Hinge[];
  mass: number;
  com: Vec3;
  base_from_link_at_rest: PoseDescription;
  shapes: (PoseDescription & { shape: Shape; friction: number })[];
}
export interface Coordinate { name: string; minimum: number | null; maximum: number | null; stiffness: number; damping: number; rest: number }
export interface Motor { name: string; scaling: number; offset: number; speed_limit: number }
export interface TendonDescription {
  name: string;
  motor: string;
  /** One for each coordinate, at rest. */
  moment_arms: number[];
  /** Elements that make a moment arm vary with a coordinate. */
  elements?: { coordinate: string; kind: string }[];
  /** The tendon pushes as well as it pulls. */
  both_ways?: boolean;
  stiffness: number;
  damping: number;
  force_limit: number;
}
export interface HandDescription {
  name: string;
  description: string;
  mass: number;
  links: LinkDescription[];
  coordinates: Coordinate[];
  motors: Motor[];
  tendons: TendonDescription[];
  /** Tactile patches: rectangles, m. */
  tactile?: { name: string; link: string; size: [number, number]; taxels: [number, number] }[];
  sensors?: { joints?: { on: string[] }; cameras?: { name: string; width: number; height: number }[] };
  /** Names of the first links of the fingers, in the order of `telemetry.fingers`. */
  fingers?: string[];
  gravity_compensation: boolean;
}

const pose = (p: PoseDescription): Pose => ({ position: p.position, quat: p.quat_xyzw });

function hingePose(hinge: Hinge, q: number): Pose {
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
