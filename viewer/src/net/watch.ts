/** The watch socket: what spectators are told of a run, opened again when it breaks. docs/protocol.md describes it. */
import { type Moment, POSE } from '../model/moment';
import { type SceneInfo, sceneOf } from '../model/scene';
import type { Clock, ErrorReply, Event as RunEvent, Final, Poses, Verdict, WatchReply, WatchRun } from '../wire/messages';
import { FrameReader } from './decode';

/** What to show. */
export type WatchTarget = { session_id: string } | { run_id: string } | { featured: true };

/** What happens; all are called in the order in which the server tells it. */
export interface WatchListener {
  scene(scene: SceneInfo): void;
  moment(moment: Moment, at: number): void;
  score(score: number): void;
  events(events: RunEvent[]): void;
  clock(clock: Clock): void;
  verdicts(verdicts: Verdict[]): void;
  /** `fault`: what the world failed of, if it did. */
  ended(outcome: Final | null, fault?: string): void;
  /** An organizer told everybody something; an empty text takes it away. */
  announcement?(text: string): void;
  runs(runs: WatchRun[]): void;
  /** `waiting`: nothing is played there now. */
  state(state: 'connecting' | 'watching' | 'waiting'): void;
  /** Refused, and not tried again: what the server says, and its code. */
  refused(message: string, code: string): void;
}

const LONGEST_WAIT_MS = 10_000;
const SUBSCRIBE = 1;
const LIST = 2;
/** Codes after which trying again changes nothing. */
const FINAL = new Set<string>(['not_authorized', 'forbidden', 'not_found']);

export class WatchSocket {
  private socket: WebSocket | null = null;
  private scene: SceneInfo | null = null;
  private frames: FrameReader | null = null;
  private wait = 500;
  private timer = 0;
  private over = false;
  /** Bytes that have come, for those who measure. */
  received = 0;

  constructor(private readonly target: WatchTarget | null, private readonly listener: WatchListener, private token: string | null = null) {
    this.open();
  }

  /** Asks for the open runs; the answer goes to `runs`. */
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
      // The text protocol of older servers knows no overlays.
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
      // A browser does not tell why a handshake was refused: the token may be no good.
      if (this.token && !opened) void this.examine(this.token);
      this.listener.state('connecting');
      this.timer = window.setTimeout(() => { this.open(); }, this.wait * (0.75 + Math.random() / 2));
      this.wait = Math.min(2 * this.wait, LONGEST_WAIT_MS);
    };
  }

  /** Asks over HTTP whether the server knows the token at all. */
  private async examine(token: string): Promise<void> {
    try {
      const answer = await fetch('/v1/sessions', { headers: { Authorization: `Bearer ${token}` }, cache: 'no-store', credentials: 'omit' });
      if (answer.status === 401 && !this.over) this.giveUp('The server does not know this token, or it was revoked.', 'not_authorized');
    } catch { /* Nobody answers: the socket is tried again. */ }
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
      case 'subscribed': listener.state(message.run_id === null ? 'waiting' : 'watching'); break;
      case 'runs': listener.runs(message.runs); break;
      case 'scene':
        this.scene = sceneOf(message);
        this.frames = new FrameReader(this.scene.moving.length, this.scene.run?.tick_s ?? 0.01);
        listener.state('watching');
        listener.scene(this.scene);
        break;
      case 'poses': this.poses(message); break;
      case 'score': listener.score(message.score); break;
      case 'events': listener.events(message.events); break;
      case 'clock': listener.clock(message); break;
      case 'verdicts': listener.verdicts(message.objects); break;
      case 'ended': listener.ended(message.outcome, message.fault); break;
      case 'announcement': listener.announcement?.(message.text); break;
      case 'error': this.refused(message); break;
    }
  }

  private poses(message: Poses): void {
    const poses = new Float32Array(POSE * message.poses.length);
    message.poses.forEach((pose, row) => { poses.set(pose, POSE * row); });
    this.listener.moment({ tick: message.tick, time: message.sim_time_s, score: null, poses }, performance.now());
  }

  private refused({ code, message }: ErrorReply): void {
    if (FINAL.has(code)) this.giveUp(message, code);
    else this.listener.refused(message, code);
  }
}
