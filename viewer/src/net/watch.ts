/** The watch socket: messages about a run for spectators. It reconnects by itself. docs/protocol.md describes it. */
import { type Moment, POSE } from '../model/moment';
import { type SceneInfo, sceneOf } from '../model/scene';
import type { Clock, ErrorReply, Event as RunEvent, Final, Poses, Verdict, WatchReply, WatchRun } from '../wire/messages';
import { FrameReader } from './decode';
import { isToken, NEEDS_TOKEN, NO_TOKEN, UNKNOWN_TOKEN } from './token';

/** The run to watch. */
export type WatchTarget = { session_id: string } | { run_id: string } | { featured: true };

/** Callbacks, in the order of the server's messages. */
export interface WatchListener {
  scene(scene: SceneInfo): void;
  moment(moment: Moment, at: number): void;
  score(score: number): void;
  events(events: RunEvent[]): void;
  clock(clock: Clock): void;
  verdicts(verdicts: Verdict[]): void;
  /** `fault`: the failure of the world, if it failed. */
  ended(outcome: Final | null, fault?: string): void;
  /** An organizer's announcement; an empty text removes it. */
  announcement?(text: string): void;
  runs(runs: WatchRun[]): void;
  /** `waiting`: no run is being played. */
  state(state: 'connecting' | 'watching' | 'waiting'): void;
  /** The server refused, with its message and code; there is no further attempt. */
  refused(message: string, code: string): void;
}

const MAX_WAIT_MS = 10_000;
const SUBSCRIBE = 1;
const LIST = 2;
/** Codes after which another attempt would fail too. */
const FINAL = new Set<string>(['not_authorized', 'forbidden', 'not_found']);

export class WatchSocket {
  private socket: WebSocket | null = null;
  private scene: SceneInfo | null = null;
  private frames: FrameReader | null = null;
  private wait = 500;
  private timer = 0;
  private over = false;
  /** Received bytes, for measurements. */
  received = 0;

  constructor(
    private readonly target: WatchTarget | null,
    private readonly listener: WatchListener,
    private token: string | null = null,
  ) {
    this.open();
  }

  /** Requests the open runs; the reply goes to `runs`. */
  list(): void {
    this.send({ op: 'list', id: LIST });
  }

  close(): void {
    this.over = true;
    window.clearTimeout(this.timer);
    this.socket?.close();
  }

  private open(): void {
    this.listener.state('connecting');
    if (this.token && !isToken(this.token)) {
      this.over = true;
      // After the constructor.
      queueMicrotask(() => this.listener.refused(NO_TOKEN, 'not_authorized'));
      return;
    }
    const address = new URL('/v1/watch', location.href);
    address.protocol = address.protocol.replace('http', 'ws');
    const protocols = ['palmares.v1.bin', 'palmares.v1.json'];
    // A page cannot send a header with a socket.
    if (this.token) protocols.push(`palmares.token.${this.token}`);
    const socket = new WebSocket(address, protocols);
    socket.binaryType = 'arraybuffer';
    this.socket = socket;
    let opened = false;
    socket.onopen = () => {
      opened = true;
      this.wait = 500;
      if (!this.target) return this.list();
      // Older servers have only the text protocol, which has no overlays.
      const overlays = socket.protocol === 'palmares.v1.bin' ? { overlays: ['telemetry', 'contacts', 'verdicts'] } : {};
      this.send({ op: 'subscribe', id: SUBSCRIBE, ...this.target, ...overlays });
    };
    socket.onmessage = (event: MessageEvent<string | ArrayBuffer>) => {
      if (typeof event.data === 'string') {
        this.received += event.data.length;
        this.take(JSON.parse(event.data) as WatchReply);
      } else {
        this.received += event.data.byteLength;
        this.frame(event.data);
      }
    };
    socket.onclose = (event) => {
      if (this.over) return;
      if (event.code === 4401) return this.giveUp('The token was revoked.', 'not_authorized');
      // A browser does not report why a handshake was refused: perhaps the token is invalid.
      if (this.token && !opened) void this.checkToken(this.token);
      this.listener.state('connecting');
      this.timer = window.setTimeout(() => this.open(), this.wait * (0.75 + Math.random() / 2));
      this.wait = Math.min(2 * this.wait, MAX_WAIT_MS);
    };
  }

  /** Checks over HTTP whether the server accepts the token. */
  private async checkToken(token: string): Promise<void> {
    try {
      const answer = await fetch('/v1/sessions', { headers: { Authorization: `Bearer ${token}` }, cache: 'no-store', credentials: 'omit' });
      if (answer.status === 401 && !this.over) this.giveUp(UNKNOWN_TOKEN, 'not_authorized');
    } catch {
      /* No answer: the socket reconnects. */
    }
  }

  private giveUp(message: string, code: string): void {
    this.close();
    this.listener.refused(message, code);
  }

  private frame(data: ArrayBuffer): void {
    try {
      const moment = this.frames?.read(data);
      if (moment) this.listener.moment(moment, performance.now());
    } catch (error) {
      this.giveUp(error instanceof Error ? error.message : String(error), 'bad_frame');
    }
  }

  private send(message: object): void {
    if (this.socket?.readyState === WebSocket.OPEN) this.socket.send(JSON.stringify(message));
  }

  private take(message: WatchReply): void {
    const { listener } = this;
    switch (message.op) {
      case 'subscribed':
        listener.state(message.run_id === null ? 'waiting' : 'watching');
        break;
      case 'runs':
        listener.runs(message.runs);
        break;
      case 'scene':
        this.scene = sceneOf(message);
        this.frames = new FrameReader(this.scene.moving.length, this.scene.run?.tick_s ?? 0.01);
        listener.state('watching');
        listener.scene(this.scene);
        break;
      case 'poses':
        this.poses(message);
        break;
      case 'score':
        listener.score(message.score);
        break;
      case 'events':
        listener.events(message.events);
        break;
      case 'clock':
        listener.clock(message);
        break;
      case 'verdicts':
        listener.verdicts(message.objects);
        break;
      case 'ended':
        listener.ended(message.outcome, message.fault);
        break;
      case 'announcement':
        listener.announcement?.(message.text);
        break;
      case 'error':
        this.refused(message);
        break;
    }
  }

  private poses(message: Poses): void {
    const poses = new Float32Array(POSE * message.poses.length);
    message.poses.forEach((pose, row) => poses.set(pose, POSE * row));
    this.listener.moment({ tick: message.tick, time: message.sim_time_s, score: null, poses }, performance.now());
  }

  private refused({ code, message }: ErrorReply): void {
    // The server's words about tokens are for programs.
    if (code === 'not_authorized') this.giveUp(this.token ? UNKNOWN_TOKEN : NEEDS_TOKEN, code);
    else if (FINAL.has(code)) this.giveUp(message, code);
    else this.listener.refused(message, code);
  }
}
