/** From a driver's input to the first frame drawn with a pose of a later tick, ms: for those who measure. */

/** Newest ones that are kept. */
const KEPT = 10_000;

export class Latency {
  /** One number for each step that carried an input, ms. */
  readonly all: number[] = [];
  private pending: number | null = null;
  private shown: number | null = null;

  /** Somebody has done something at `at`, in ms of `performance.now`; of several before a step the first counts. */
  input(at: number): void {
    this.pending ??= at;
  }

  get waiting(): boolean {
    return this.pending !== null;
  }

  /** A step is sent: the input that it carries. */
  take(): number | null {
    const at = this.pending;
    this.pending = null;
    return at;
  }

  /** The poses after the step that carried an input will be in the next frame. */
  answered(at: number | null): void {
    if (at !== null) this.shown ??= at;
  }

  /** A frame is about to be drawn: the measure is taken when its drawing has been handed over. */
  frame(): void {
    const at = this.shown;
    if (at === null) return;
    this.shown = null;
    queueMicrotask(() => {
      this.all.push(performance.now() - at);
      if (this.all.length > KEPT) this.all.shift();
    });
  }
}
