import { describe, expect, it } from 'vitest';
import { FrameReader, unpackQuaternion } from './decode';

function pack(q: number[]): number {
  const largest = q.reduce((best, x, k) => (Math.abs(x) > Math.abs(q[best] ?? 0) ? k : best), 0);
  const sign = (q[largest] ?? 1) < 0 ? -1 : 1;
  const bits = q.filter((_, k) => k !== largest).map((x) => Math.round(((x * sign * Math.SQRT2 + 1) / 2) * 1023));
  return ((largest << 30) | ((bits[0] ?? 0) << 20) | ((bits[1] ?? 0) << 10) | (bits[2] ?? 0)) >>> 0;
}

describe('packed quaternions', () =>
  it('are within 0.25 degrees of what was packed, wherever they point', () => {
    let state = 1;
    const random = (): number => {
      state = (state * 48271) % 2147483647;
      return state / 2147483647 - 0.5;
    };
    for (let k = 0; k < 2000; k += 1) {
      const raw = [random(), random(), random(), random()];
      const norm = Math.hypot(...raw);
      const q = raw.map((x) => x / norm);
      const back = unpackQuaternion(pack(q));
      const dot = Math.min(1, Math.abs(q.reduce((sum, x, i) => sum + x * (back[i] ?? 0), 0)));
      expect((2 * Math.acos(dot) * 180) / Math.PI).toBeLessThan(0.25);
    }
  }));

describe('frames', () => {
  function frame(flags: number, bodies: [number, number[]][], tail: number[] = []): ArrayBuffer {
    const data = new ArrayBuffer(12 + 18 * bodies.length + tail.length);
    const view = new DataView(data);
    view.setUint8(0, 1);
    view.setUint8(1, flags);
    view.setUint16(2, bodies.length, true);
    view.setUint32(4, 250, true);
    view.setFloat32(8, 1.5, true);
    bodies.forEach(([place, xyz], k) => {
      const at = 12 + 18 * k;
      view.setUint16(at, place, true);
      xyz.forEach((x, i) => view.setFloat32(at + 2 + 4 * i, x, true));
      view.setUint32(at + 14, pack([0, 0, 0, 1]), true);
    });
    tail.forEach((byte, k) => view.setUint8(12 + 18 * bodies.length + k, byte));
    return data;
  }

  it('tell of what moved; the rest stays', () => {
    const reader = new FrameReader(2, 0.01);
    expect(reader.read(frame(0, [[1, [9, 9, 9]]]))).toBeNull();
    const first = reader.read(
      frame(1, [
        [0, [1, 2, 3]],
        [1, [4, 5, 6]],
      ]),
    );
    const second = reader.read(frame(0, [[1, [4, 5, 7]]]));
    expect(second?.time).toBeCloseTo(2.5);
    expect(second?.score).toBe(1.5);
    expect([...(second?.poses.slice(0, 3) ?? [])]).toEqual([1, 2, 3]);
    expect(second?.poses[9]).toBe(7);
    expect(first?.poses[9]).toBe(6);
  });

  it('tell what the hand feels', () => {
    const floats = (...all: number[]): number[] => [...new Uint8Array(new Float32Array(all).buffer)];
    const tail = [
      1,
      ...floats(1, 0.5, 2),
      1,
      ...floats(2),
      1,
      ...floats(0.1),
      0,
      1,
      ...floats(0.25),
      1,
      ...floats(1, 0, 0, 0, 0, 3),
      2,
      0,
      ...floats(0, 0, 1, 0, 0, 4),
    ];
    const felt = new FrameReader(0, 0.01).read(frame(11, [], tail))?.telemetry;
    expect(felt?.motors).toEqual([{ command: 1, position: 0.5, tension: 2, work: 0.25 }]);
    expect(felt?.predicted).toBeNull();
    expect(felt?.fingers).toEqual([{ force: [1, 0, 0], torque: [0, 0, 3] }]);
    expect(felt?.touch).toEqual([
      [0, 0, 1],
      [0, 0, 4],
    ]);
  });

  it('have the readings of sensors', () => {
    const floats = (...all: number[]): number[] => [...new Uint8Array(new Float32Array(all).buffer)];
    const tail = [0, 0, 0, 0, 2, 0, ...floats(0.5, -3)];
    expect(new FrameReader(0, 0.01).read(frame(19, [], tail))?.telemetry?.readings).toEqual([0.5, -3]);
  });

  it('of another version are refused, cut ones too', () => {
    const other = frame(1, []);
    new DataView(other).setUint8(0, 2);
    expect(() => new FrameReader(0, 0.01).read(other)).toThrow(/version 2/);
    expect(() => new FrameReader(1, 0.01).read(frame(1, [[0, [1, 2, 3]]]).slice(0, 20))).toThrow();
  });
});
