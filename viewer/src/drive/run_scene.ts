/** Converts the control socket's scene and observations for the 3D view. */
import { forwardKinematics } from '../model/hand';
import { type Moment, POSE } from '../model/moment';
import type { Body, Quat, SceneInfo, Vec3 } from '../model/scene';
import type { HandDescription, Obs, Scene } from '../wire/messages';

/** Colour of the hand's links, as in the server's images. */
const LINK: Vec3 = [0.72, 0.74, 0.78];
const IDENTITY: Quat = [0, 0, 0, 1];

/** The scene of a run; its moving bodies are where the observation has them. */
export function sceneOfReset(scene: Scene, hand: HandDescription, seen: Obs): SceneInfo {
  const bodies = scene.bodies.map((body): Body => ({
    id: body.id,
    name: body.name,
    kind: body.free ? 'object' : 'furniture',
    position: body.position ?? [0, 0, 0],
    quat: body.quat_xyzw ?? IDENTITY,
    parts: body.parts.map((part) => ({ position: part.position, quat: part.quat_xyzw, shape: part.shape })),
    color: body.color,
  }));
  const first = Math.max(-1, ...bodies.map((body) => body.id)) + 1;
  const links = hand.links.map((link, k): Body => ({
    id: first + k,
    name: link.name,
    kind: 'hand',
    position: link.base_from_link_at_rest.position,
    quat: link.base_from_link_at_rest.quat_xyzw,
    parts: link.shapes.map((shape) => ({ position: shape.position, quat: shape.quat_xyzw, shape: shape.shape })),
    color: LINK,
  }));
  const objects = bodies.filter((body) => body.kind === 'object');
  // Goals of single objects; elsewhere objects are counted.
  const goals = scene.goals.filter((goal) => goal.object !== undefined).map((goal) => goal.name);
  const { poses } = momentOf(seen, hand);
  [...objects, ...links].forEach((body, row) => {
    const [x, y, z, qx, qy, qz, qw] = poses.subarray(POSE * row, POSE * (row + 1));
    if (qw === undefined) return;
    [body.position, body.quat] = [
      [x ?? 0, y ?? 0, z ?? 0],
      [qx ?? 0, qy ?? 0, qz ?? 0, qw],
    ];
  });
  return { bodies: [...bodies, ...links], moving: [...objects, ...links].map((body) => body.id), regions: scene.regions, goals, hand };
}

/** The moment of an observation: objects from its truth, links by forward kinematics. */
export function momentOf(observation: Obs, hand: HandDescription): Moment {
  const { truth } = observation;
  const { position, quat_xyzw: quat } = observation.hand.base;
  const objects = truth?.objects.position ?? [];
  const q = truth?.joints.position ?? hand.coordinates.map((coordinate) => coordinate.rest);
  const places = forwardKinematics(hand, q, { position, quat });
  const poses = new Float32Array(POSE * (objects.length + hand.links.length));
  objects.forEach((at, row) => {
    poses.set(at, POSE * row);
    poses.set(truth?.objects.quat_xyzw[row] ?? IDENTITY, POSE * row + 3);
  });
  hand.links.forEach((link, k) => {
    const at = places.get(link.name);
    if (!at) return;
    poses.set(at.position, POSE * (objects.length + k));
    poses.set(at.quat, POSE * (objects.length + k) + 3);
  });
  const motors = observation.hand.actuators.map(({ command, position: reached, tension }) => ({ command, position: reached, tension }));
  return {
    tick: observation.tick,
    time: observation.sim_time_s,
    score: observation.score,
    poses,
    telemetry: { motors, tension: [], q, predicted: truth?.predicted_equilibrium ?? null },
  };
}
