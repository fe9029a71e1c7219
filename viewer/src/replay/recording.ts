/** A replay in memory: metadata, scene, and poses 30 times a second. */
import { McapIndexedReader } from '@mcap/core';
import { decompress } from 'fzstd';
import type { SceneInfo } from '../model/scene';
import type { ActionMessage, Event, RunResult, SceneEntity, SceneUpdate } from '../wire/messages';
import { bodiesOf } from './scene_update';
import { type FrameTransform, frameTransforms, telemetry } from './protobuf';
import type { TelemetryRecord } from '../wire/telemetry';
import { PoseTable } from './poses';

/** An event of the referee; `time` in s since the start. */
export interface RecordedEvent {
  tick: number;
  time: number;
  kind: string;
  object?: number;
}

/** The applied action of a tick. */
export interface RecordedAction {
  tick: number;
  hand: number[];
  base: number[];
}

/** The result in the file. */
export type RecordedOutcome = Pick<RunResult, 'score' | 'in_goal' | 'outside' | 'reason' | 'ticks' | 'events'>;

/** A complete replay. Times in s since the start of the run; `duration` includes the settling after the last action. */
export interface Recording {
  info: Map<string, string>;
  outcome: RecordedOutcome | null;
  signed: boolean;
  scene: SceneInfo;
  tickS: number;
  duration: number;
  poses: PoseTable;
  events: RecordedEvent[];
  actions: RecordedAction[];
  telemetry: TelemetryRecord[];
}

/** The file is not a replay; the message is for the page. */
export class InvalidReplay extends Error {}

const text = new TextDecoder();
const json = <T>(data: Uint8Array): T => JSON.parse(text.decode(data)) as T;

async function open(bytes: Uint8Array): Promise<McapIndexedReader> {
  try {
    return await McapIndexedReader.Initialize({
      readable: {
        size: () => Promise.resolve(BigInt(bytes.length)),
        read: (offset, length) => Promise.resolve(bytes.subarray(Number(offset), Number(offset) + Number(length))),
      },
      decompressHandlers: { zstd: (data) => decompress(data) },
    });
  } catch (error) {
    const why = error instanceof Error ? error.message : String(error);
    throw new InvalidReplay(`This is not a complete MCAP file: ${why}`);
  }
}

/** Reads a file; `progress` gets the finished share, 0 to 1. */
export async function readRecording(bytes: Uint8Array, progress: (done: number) => void = () => undefined): Promise<Recording> {
  const reader = await open(bytes);
  const records = new Map<string, Map<string, string>>();
  for await (const record of reader.readMetadata()) records.set(record.name, record.metadata);
  const info = records.get('palmares.run');
  if (!info) throw new InvalidReplay('This MCAP file was not recorded by Palmares: it has no metadata record palmares.run.');
  const begun = reader.statistics?.messageStartTime ?? 0n;
  const ended = reader.statistics?.messageEndTime ?? begun;
  const span = Math.max(Number(ended - begun) / 1e9, 1e-3);
  const tickS = Number(info.get('tick_s') ?? '0.01');

  let entities: SceneEntity[] = [];
  const frames: { time: number; transforms: FrameTransform[] }[] = [];
  const events: RecordedEvent[] = [];
  const actions: RecordedAction[] = [];
  const telemetries: TelemetryRecord[] = [];
  let count = 0;
  for await (const message of reader.readMessages()) {
    const topic = reader.channelsById.get(message.channelId)?.topic;
    const time = Number(message.logTime - begun) / 1e9;
    if (topic === '/tf') frames.push({ time, transforms: frameTransforms(message.data) });
    else if (topic === '/telemetry') telemetries.push(telemetry(message.data));
    else if (topic === '/scene') entities = json<SceneUpdate>(message.data).entities;
    else if (topic === '/event') {
      const event = json<Event>(message.data);
      events.push({ ...event, time: event.tick * tickS });
    } else if (topic === '/action') {
      const { tick, action } = json<ActionMessage>(message.data);
      const { base, hand } = action;
      actions.push({ tick, hand: hand ?? [], base: base && 'position' in base ? [...base.position, ...base.quat_xyzw] : [] });
    }
    count += 1;
    if (count % 2000 === 0) {
      progress(Math.min(time / span, 1));
      // Lets the browser redraw: a long run takes a second or two.
      await new Promise((resolve) => setTimeout(resolve));
    }
  }
  if (entities.length === 0) throw new InvalidReplay('This replay has no scene (topic /scene) to show.');

  const framed = bodiesOf(entities);
  const moving = framed.filter(({ frame }) => frame !== 'world');
  const poses = new PoseTable(
    moving.map(({ frame }) => frame),
    frames,
  );
  const start = poses.at(0);
  moving.forEach(({ body }, row) => {
    const at = start.subarray(7 * row, 7 * row + 7);
    body.position = [at[0] ?? 0, at[1] ?? 0, at[2] ?? 0];
    body.quat = [at[3] ?? 0, at[4] ?? 0, at[5] ?? 0, at[6] ?? 1];
  });
  const regions = records.get('palmares.scene')?.get('regions');
  const goals = records.get('palmares.scene')?.get('goals');
  const hand = records.get('palmares.hand')?.get('description');
  const readings = records.get('palmares.hand')?.get('readings');
  const result = records.get('palmares.result')?.get('outcome');
  const outcome = result ? (JSON.parse(result) as RecordedOutcome) : null;
  const scene: SceneInfo = {
    bodies: framed.map(({ body }) => body),
    moving: moving.map(({ body }) => body.id),
    regions: regions ? (JSON.parse(regions) as SceneInfo['regions']) : [],
    goals: goals ? (JSON.parse(goals) as string[]) : [],
  };
  if (hand) scene.hand = JSON.parse(hand) as NonNullable<SceneInfo['hand']>;
  if (readings) scene.readings = JSON.parse(readings) as NonNullable<SceneInfo['readings']>;
  // While the world settles after the last action, the referee still counts: the result has its events, the file has none.
  const all = outcome ? outcome.events.map((event): RecordedEvent => ({ ...event, time: event.tick * tickS })) : events;
  const lastTick = Math.max(
    outcome?.ticks ?? 0,
    (actions.at(-1)?.tick ?? -1) + 1,
    telemetries.at(-1)?.tick ?? 0,
    ...all.map(({ tick }) => tick),
    Math.round((frames.at(-1)?.time ?? 0) / tickS),
  );
  return {
    info,
    outcome,
    signed: records.has('palmares.signature'),
    scene,
    tickS,
    duration: lastTick * tickS,
    poses,
    events: all,
    actions,
    telemetry: telemetries,
  };
}
