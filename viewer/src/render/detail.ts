/** The 3D view's level of detail. The measured frame rate decides; a person can choose the plainest picture. */

/** A level of detail. */
export interface Detail {
  /** Samples per pixel, against jagged edges; 0: one. */
  samples: number;
  shadows: boolean;
  /** Fine meshes with shiny materials; otherwise coarse meshes with matte ones. */
  fine: boolean;
  /** Maximum of drawn pixels along a CSS pixel. */
  scale: number;
}

/** The levels, the most detailed first. */
export const DETAILS: readonly Detail[] = [
  { samples: 4, shadows: true, fine: true, scale: 2 },
  { samples: 0, shadows: false, fine: true, scale: 1 },
  { samples: 0, shadows: false, fine: false, scale: 0.75 },
  { samples: 0, shadows: false, fine: false, scale: 0.5 },
];
const PLAINEST = DETAILS.length - 1;
/** The first level that is tried if a program draws instead of a graphics card. */
export const SOFTWARE_LEVEL = 2;

/** Frames per second: below the first the next level is plainer; below the second it is plainer by two. */
const [SLOW, CRAWLS] = [20, 6];
/** Above this rate, for this number of measurements in a row, the next level has more detail. */
const [FAST, IN_A_ROW] = [50, 3];
/** A level that was too slow is tried again after this time, ms: the machine may have been busy. */
const RETRY_MS = 30_000;
/** Least duration and number of frames of a measurement. */
const [WINDOW_MS, FRAMES] = [1000, 2];

/** Chooses the level from the times of drawn frames. */
export class DetailControl {
  private level: number;
  /** Levels up to this one were too slow; they are tried again after `wait` ms, which doubles each time. */
  private tooSlow = -1;
  private wait = RETRY_MS;
  private slowAt = 0;
  private plain = false;
  private last: number | null = null;
  private sum = 0;
  private count = 0;
  private fast = 0;
  /** The first frame of a level compiles shaders: its time says nothing. */
  private skip = 1;

  /** `level`: the first one. */
  constructor(level: number) {
    this.level = Math.min(Math.max(Math.round(level), 0), PLAINEST);
  }

  get index(): number {
    return this.plain ? PLAINEST : this.level;
  }

  get detail(): Detail {
    return DETAILS[this.index] ?? { samples: 0, shadows: false, fine: false, scale: 0.5 };
  }

  /** Draws the plainest picture, whatever the frame rate, or lets the frame rate decide. */
  setPlain(on: boolean): void {
    this.plain = on;
    this.restart();
  }

  /** Starts a new measurement, after a change of the scene or a pause of the page. */
  restart(): void {
    this.last = null;
    [this.sum, this.count, this.fast, this.skip] = [0, 0, 0, 1];
  }

  /** An animation frame at `now`, ms; `drawn`: whether it draws. Returns whether the level has changed. */
  frame(now: number, drawn: boolean): boolean {
    const before = this.last;
    this.last = drawn ? now : null;
    // Only the time between two drawn frames in a row is a cost: a view that stands still draws nothing.
    if (before === null || !drawn || this.plain) return false;
    if (this.skip > 0) {
      this.skip -= 1;
      return false;
    }
    this.sum += now - before;
    this.count += 1;
    if (this.sum < WINDOW_MS || this.count < FRAMES) return false;
    const rate = (1000 * this.count) / this.sum;
    [this.sum, this.count] = [0, 0];
    return this.judge(rate, now);
  }

  private judge(rate: number, now: number): boolean {
    if (this.tooSlow >= 0 && now - this.slowAt > this.wait) {
      this.tooSlow = -1;
      this.wait *= 2;
    }
    this.fast = rate > FAST ? this.fast + 1 : 0;
    let next = this.level;
    if (rate < SLOW) {
      this.tooSlow = Math.max(this.tooSlow, this.level);
      this.slowAt = now;
      next = Math.min(this.level + (rate < CRAWLS ? 2 : 1), PLAINEST);
    } else if (this.fast >= IN_A_ROW && this.level - 1 > this.tooSlow) {
      next = this.level - 1;
    }
    if (next === this.level) return false;
    this.level = next;
    this.restart();
    return true;
  }
}

const LEVEL_KEY = 'palmares.detail';
const PLAIN_KEY = 'palmares.plain';

/** Reads what the pages have stored; a browser may forbid it. */
function stored(of: () => Storage, key: string): string | null {
  try {
    return of().getItem(key);
  } catch {
    return null;
  }
}

function store(of: () => Storage, key: string, value: string): void {
  try {
    of().setItem(key, value);
  } catch {
    /* The next page measures again. */
  }
}

/** The level that the last page of this tab ended with; `fallback` for the first page. */
export function lastLevel(fallback: number): number {
  const level = stored(() => sessionStorage, LEVEL_KEY);
  return level === null || !/^\d$/.test(level) ? fallback : Number(level);
}

export function keepLevel(level: number): void {
  store(() => sessionStorage, LEVEL_KEY, String(level));
}

/** Whether a person has chosen the plain picture, on any page of this browser. */
export function wantsPlain(): boolean {
  return stored(() => localStorage, PLAIN_KEY) === 'true';
}

export function keepPlain(on: boolean): void {
  store(() => localStorage, PLAIN_KEY, String(on));
}
