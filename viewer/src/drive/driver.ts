/** One session on the control socket: opens runs, steps them in lockstep at the pace of the wall clock, records the actions. */
import { ControlSocket, ConnectionLost } from './control';
import type { Latency } from './latency';
import type { Push } from './messages';
import { Pace } from './pace';
import { ActionRecording } from './action_recording';
import type { KeptRun } from './kept';
import { Targets } from './targets';
import type { Ack, HandDescription, Obs, Opened, RunResult, Scene, Welcome } from '../wire/messages';

/** `closed`: no session; `over`: the run has ended, the session continues. */
export type RunPhase = 'closed' | 'opening' | 'running' | 'paused' | 'ending' | 'over';

export interface DriverListener {
  phase(phase: RunPhase): void;
  opened(run: Opened, scene: Scene, first: Obs): void;
  observed(observation: Obs): void;
  ended(result: RunResult): void;
  /** A request was refused, or the connection is lost; the server's message if there is one. */
  failed(message: string, lost: boolean): void;
  /** A note of the server about the name. */
  noted(message: string): void;
}

const sentence = (error: unknown): string => (error instanceof Error ? error.message : String(error));

export class Driver {
  phase: RunPhase = 'closed';
  welcome: Welcome | null = null;
  recording: ActionRecording | null = null;
  targets = new Targets([]);
  /** Simulated seconds per second. */
  factor = 1;
  tick = 0;
  private socket: ControlSocket | null = null;
  private pace = new Pace(10);
  private run: Opened | null = null;
  private scene: Scene | null = null;
  private newest: Obs | null = null;
  /** The step without an answer yet. */
  private sent: KeptRun['sent'] = null;
  private inFlight: Promise<void> | null = null;

  constructor(
    private readonly listener: DriverListener,
    private readonly latency: Latency,
  ) {}

  /** Connects, and opens the first run. `hand`: description of the hand. */
  async connect(team: string, token: string | null, task: string, hand: HandDescription, seed: number | null): Promise<void> {
    this.set('opening');
    try {
      const socket = await ControlSocket.open(token);
      this.socket = socket;
      socket.onLost = (why) => this.lost(why);
      this.welcome = await socket.ask<Welcome>({ op: 'hello', client: { name: team, version: 'drive' } });
      if (this.welcome.note) this.listener.noted(this.welcome.note);
    } catch (error) {
      this.disconnect();
      this.listener.failed(sentence(error), false);
      return;
    }
    await this.reset(task, hand, seed);
  }

  /** The open run, for the next page of this tab; null if there is none. `hand`: its description. */
  keep(hand: HandDescription): KeptRun | null {
    const { welcome, run, scene, newest, recording, sent, factor, phase } = this;
    if (!this.socket || !welcome || !run || !scene || !newest || !recording || (phase !== 'running' && phase !== 'paused')) return null;
    return {
      resume_token: welcome.resume_token,
      team: welcome.team,
      task: run.task,
      hand,
      run,
      scene,
      observation: newest,
      recording: recording.state,
      targets: this.targets.sent,
      sent,
      paused: phase === 'paused',
      factor,
    };
  }

  /** Closes the connection; the server waits a while for the next page. */
  leave(): void {
    this.socket?.leave();
    this.socket = null;
  }

  /** Continues the run of an earlier page of this tab; returns whether it is still open. */
  async resume(kept: KeptRun): Promise<boolean> {
    this.set('opening');
    try {
      const socket = await ControlSocket.open(null);
      this.socket = socket;
      const welcome = await socket.ask<Welcome>({
        op: 'hello',
        client: { name: kept.team, version: 'drive' },
        resume_token: kept.resume_token,
      });
      if (!welcome.run?.open || welcome.run.run_id !== kept.observation.run_id) {
        this.disconnect();
        return false;
      }
      this.welcome = welcome;
      socket.onLost = (why) => this.lost(why);
      const { run, scene, observation, sent } = kept;
      [this.run, this.scene, this.newest, this.factor, this.tick] = [run, scene, observation, kept.factor, welcome.run.tick];
      this.pace = new Pace(1000 * run.tick_s);
      this.targets = Targets.of(kept.targets);
      this.recording = ActionRecording.of(kept.recording);
      // The server may have made the step whose answer the last page did not receive.
      const ahead = welcome.run.tick - observation.tick;
      if (ahead > 0 && ahead === sent?.ticks) this.recording.step(ahead, sent.action);
      else if (ahead > 0) this.recording.gap(ahead);
      this.listener.opened(run, scene, observation);
      this.set(kept.paused ? 'paused' : 'running');
      return true;
    } catch {
      this.disconnect();
      return false;
    }
  }

