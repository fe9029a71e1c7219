/** Measures the time from an input to the first frame with a pose of a later tick, ms. */

/** Maximum number of kept measurements. */
const MAX_KEPT = 10_000;

export class Latency {
  /** One latency for each step that carried an input, ms. */
  readonly all: number[] = [];
  private pending: number | null = null;
  private shown: number | null = null;

  /** An input at `at`, ms of `performance.now`; the first one before a step counts. */
  input(at: number): void {
    this.pending ??= at;
  }

  get waiting(): boolean {
    return this.pending !== null;
  }

  /** A step is sent; returns the time of the input that it carries. */
  take(): number | null {
    const at = this.pending;
    this.pending = null;
    return at;
  }

  /** The next frame shows the poses after the step that carried this input. */
  answered(at: number | null): void {
    if (at !== null) this.shown ??= at;
  }

  /** A frame is about to be drawn; the time is taken after its draw calls are submitted. */
  frame(): void {
    const at = this.shown;
    if (at === null) return;
    this.shown = null;
    queueMicrotask(() => {
      this.all.push(performance.now() - at);
      if (this.all.length > MAX_KEPT) this.all.shift();
    });
  }
}
