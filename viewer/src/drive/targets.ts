/** What the hand shall do: targets of base and motors as the driver wants them, and what of it has not been sent. */
import type { PoseTarget, Push } from './messages';
import type { Action, BaseTarget } from '../wire/messages';

const same = (a: unknown, b: unknown): boolean => JSON.stringify(a) === JSON.stringify(b);

export class Targets {
  private base: BaseTarget | null = null;
  private sentBase: BaseTarget | null = null;
  private sentHand: number[];
  private readonly once: Push[] = [];
  /** A push as long as somebody holds it: its wrench for the ticks to come. */
  held: (() => Omit<Push, 'duration_s'> | null) | null = null;

  /** `hand`: how far each motor is closed. */
  constructor(public hand: number[]) {
    this.sentHand = hand.slice();
  }

  /** Where the base shall go, or how it shall move. */
  drive(base: BaseTarget): void {
    this.base = base;
  }

  /** Whether the base is told to keep a velocity that is not zero. */
  get moving(): boolean {
    return this.base !== null && 'linear' in this.base && [...this.base.linear, ...this.base.angular].some((x) => x !== 0);
  }

  /** The pose that the base is told to go to. */
  get pose(): PoseTarget | null {
    return this.base && 'position' in this.base ? this.base : null;
  }

  /** Pushes once, for the time it says. */
  push(push: Push): void {
    this.once.push(push);
  }

  /** What has changed since this was last asked. */
  changes(): Action {
    const action: Action = {};
    if (this.base && !same(this.base, this.sentBase)) action.base = this.sentBase = this.base;
    if (!same(this.hand, this.sentHand)) action.hand = this.sentHand = this.hand.slice();
    return action;
  }

  /** The pushes that begin with the next step of `seconds` (s). */
  pushes(seconds: number): Push[] {
    const held = this.held?.();
    return [...this.once.splice(0), ...(held ? [{ ...held, duration_s: seconds }] : [])];
  }
}
