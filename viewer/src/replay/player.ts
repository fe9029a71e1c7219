/** The clock of a replay: plays, pauses, seeks, and calls its listeners. Times in s of the run. */
export class Player {
  private now = 0;
  private speed = 1;
  private running = false;
  private last = 0;
  private readonly listeners: ((time: number, exact: boolean) => void)[] = [];

  constructor(
    readonly duration: number,
    private readonly tickS: number,
  ) {}

  get time(): number {
    return this.now;
  }
  get playing(): boolean {
    return this.running;
  }

  /** `listener` gets each change of time; `exact`: a person chose this time. */
  onTime(listener: (time: number, exact: boolean) => void): void {
    this.listeners.push(listener);
  }

  play(at: number): void {
    if (this.now >= this.duration) this.now = 0;
    this.running = true;
    this.last = at;
  }

  pause(): void {
    this.running = false;
    this.notify(true);
  }

  setSpeed(speed: number): void {
    this.speed = speed;
  }

  seek(time: number): void {
    this.now = Math.min(Math.max(time, 0), this.duration);
    this.notify(true);
  }

  /** Moves by a number of ticks, forward or back. */
  step(ticks: number): void {
    this.running = false;
    this.seek((Math.round(this.now / this.tickS) + ticks) * this.tickS);
  }

  /** Advances to wall-clock time `at`, ms as of `performance.now`. */
  advance(at: number): void {
    if (!this.running) return;
    this.now = Math.min(this.now + ((at - this.last) / 1000) * this.speed, this.duration);
    this.last = at;
    if (this.now >= this.duration) this.running = false;
    this.notify(!this.running);
  }

  private notify(exact: boolean): void {
    for (const listener of this.listeners) listener(this.now, exact);
  }
}
