/** The actions of one run as changes, sufficient to send the same again. */
import type { Push } from './messages';
import type { Action, Event as RunEvent, Opened, RunResult } from '../wire/messages';

/** A step: changed targets, kept for `ticks`. A push begins with the next tick. A gap was not recorded. */
export type Entry =
  | { kind: 'step'; ticks: number; action: Action }
  | { kind: 'push'; push: Push }
  | { kind: 'gap'; ticks: number };

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
  constructor(readonly run: Opened, readonly team: string, readonly begun: Date) {}

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
