import { McapWriter, TempBuffer, type McapTypes } from '@mcap/core';
import { PbfWriter } from 'pbf';
import { describe, expect, it } from 'vitest';
import { entity } from './fixture';
import { InvalidReplay, readRecording } from './recording';

const TICKS = 2100;
const EVENTS = [
  { tick: 40, kind: 'in_goal', object: 0 },
  { tick: TICKS + 2, kind: 'in_goal', object: 1 },
];

/** Bytes as a zstd frame of one block that is not compressed. */
function zstd(data: Uint8Array): Uint8Array {
  const head = new DataView(new ArrayBuffer(12));
  head.setUint32(0, 0xfd2fb528, true);
  head.setUint8(4, 0xa0);
  head.setUint32(5, data.length, true);
  head.setUint8(9, ((data.length << 3) | 1) & 0xff);
  head.setUint16(10, data.length >> 5, true);
  return new Uint8Array([...new Uint8Array(head.buffer), ...data]);
}

/** `foxglove.FrameTransforms` of one frame. */
function transform(into: PbfWriter, parent: string, child: string, pose: number[]): void {
  const doubles = (numbers: number[], pbf: PbfWriter): void => {
    numbers.forEach((number, k) => {
      pbf.writeDoubleField(k + 1, number);
    });
  };
  into.writeMessage(
    1,
    (_, pbf) => {
      pbf.writeStringField(2, parent);
      pbf.writeStringField(3, child);
      pbf.writeMessage(4, doubles, pose.slice(0, 3));
      pbf.writeMessage(5, doubles, pose.slice(3));
    },
    null,
  );
}

/** A replay as the server writes them: the ball goes 2 m/s along x, the finger is 0.1 m before a palm that is turned a quarter. */
async function made(metadata: McapTypes.Metadata[]): Promise<Uint8Array> {
  const writable = new TempBuffer();
  const writer = new McapWriter({
    writable,
    chunkSize: 1 << 15,
    compressChunk: (data) => ({ compression: 'zstd', compressedData: zstd(data) }),
  });
  await writer.start({ profile: '', library: '' });
  const channels = new Map<string, number>();
  for (const topic of ['/scene', '/tf', '/action', '/event', '/telemetry']) {
    channels.set(topic, await writer.registerChannel({ schemaId: 0, topic, messageEncoding: '', metadata: new Map() }));
  }
  const add = async (topic: string, tick: number, data: Uint8Array | object): Promise<void> => {
    const time = 5_000_000_000n + BigInt(tick) * 10_000_000n;
    const encoded = data instanceof Uint8Array ? data : new TextEncoder().encode(JSON.stringify(data));
    await writer.addMessage({ channelId: channels.get(topic) ?? -1, sequence: 0, logTime: time, publishTime: time, data: encoded });
  };
  const entities = [
    entity('ball', 'ball'),
    entity('table', 'world'),
    entity('hand/palm', 'hand/palm'),
    entity('hand/finger', 'hand/finger'),
  ];
  await add('/scene', 0, { entities });
  for (let tick = 0; tick < TICKS; tick += 1) {
    await add('/action', tick, { tick, action: { base: { position: [tick, 0, 0], quat_xyzw: [0, 0, 0, 1] }, hand: [tick / TICKS] } });
    if (tick % 50 > 0) continue;
    const transforms = new PbfWriter();
    transform(transforms, 'world', 'ball', [0.02 * tick, 0, 0, 0, 0, 0, 1]);
    transform(transforms, 'world', 'hand/palm', [0, 0.5, 0, 0, 0, Math.SQRT1_2, Math.SQRT1_2]);
    transform(transforms, 'hand/palm', 'hand/finger', [0.1, 0, 0, 0, 0, 0, 1]);
    await add('/tf', tick, transforms.finish());
  }
  const telemetry = new PbfWriter();
  telemetry.writeVarintField(2, 7);
  telemetry.writeDoubleField(3, 1.5);
  telemetry.writePackedFloat(8, [0.25, -0.5]);
  telemetry.writePackedVarint(10, [0, 300]);
  await add('/telemetry', 7, telemetry.finish());
  await add('/event', 40, EVENTS[0] ?? {});
  for (const record of metadata) await writer.addMetadata(record);
  await writer.end();
  return writable.get();
}

const record = (name: string, given: Record<string, string>): McapTypes.Metadata => ({ name, metadata: new Map(Object.entries(given)) });
const OUTCOME = { score: 1.5, in_goal: 2, outside: 0, reason: 'stopped', ticks: TICKS, events: EVENTS };
const replay = made([
  record('palmares.run', { tick_s: '0.01', team: 'crabs' }),
  record('palmares.scene', { goals: '["in the bin"]' }),
  record('palmares.result', { outcome: JSON.stringify(OUTCOME) }),
  record('palmares.signature', {}),
]);

describe('a file', () => {
  it('that is not MCAP is refused with a message', async () => {
    await expect(readRecording(new TextEncoder().encode('not a replay at all'))).rejects.toThrow(InvalidReplay);
    await expect(readRecording(new Uint8Array())).rejects.toThrow(/not a complete MCAP file/);
  });

  it('of another program is refused with a message', async () => {
    await expect(readRecording(await made([]))).rejects.toThrow(/not recorded by Palmares/);
  });

  it('of a run is read', async () => {
    const progress: number[] = [];
    const { info, outcome, signed, scene, tickS, duration, poses, events, actions, telemetry } = await readRecording(await replay, (done) =>
      progress.push(done),
    );
    expect([info.get('team'), outcome, signed, tickS]).toEqual(['crabs', OUTCOME, true, 0.01]);
    expect(scene.bodies.map(({ name }) => name)).toEqual(['ball', 'table', 'palm', 'finger']);
    expect([scene.moving, scene.goals, scene.regions]).toEqual([[0, 2, 3], ['in the bin'], []]);
    // The second event is of the time in which the world settles: the file has no message of it.
    expect(duration).toBeCloseTo(0.01 * (TICKS + 2));
    expect(events).toEqual(EVENTS.map((event) => ({ ...event, time: event.tick * 0.01 })));
    expect(actions).toHaveLength(TICKS);
    expect(actions[21]).toEqual({ tick: 21, hand: [0.01], base: [21, 0, 0, 0, 0, 0, 1] });
    expect(poses.times).toHaveLength(TICKS / 50);
    for (const [place, expected] of [
      [0, [20, 0, 0, 0, 0, 0, 1]],
      [7, [0, 0.5, 0, 0, 0, Math.SQRT1_2, Math.SQRT1_2]],
      [14, [0, 0.6, 0, 0, 0, Math.SQRT1_2, Math.SQRT1_2]],
    ] as const) {
      expected.forEach((number, k) => {
        expect(poses.at(10)[place + k]).toBeCloseTo(number, 5);
      });
    }
    expect(scene.bodies[3]?.position[1]).toBeCloseTo(0.6);
    expect(telemetry).toMatchObject([{ tick: 7, score: 1.5, q: [0.25, -0.5], contact_a: [0, 300] }]);
    expect(progress).toHaveLength(1);
    expect(progress[0]).toBeGreaterThan(0.9);
  });

  it('that is truncated is refused with a message', async () => {
    const bytes = await replay;
    await expect(readRecording(bytes.subarray(0, bytes.length / 2))).rejects.toThrow(InvalidReplay);
  });
});
