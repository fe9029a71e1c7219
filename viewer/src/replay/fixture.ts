/** A small recording for tests: an object slides along x; the second of the hand's two links turns about z. */
import { bodiesOf } from './scene_update';
import { emptyRecord } from './protobuf';
import { PoseTable } from './poses';
import type { Recording } from './recording';
import type { SceneEntity } from '../wire/messages';
import type { TelemetryRecord } from '../wire/telemetry';

const place = { position: { x: 0, y: 0, z: 0 }, orientation: { x: 0, y: 0, z: 0, w: 1 } };
const color = { r: 1, g: 0, b: 0, a: 1 };
const timestamp = { sec: 0, nsec: 0 };

export function entity(id: string, frame: string): SceneEntity {
  const spheres = [{ pose: place, size: { x: 0.1, y: 0.1, z: 0.1 }, color }];
  return {
    id,
    frame_id: frame,
    timestamp,
    lifetime: timestamp,
    frame_locked: true,
    metadata: [],
    cubes: [],
    cylinders: [],
    triangles: [],
    spheres,
  };
}

/** A record of /telemetry with the given fields. */
export function record(tick: number, given: Partial<TelemetryRecord> = {}): TelemetryRecord {
  return { ...emptyRecord(), tick, ...given };
}

/** One second, with poses every 0.04 s. */
export function recorded(telemetry: TelemetryRecord[]): Recording {
  const framed = bodiesOf([
    entity('ball', 'ball'),
    entity('table', 'world'),
    entity('hand/palm', 'hand/palm'),
    entity('hand/finger', 'hand/finger'),
  ]);
  const moving = framed.filter(({ frame }) => frame !== 'world');
  const messages = Array.from({ length: 26 }, (_, k) => {
    const time = 0.04 * k;
    return {
      time,
      transforms: [
        { parent: 'world', child: 'ball', pose: [time, 0, 0, 0, 0, 0, 1] },
        { parent: 'world', child: 'hand/palm', pose: [0, time, 0, 0, 0, 0, 1] },
        { parent: 'hand/palm', child: 'hand/finger', pose: [0.1, 0, 0, 0, 0, Math.sin(time / 2), Math.cos(time / 2)] },
      ],
    };
  });
  return {
    info: new Map([['team', 'crabs']]),
    outcome: null,
    signed: false,
    tickS: 0.01,
    duration: 1,
    events: [],
    telemetry,
    actions: [
      { tick: 0, hand: [0], base: [] },
      { tick: 50, hand: [1], base: [] },
    ],
    scene: { bodies: framed.map(({ body }) => body), moving: moving.map(({ body }) => body.id), regions: [] },
    poses: new PoseTable(
      moving.map(({ frame }) => frame),
      messages,
    ),
  };
}
