/** How many ticks are due: simulated time follows the clock on the wall, times a factor. */

/** A page that could not step for longer does not catch up: the world waited, ms. */
const LONGEST_MS = 100;

export class Pace {
  private owed = 0;
  private last: number | null = null;

  /** `tickMs`: length of a tick, ms. */
  constructor(private readonly tickMs: number) {}

  /**
   * Whole ticks to step at `now` (ms). What somebody has just done need not wait for the next tick: it may be `eager`
   * and take one tick before its time, which the following ones give back.
   */
  due(now: number, factor: number, eager: boolean): number {
    const passed = this.last === null ? this.tickMs / factor : Math.max(now - this.last, 0);
    this.last = Math.max(now, this.last ?? now);
    this.owed = Math.min(this.owed + (passed * factor) / this.tickMs, Math.max(1, (LONGEST_MS * factor) / this.tickMs));
    const ticks = eager && this.owed > 0 ? Math.max(1, Math.floor(this.owed)) : Math.max(0, Math.floor(this.owed));
    this.owed -= ticks;
    return ticks;
  }

  /** The world stands still: time that passes now is not made up for. */
  rest(): void {
    this.owed = 0;
    this.last = null;
  }
}
