/** What was sent in one run, tick by tick, as changes: enough to send the same again. */
import type { RunEvent } from '../net/watch';
import type { Action, RunInfo, Push, Result } from './messages';

/** A change and for how many ticks nothing else changed; a push begins with the tick that follows; a gap was not recorded. */
export type Entry =
  | { kind: 'step'; ticks: number; action: Action }
  | { kind: 'push'; push: Push }
  | { kind: 'gap'; ticks: number };

export class ActionRecording {
  readonly entries: Entry[] = [];
  readonly events: (RunEvent & { name: string | null })[] = [];
  /** Ticks of the run so far. */
  ticks = 0;
  score = 0;
  /** How the run ended; null while it goes on, or when the connection broke. */
  result: Result | null = null;
  /** The targets as they stand. */
  private readonly standing: Action = {};
  private on = true;

  /** `team`: the name under which it was driven. */
  constructor(readonly run: RunInfo, readonly team: string, readonly begun: Date) {}

  get recording(): boolean {
    return this.on;
  }

  /** Whether playing it again gives the same run: nothing is left out. */
  get whole(): boolean {
    return this.entries.every((entry) => entry.kind !== 'gap');
  }

  get pushed(): boolean {
    return this.entries.some((entry) => entry.kind === 'push');
  }

  /** Switches recording; what stands when it goes on again is written down then. */
  record(on: boolean): void {
    if (on && !this.on) this.entries.push({ kind: 'step', ticks: 0, action: { ...this.standing } });
    this.on = on;
  }

  /** A step of `ticks` that was made, with the changes it carried. */
  step(ticks: number, action: Action): void {
    Object.assign(this.standing, action);
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

  /** A push that the server took. */
  push(push: Push): void {
    if (this.on) this.entries.push({ kind: 'push', push });
  }
}
