/** The scene of a run: bodies with their shapes, and the regions of the rules. SI units. */
import type { Channel } from './channel';
import type { HandDescription } from './hand';
import type { Quat, Vec3 } from './pose';
import type { Shape } from './shape';

export type { Quat, Vec3 } from './pose';

/** A visual part without physics: x, y, z of the three corners of each triangle. */
export interface Mesh { type: 'mesh'; corners: Float32Array }

/** A shape in the frame of its body. */
export interface Part { position: Vec3; quat: Quat; shape: Shape | Mesh }

/** Furniture is fixed; objects and links of the hand move. */
export interface Body {
  id: number;
  name: string;
  kind: 'object' | 'furniture' | 'hand';
  position: Vec3;
  quat: Quat;
  parts: Part[];
  /** sRGB, 0 to 1. */
  color: Vec3;
}

export interface Region { name: string; role?: string; min: Vec3; max: Vec3 }

/** The team, task and hand of a run. */
export interface RunInfo {
  run_id: string;
  session_id: string;
  team: string;
  task: string;
  hand: string;
  official: boolean;
  tick_s: number;
  time_limit_s: number;
}

/** The drawn scene. `moving` has the ids of the bodies in a moment's poses, in that order. */
export interface SceneInfo { run?: RunInfo; bodies: Body[]; moving: number[]; regions: Region[]; hand?: HandDescription; readings?: Channel[] }

/** A body in the server's message. */
interface WireBody extends Omit<Body, 'quat' | 'parts'> {
  quat_xyzw: Quat;
  parts: { position: Vec3; quat_xyzw: Quat; shape: Shape }[];
}

/** The message `scene` of the watch socket. */
export interface WireScene { run: RunInfo; bodies: WireBody[]; moving: number[]; regions: Region[]; hand?: HandDescription; readings?: Channel[] }

/** Converts the message. */
export function sceneOf(wire: WireScene): SceneInfo {
  const bodies = wire.bodies.map(({ quat_xyzw, parts, ...body }): Body => ({
    ...body,
    quat: quat_xyzw,
    parts: parts.map((part) => ({ position: part.position, quat: part.quat_xyzw, shape: part.shape })),
  }));
  return { ...wire, bodies };
}
