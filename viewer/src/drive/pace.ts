/** Computes how many ticks are due: simulated time follows the wall clock, times a factor. */

/** Maximum time to catch up after a gap without steps, ms. */
const MAX_CATCH_UP_MS = 100;

export class Pace {
  private owed = 0;
  private last: number | null = null;

  /** `tickMs`: length of a tick, ms. */
  constructor(private readonly tickMs: number) {}

  /**
   * Whole ticks to step at `now` (ms). With `eager` (after an input) one tick may be taken early, so that the input need not
   * wait; the following calls return one tick less.
   */
  due(now: number, factor: number, eager: boolean): number {
    const passed = this.last === null ? this.tickMs / factor : Math.max(now - this.last, 0);
    this.last = Math.max(now, this.last ?? now);
    this.owed = Math.min(this.owed + (passed * factor) / this.tickMs, Math.max(1, (MAX_CATCH_UP_MS * factor) / this.tickMs));
    const ticks = eager && this.owed > 0 ? Math.max(1, Math.floor(this.owed)) : Math.max(0, Math.floor(this.owed));
    this.owed -= ticks;
    return ticks;
  }

  /** Starts a pause: its time is not caught up. */
  rest(): void {
    this.owed = 0;
    this.last = null;
  }
}
