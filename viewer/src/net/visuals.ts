/** Visual shapes of a hand's links, from the hand's own files; links without them show their collision shapes. */
import { getJson } from './api';
import type { Mesh, Part, SceneInfo } from '../model/scene';
import type { Shape, VisualPart, Visuals } from '../wire/messages';

/** Little-endian numbers in base64. */
function numbers(text: string): Float32Array {
  const bytes = Uint8Array.from(atob(text), (letter) => letter.charCodeAt(0));
  const view = new DataView(bytes.buffer);
  return Float32Array.from({ length: bytes.length >> 2 }, (_, k) => view.getFloat32(4 * k, true));
}

/** Parts by the name of their link. */
export function partsOf(wire: readonly VisualPart[]): Map<string, Part[]> {
  const links = new Map<string, Part[]>();
  for (const { link, position, quat_xyzw: quat, shape } of wire) {
    const form: Shape | Mesh = 'triangles' in shape ? { type: 'mesh', corners: numbers(shape.triangles) } : shape;
    links.set(link, [...(links.get(link) ?? []), { position, quat, shape: form }]);
  }
  return links;
}

/** The scene with the hand's visual shapes; the same object if there are none. */
export function withVisuals(scene: SceneInfo, links: ReadonlyMap<string, Part[]>): SceneInfo {
  if (links.size === 0) return scene;
  return {
    ...scene,
    bodies: scene.bodies.map((body) => (body.kind === 'hand' ? { ...body, parts: links.get(body.name) ?? body.parts } : body)),
  };
}

/** Fetches the visual shapes of a hand; empty if it has none or if this page has no access. */
export async function fetchVisuals(hand: string, team: string | null, token: string | null): Promise<Map<string, Part[]>> {
  const whose = team === null ? '' : `?team=${encodeURIComponent(team)}`;
  try {
    return partsOf((await getJson<Visuals>(`/v1/hands/${encodeURIComponent(hand)}/visuals${whose}`, token)).parts);
  } catch {
    return new Map();
  }
}
