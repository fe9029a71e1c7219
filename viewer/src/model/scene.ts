/** The scene of a run: bodies with their shapes, and the regions of the rules. SI units. */
import type { Channel } from './channel';
import type { Quat, Vec3 } from './pose';
import type { HandDescription, Region, Shape, WatchRun, WatchScene } from '../wire/messages';

export type { Quat, Vec3 } from './pose';

/** A visual part without physics: x, y, z of the three corners of each triangle. */
export interface Mesh {
  type: 'mesh';
  corners: Float32Array;
}

/** A shape in the frame of its body. */
export interface Part {
  position: Vec3;
  quat: Quat;
  shape: Shape | Mesh;
}

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

/**
 * The drawn scene. `moving` has the ids of the bodies in a moment's poses, in that order; `goals` the names of the task's
 * goals in their order, if it has any.
 */
export interface SceneInfo {
  run?: WatchRun;
  bodies: Body[];
  moving: number[];
  regions: Region[];
  goals?: string[];
  hand?: HandDescription;
  readings?: Channel[];
}

/** Converts the message. */
export function sceneOf(wire: WatchScene): SceneInfo {
  const bodies = wire.bodies.map(({ quat_xyzw, parts, ...body }): Body => ({
    ...body,
    quat: quat_xyzw,
    parts: parts.map((part) => ({ position: part.position, quat: part.quat_xyzw, shape: part.shape })),
  }));
  return { ...wire, bodies };
}
