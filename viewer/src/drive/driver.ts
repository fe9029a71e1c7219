/** One session at the control socket: opens runs, steps them in lockstep at the pace of the wall's clock, writes down what it sends. */
import type { HandDescription } from '../model/hand';
import { ControlSocket, ConnectionLost } from './control';
import type { Latency } from './latency';
import type { Ack, Observation, RunInfo, Push, ResetScene, Result, Welcome } from './messages';
import { Pace } from './pace';
import { ActionRecording } from './action_recording';
import { Targets } from './targets';

/** `closed`: no session; `over`: the run has ended, the session goes on. */
export type RunPhase = 'closed' | 'opening' | 'running' | 'paused' | 'ending' | 'over';

export interface DriverListener {
  phase(phase: RunPhase): void;
  opened(run: RunInfo, scene: ResetScene, first: Observation): void;
  observed(observation: Observation): void;
  ended(result: Result): void;
  /** Something was refused, or the connection is gone: in the server's words where it has some. */
  failed(message: string, lost: boolean): void;
  /** What the server finds odd about the name. */
  noted(message: string): void;
}

const sentence = (error: unknown): string => (error instanceof Error ? error.message : String(error));

export class Driver {
  phase: RunPhase = 'closed';
  welcome: Welcome | null = null;
  recording: ActionRecording | null = null;
  targets = new Targets([]);
  /** Simulated seconds a second. */
  factor = 1;
  tick = 0;
  private socket: ControlSocket | null = null;
  private pace = new Pace(10);
  private run: RunInfo | null = null;
  private flying: Promise<void> | null = null;

  constructor(private readonly told: DriverListener, private readonly latency: Latency) {}

  /** Greets, and opens the first run. `hand`: description of the hand that is asked for. */
  async connect(team: string, token: string | null, task: string, hand: HandDescription, seed: number | null): Promise<void> {
    this.set('opening');
    try {
      const socket = await ControlSocket.open(token);
      this.socket = socket;
      socket.onLost = (why) => { this.lost(why); };
      this.welcome = await socket.ask<Welcome>({ op: 'hello', client: { name: team, version: 'drive' } });
      if (this.welcome.note) this.told.noted(this.welcome.note);
    } catch (error) {
      this.disconnect();
      this.told.failed(sentence(error), false);
      return;
    }
    await this.reset(task, hand, seed);
  }

  /** Opens a run; one that is open is stopped and scored first. Without a seed the server draws one. */
  async reset(task: string, hand: HandDescription, seed: number | null): Promise<void> {
    const { socket } = this;
    if (!socket) return;
    await this.finish();
    await this.flying;
    if (this.socket !== socket) return;
    this.set('opening');
    try {
      const first = await socket.ask<Observation>({ op: 'reset', task, hand: hand.name, ...(seed === null ? {} : { seed }) });
      if (!first.run || !first.scene) throw new Error('The server opened a run without a scene.');
      this.run = first.run;
      this.tick = first.tick;
      this.pace = new Pace(1000 * first.run.tick_s);
      this.targets = new Targets(first.hand.actuators.map((actuator) => actuator.command));
      this.recording = new ActionRecording(first.run, this.welcome?.team ?? '', new Date());
      this.told.opened(first.run, first.scene, first);
      this.set('running');
    } catch (error) {
      if (error instanceof ConnectionLost) return;
      this.set('over');
      this.told.failed(sentence(error), false);
    }
  }

  pause(on: boolean): void {
    if (this.phase !== (on ? 'running' : 'paused')) return;
    this.pace.rest();
    this.set(on ? 'paused' : 'running');
  }

  /** Makes one tick of a paused run. */
  single(): void {
    if (this.phase === 'paused' && !this.flying) this.step(1);
  }

  /** Makes the ticks that are due. Called with every frame, and when the driver does something. */
  pump(): void {
    if (this.phase !== 'running' || this.flying || !this.welcome) return;
    const ticks = this.pace.due(performance.now(), this.factor, this.latency.waiting);
    if (ticks > 0) this.step(Math.min(ticks, this.welcome.limits.repeat));
  }

  /** Stops the run, whose objects settle and are counted. */
  async finish(): Promise<void> {
    if (this.phase !== 'running' && this.phase !== 'paused') return;
    this.set('ending');
    await this.flying;
    await this.stop();
  }

  /** Ends the session. */
  disconnect(): void {
    this.socket?.close();
    this.socket = null;
    this.set('closed');
  }

  private step(ticks: number): void {
    this.flying = this.exchange(ticks).catch((error: unknown) => {
      if (error instanceof ConnectionLost) return;
      // Nothing has changed in the world; the driver decides what to do.
      this.pause(true);
      this.told.failed(sentence(error), false);
    }).finally(() => {
      this.flying = null;
      if (this.latency.waiting) this.pump();
    });
  }

  /** The pushes and the step that carries what has changed, sent in one go and answered in order. */
  private async exchange(ticks: number): Promise<void> {
    const { socket, run, recording } = this;
    if (!socket || !run || !recording) return;
    const input = this.latency.take();
    const action = this.targets.changes();
    const pushes = this.targets.pushes(ticks * run.tick_s).map((push) => [push, this.perturb(socket, push)] as const);
    const stepped = socket.ask<Observation>({ op: 'step', tick: this.tick, repeat: ticks, action });
    // Whoever fails first is waited for in order; none of them may fail unheard.
    stepped.catch(() => undefined);
    for (const [push, taken] of pushes) if (await taken) recording.push(push);
    const observation = await stepped;
    recording.step(observation.tick - this.tick, action);
    recording.score = observation.score;
    this.tick = observation.tick;
    this.told.observed(observation);
    this.latency.answered(input);
    if (observation.terminated || observation.truncated) await this.stop();
  }

  /** Whether the server took a push. */
  private async perturb(socket: ControlSocket, push: Push): Promise<boolean> {
    const { link, force, torque, duration_s } = push;
    try {
      await socket.ask<Ack>({ op: 'perturb', link, wrench: { force, torque }, duration_s });
      return true;
    } catch (error) {
      if (!(error instanceof ConnectionLost)) this.told.failed(sentence(error), false);
      return false;
    }
  }

  private async stop(): Promise<void> {
    this.set('ending');
    try {
      const result = await this.socket?.ask<Result>({ op: 'stop' });
      if (!result) return;
      if (this.recording) this.recording.result = result;
      this.set('over');
      this.told.ended(result);
    } catch (error) {
      if (error instanceof ConnectionLost) return;
      this.set('over');
      this.told.failed(sentence(error), false);
    }
  }

  private lost(why: string): void {
    this.socket = null;
    this.set('closed');
    this.told.failed(why, true);
  }

  private set(phase: RunPhase): void {
    this.phase = phase;
    this.told.phase(phase);
  }
}
