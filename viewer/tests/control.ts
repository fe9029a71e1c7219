/**
 * A control socket with the token in the header, as programs use it (a page cannot send headers): RFC 6455 over Node's
 * HTTP upgrade. Lengths in m, times in s.
 */
import { randomBytes } from 'node:crypto';
import { request } from 'node:http';
import type { Duplex } from 'node:stream';

export type Message = Record<string, unknown> & { op: string; id?: number; tick?: number; message?: string };

interface Waiting {
  resolve(message: Message): void;
  reject(error: Error): void;
}

const [TEXT, CLOSE, PING, PONG] = [1, 8, 9, 10];

/** A client's frame, which must be masked. */
function frame(kind: number, body: Buffer): Buffer {
  const mask = randomBytes(4);
  const head =
    body.length < 126
      ? Buffer.from([0x80 | kind, 0x80 | body.length])
      : Buffer.from([0x80 | kind, 0xfe, body.length >> 8, body.length & 255]);
  return Buffer.concat([head, mask, body.map((byte, k) => byte ^ (mask[k % 4] ?? 0))]);
}

export class Control {
  private readonly waiting = new Map<number, Waiting>();
  private kept = Buffer.alloc(0);
  private id = 0;
  private gone: string | null = null;
  tick = 0;
  /** Code of the close frame; null while the connection is open. */
  closed: number | null = null;

  private constructor(
    private readonly socket: Duplex,
    head: Buffer,
  ) {
    socket.on('data', (data: Buffer) => this.take(data));
    socket.on('error', () => undefined);
    socket.on('close', () => this.fail(`the connection was closed: ${this.closed}`));
    if (head.length > 0) this.take(head);
  }

  /** Connects; throws the HTTP status of a refusal. */
  static open(url: string, token?: string): Promise<Control> {
    return new Promise((resolve, reject) => {
      const upgrade = request(`${url}/v1/control`, {
        headers: {
          Connection: 'Upgrade',
          Upgrade: 'websocket',
          'Sec-WebSocket-Version': '13',
          'Sec-WebSocket-Key': randomBytes(16).toString('base64'),
          'Sec-WebSocket-Protocol': 'palmares.v1.json',
          ...(token === undefined ? {} : { Authorization: `Bearer ${token}` }),
        },
      });
      upgrade.on('upgrade', (_, socket, head) => resolve(new Control(socket, head)));
      upgrade.on('response', (answer) => {
        answer.resume();
        reject(new Error(`the handshake was answered with ${answer.statusCode}`));
      });
      upgrade.on('error', reject);
      upgrade.end();
    });
  }

  /** Sends a request and waits for the reply; throws the server's error. */
  ask(op: string, fields: object = {}): Promise<Message> {
    this.id += 1;
    const id = this.id;
    if (this.gone !== null) return Promise.reject(new Error(this.gone));
    return new Promise((resolve, reject) => {
      this.waiting.set(id, { resolve, reject });
      this.socket.write(frame(TEXT, Buffer.from(JSON.stringify({ op, id, ...fields }))));
    });
  }

  /** Steps `repeat` ticks with one action. */
  async step(repeat: number, action: object = {}): Promise<Message> {
    const seen = await this.ask('step', { tick: this.tick, repeat, action });
    this.tick = seen.tick ?? 0;
    return seen;
  }

  /** Sends hello and opens a run; returns its id. */
  async begin(team: string, task: string, more: object = {}): Promise<string> {
    await this.ask('hello', { client: { name: team } });
    return await this.again(task, more);
  }

  /** Opens a run; returns its id. */
  async again(task: string, more: object = {}): Promise<string> {
    const seen = await this.ask('reset', { task, hand: 'softhand', ...more });
    this.tick = 0;
    return seen['run_id'] as string;
  }

  end(): void {
    this.socket.end(frame(CLOSE, Buffer.from([3, 232])));
  }

  private take(data: Buffer): void {
    this.kept = Buffer.concat([this.kept, data]);
    for (;;) {
      let [from, length] = [2, (this.kept[1] ?? 0) & 127];
      if (this.kept.length < 2) return;
      if (length === 126 && this.kept.length >= 4) [from, length] = [4, this.kept.readUInt16BE(2)];
      else if (length === 127 && this.kept.length >= 10) [from, length] = [10, Number(this.kept.readBigUInt64BE(2))];
      else if (length > 125) return;
      if (this.kept.length < from + length) return;
      const [kind, body] = [(this.kept[0] ?? 0) & 15, this.kept.subarray(from, from + length)];
      this.kept = this.kept.subarray(from + length);
      if (kind === PING) this.socket.write(frame(PONG, body));
      else if (kind === CLOSE) {
        this.closed = body.length >= 2 ? body.readUInt16BE(0) : 1005;
        this.socket.end();
      } else if (kind === TEXT) this.read(JSON.parse(body.toString()) as Message);
    }
  }

  private read(message: Message): void {
    const waiting = message.id === undefined ? undefined : this.waiting.get(message.id);
    if (message.id !== undefined) this.waiting.delete(message.id);
    if (message.op === 'error') waiting?.reject(new Error(`${String(message['code'])}: ${message.message}`));
    else waiting?.resolve(message);
  }

  private fail(why: string): void {
    this.gone = why;
    for (const one of this.waiting.values()) one.reject(new Error(why));
    this.waiting.clear();
  }
}

/** Seed of a scene of the task `grasp` with an apple, and the pose of the SoftHand's base for its grasp. */
export const APPLE = 2;
const [X, Y, Z] = [0.0278, -0.1314, 0.0893];
const quat_xyzw = [-0.4244, 0.6061, 0.5511, 0.3859];

/** Grasps the apple of a run with seed `APPLE`, lifts it and holds it: 60 ticks give one point, 260 give four. */
export async function grasp(control: Control, ticks: number): Promise<void> {
  const at = (height: number): object => ({ position: [X, Y, Z + height], quat_xyzw });
  await control.step(100, { base: at(0.12), hand: [0.02] });
  await control.step(50, { base: at(0) });
  await control.step(100, { hand: [0.9] });
  await control.step(20);
  await control.step(60, { base: at(0.16) });
  for (let left = ticks; left > 0; left -= 100) await control.step(Math.min(left, 100));
}

/** A run that continues during a test, at about real time: the hand moves down into the box and up. `stop` ends it. */
export async function playing(
  url: string,
  team: string,
  token?: string,
): Promise<{ run: string; over: Promise<void>; control: Control; stop(): Promise<void> }> {
  const control = await Control.open(url, token);
  const run = await control.begin(team, 'balls');
  let on = true;
  const play = async (): Promise<void> => {
    while (on) {
      const z = 0.55 + 0.2 * Math.cos(control.tick / 60);
      await control.step(2, { base: { position: [0.15 * Math.sin(control.tick / 90), 0, z], quat_xyzw: [0, 1, 0, 0] }, hand: [0.5] });
      await new Promise((go) => setTimeout(go, 20));
    }
  };
  const over = play();
  over.catch(() => undefined);
  return {
    run,
    over,
    control,
    stop: async () => {
      on = false;
      await over.catch(() => undefined);
      if (control.closed === null) await control.ask('stop').catch(() => undefined);
      control.end();
    },
  };
}
