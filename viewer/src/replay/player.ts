/** The clock of a replay: plays, stops, jumps, and tells everybody what time it is. Times in s of the run. */
export class Player {
  private now = 0;
  private speed = 1;
  private running = false;
  private last = 0;
  private readonly listeners: ((time: number, exact: boolean) => void)[] = [];

  constructor(readonly duration: number, private readonly tickS: number) {}

  get time(): number { return this.now; }
  get playing(): boolean { return this.running; }

  /** Told of every change; `exact`: a person chose this moment. */
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
    this.tell(true);
  }

  setSpeed(speed: number): void {
    this.speed = speed;
  }

  seek(time: number): void {
    this.now = Math.min(Math.max(time, 0), this.duration);
    this.tell(true);
  }

  /** So many ticks on, or back. */
  step(ticks: number): void {
    this.running = false;
    this.seek((Math.round(this.now / this.tickS) + ticks) * this.tickS);
  }

  /** Lets wall-clock time pass, ms as of `performance.now`. */
  advance(at: number): void {
    if (!this.running) return;
    this.now = Math.min(this.now + ((at - this.last) / 1000) * this.speed, this.duration);
    this.last = at;
    if (this.now >= this.duration) this.running = false;
    this.tell(!this.running);
  }

  private tell(exact: boolean): void {
    for (const listener of this.listeners) listener(this.now, exact);
  }
}
