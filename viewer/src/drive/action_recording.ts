/** The actions of one run as changes, sufficient to send the same again. */
import type { Push } from './messages';
import type { Action, Event as RunEvent, Opened, RunResult } from '../wire/messages';

/** A step: changed targets, kept for `ticks`. A push begins with the next tick. A gap was not recorded. */
export type Entry = { kind: 'step'; ticks: number; action: Action } | { kind: 'push'; push: Push } | { kind: 'gap'; ticks: number };

/** A recording as JSON. */
export interface ActionRecordingState {
  run: Opened;
  team: string;
  begun: number;
  entries: Entry[];
  events: ActionRecording['events'];
  ticks: number;
  score: number;
  targets: Action;
  on: boolean;
}

export class ActionRecording {
  readonly entries: Entry[] = [];
  readonly events: (RunEvent & { name: string | null })[] = [];
  /** Ticks of the run up to now. */
  ticks = 0;
  score = 0;
  /** RunResult of the run; null while it continues, or after a lost connection. */
  result: RunResult | null = null;
  /** The current targets. */
  private readonly targets: Action = {};
  private on = true;

  /** `team`: the name in the session. */
  constructor(
    readonly run: Opened,
    readonly team: string,
    readonly begun: Date,
  ) {}

  /** Continues a recording of an earlier page. */
  static of(state: ActionRecordingState): ActionRecording {
    const made = new ActionRecording(state.run, state.team, new Date(state.begun));
    made.entries.push(...state.entries);
    made.events.push(...state.events);
    Object.assign(made.targets, state.targets);
    [made.ticks, made.score, made.on] = [state.ticks, state.score, state.on];
    return made;
  }

  get state(): ActionRecordingState {
    const { run, team, entries, events, ticks, score, targets, on } = this;
    return { run, team, begun: this.begun.getTime(), entries, events, ticks, score, targets, on };
  }

  /** Adds ticks that nobody recorded. */
  gap(ticks: number): void {
    this.ticks += ticks;
    this.entries.push({ kind: 'gap', ticks });
  }

  get recording(): boolean {
    return this.on;
  }

  /** Whether the recording has no gaps, so that it replays to the same run. */
  get whole(): boolean {
    return this.entries.every((entry) => entry.kind !== 'gap');
  }

  get pushed(): boolean {
    return this.entries.some((entry) => entry.kind === 'push');
  }

  /** Switches recording on or off; when it resumes it records the current targets. */
  record(on: boolean): void {
    if (on && !this.on) this.entries.push({ kind: 'step', ticks: 0, action: { ...this.targets } });
    this.on = on;
  }

  /** Records a step of `ticks` with its changed targets. */
  step(ticks: number, action: Action): void {
    Object.assign(this.targets, action);
    this.ticks += ticks;
    const last = this.entries.at(-1);
    if (!this.on) {
      if (last?.kind === 'gap') last.ticks += ticks;
      else this.entries.push({ kind: 'gap', ticks });
    } else if (last?.kind === 'step' && (last.ticks === 0 || (!action.base && !action.hand))) {
      Object.assign(last.action, action);
      last.ticks += ticks;
    } else {
      this.entries.push({ kind: 'step', ticks, action });
    }
  }

  /** Records a push that the server accepted. */
  push(push: Push): void {
    if (this.on) this.entries.push({ kind: 'push', push });
  }
}
