/** Targets of base and motors, and which of them have not been sent. */
import type { PoseTarget, Push } from './messages';
import type { Action, BaseTarget } from '../wire/messages';

const same = (a: unknown, b: unknown): boolean => JSON.stringify(a) === JSON.stringify(b);

export class Targets {
  private base: BaseTarget | null = null;
  private sentBase: BaseTarget | null = null;
  private sentHand: number[];
  private readonly once: Push[] = [];
  /** The wrench of a held push; null while there is none. */
  held: (() => Omit<Push, 'duration_s'> | null) | null = null;

  /** `hand`: the motors' targets. */
  constructor(public hand: number[]) {
    this.sentHand = hand.slice();
  }

  /** Continues with the targets of an earlier page, which the server has. */
  static of({ base, hand }: { base: BaseTarget | null; hand: number[] }): Targets {
    const made = new Targets(hand);
    made.base = made.sentBase = base;
    return made;
  }

  /** The last targets that were sent. */
  get sent(): { base: BaseTarget | null; hand: number[] } {
    return { base: this.sentBase, hand: this.sentHand };
  }

  /** Sets the target of the base. */
  drive(base: BaseTarget): void {
    this.base = base;
  }

  /** Whether the base's target is a velocity other than zero. */
  get moving(): boolean {
    return this.base !== null && 'linear' in this.base && [...this.base.linear, ...this.base.angular].some((x) => x !== 0);
  }

  /** The base's target pose; null if it has none. */
  get pose(): PoseTarget | null {
    return this.base && 'position' in this.base ? this.base : null;
  }

  /** Adds a push with its own duration. */
  push(push: Push): void {
    this.once.push(push);
  }

  /** The targets that changed since the last call. */
  changes(): Action {
    const action: Action = {};
    if (this.base && !same(this.base, this.sentBase)) action.base = this.sentBase = this.base;
    if (!same(this.hand, this.sentHand)) action.hand = this.sentHand = this.hand.slice();
    return action;
  }

  /** The pushes of the next step, which lasts `seconds`. */
  pushes(seconds: number): Push[] {
    const held = this.held?.();
    return [...this.once.splice(0), ...(held ? [{ ...held, duration_s: seconds }] : [])];
  }
}