  /** Opens a run; the open run is stopped and scored first. Without a seed the server chooses one. */
  async reset(task: string, hand: HandDescription, seed: number | null): Promise<void> {
    const { socket } = this;
    if (!socket) return;
    await this.finish();
    await this.inFlight;
    if (this.socket !== socket) return;
    this.set('opening');
    try {
      const first = await socket.ask<Obs>({ op: 'reset', task, hand: hand.name, ...(seed === null ? {} : { seed }) });
      if (!first.run || !first.scene) throw new Error('The server opened a run without a scene.');
      [this.run, this.scene, this.newest] = [first.run, first.scene, first];
      this.tick = first.tick;
      this.pace = new Pace(1000 * first.run.tick_s);
      this.targets = new Targets(first.hand.actuators.map((actuator) => actuator.command));
      this.recording = new ActionRecording(first.run, this.welcome?.team ?? '', new Date());
      this.listener.opened(first.run, first.scene, first);
      this.set('running');
    } catch (error) {
      if (error instanceof ConnectionLost) return;
      this.set('over');
      this.listener.failed(sentence(error), false);
    }
  }

  pause(on: boolean): void {
    if (this.phase !== (on ? 'running' : 'paused')) return;
    this.pace.rest();
    this.set(on ? 'paused' : 'running');
  }

  /** Steps a paused run by one tick. */
  single(): void {
    if (this.phase === 'paused' && !this.inFlight) this.step(1);
  }

  /** Steps the ticks that are due. Called with each frame and each input. */
  pump(): void {
    if (this.phase !== 'running' || this.inFlight || !this.welcome) return;
    const ticks = this.pace.due(performance.now(), this.factor, this.latency.waiting);
    if (ticks > 0) this.step(Math.min(ticks, this.welcome.limits.repeat));
  }

  /** Stops the run: its objects settle and are counted. */
  async finish(): Promise<void> {
    if (this.phase !== 'running' && this.phase !== 'paused') return;
    this.set('ending');
    await this.inFlight;
    await this.stop();
  }

  /** Ends the session. */
  disconnect(): void {
    this.socket?.close();
    this.socket = null;
    this.set('closed');
  }

  private step(ticks: number): void {
    this.inFlight = this.exchange(ticks)
      .catch((error: unknown) => {
        if (error instanceof ConnectionLost) return;
        // The refused step changed nothing; the run is paused until the next input.
        this.pause(true);
        this.listener.failed(sentence(error), false);
      })
      .finally(() => {
        this.inFlight = null;
        if (this.latency.waiting) this.pump();
      });
  }

  /** Sends the pushes and the step with the changed targets together; the replies come in order. */
  private async exchange(ticks: number): Promise<void> {
    const { socket, run, recording } = this;
    if (!socket || !run || !recording) return;
    const input = this.latency.take();
    const action = this.targets.changes();
    const pushes = this.targets.pushes(ticks * run.tick_s).map((push) => [push, this.perturb(socket, push)] as const);
    this.sent = { ticks, action };
    const stepped = socket.ask<Obs>({ op: 'step', tick: this.tick, repeat: ticks, action });
    // The pushes are awaited first: without this the step's error could be an unhandled rejection.
    stepped.catch(() => undefined);
    for (const [push, taken] of pushes) if (await taken) recording.push(push);
    const observation = await stepped;
    [this.sent, this.newest] = [null, observation];
    recording.step(observation.tick - this.tick, action);
    recording.score = observation.score;
    this.tick = observation.tick;
    this.listener.observed(observation);
    this.latency.answered(input);
    if (observation.terminated || observation.truncated) await this.stop();
  }

  /** Sends a push; returns whether the server accepted it. */
  private async perturb(socket: ControlSocket, push: Push): Promise<boolean> {
    const { link, force, torque, duration_s } = push;
    try {
      await socket.ask<Ack>({ op: 'perturb', link, wrench: { force, torque }, duration_s });
      return true;
    } catch (error) {
      if (!(error instanceof ConnectionLost)) this.listener.failed(sentence(error), false);
      return false;
    }
  }

  private async stop(): Promise<void> {
    this.set('ending');
    try {
      const result = await this.socket?.ask<RunResult>({ op: 'stop' });
      if (!result) return;
      if (this.recording) this.recording.result = result;
      this.set('over');
      this.listener.ended(result);
    } catch (error) {
      if (error instanceof ConnectionLost) return;
      this.set('over');
      this.listener.failed(sentence(error), false);
    }
  }

  private lost(why: string): void {
    this.socket = null;
    this.set('closed');
    this.listener.failed(why, true);
  }

  private set(phase: RunPhase): void {
    this.phase = phase;
    this.listener.phase(phase);
  }
}
