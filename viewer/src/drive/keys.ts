/** Keys that drive: which key does what, and which are down now. */
import { el } from '../ui/elements';
import type { Axes } from './motion';

/** Keys by where they are on the keyboard: [code, which of move or turn, axis, way]. */
const AXES: readonly (readonly [string, 'move' | 'turn', 0 | 1 | 2, 1 | -1])[] = [
  ['KeyD', 'move', 0, 1], ['KeyA', 'move', 0, -1], ['KeyW', 'move', 1, 1], ['KeyS', 'move', 1, -1], ['KeyE', 'move', 2, 1], ['KeyQ', 'move', 2, -1],
  ['KeyK', 'turn', 0, 1], ['KeyI', 'turn', 0, -1], ['KeyO', 'turn', 1, 1], ['KeyU', 'turn', 1, -1], ['KeyJ', 'turn', 2, 1], ['KeyL', 'turn', 2, -1],
];
const CLOSE = 'KeyX';
const OPEN = 'KeyZ';
const HELD = new Set([...AXES.map(([code]) => code), CLOSE, OPEN]);

/** The list that is shown. */
const WORDS: readonly (readonly [string[], string])[] = [
  [['W', 'S'], 'forward, back'], [['A', 'D'], 'left, right'], [['Q', 'E'], 'down, up'],
  [['I', 'K'], 'tip forward, back'], [['J', 'L'], 'turn left, right'], [['U', 'O'], 'roll left, right'],
  [['X', 'Z'], 'close, open all motors'], [['Space'], 'pause, go on'], [['.'], 'single step, while paused'],
  [['1', '2', '3'], 'move, turn, push with the mouse'],
];

/** What a key does once. */
export type Command = 'pause' | 'step' | 'move' | 'turn' | 'push';
const COMMANDS: Record<string, Command> = { Space: 'pause', Period: 'step', Digit1: 'move', Digit2: 'turn', Digit3: 'push' };

/** Whether a key belongs to what has the focus: text fields keep all of theirs, buttons and boxes the space bar. */
export function keptBy(target: EventTarget | null, code: string): boolean {
  if (!(target instanceof Element)) return false;
  if (target.closest('dialog[open], textarea, select, [contenteditable]')) return true;
  const input = target.closest('input');
  if (input && !['range', 'checkbox', 'radio', 'button'].includes(input.type)) return true;
  return code === 'Space' && target.closest('input, button, a, summary') !== null;
}

export class Keys {
  /** Whether keys drive at all. */
  on = true;
  private readonly down = new Set<string>();

  /** `changed` is told when a key that is held goes down or up, at its time in ms of `performance.now`. */
  constructor(private readonly changed: (at: number) => void, command: (what: Command) => void) {
    window.addEventListener('keydown', (event) => {
      if (!this.on || event.ctrlKey || event.metaKey || event.altKey || keptBy(event.target, event.code)) return;
      const once = COMMANDS[event.code];
      if (once) {
        event.preventDefault();
        if (!event.repeat || once === 'step') command(once);
      } else if (HELD.has(event.code)) {
        event.preventDefault();
        if (this.down.has(event.code)) return;
        this.down.add(event.code);
        this.changed(event.timeStamp);
      }
    });
    window.addEventListener('keyup', (event) => { if (this.down.delete(event.code)) this.changed(event.timeStamp); });
    // Whoever looks elsewhere holds nothing.
    const release = (): void => { this.release(); };
    window.addEventListener('blur', release);
    document.addEventListener('visibilitychange', release);
    document.addEventListener('focusin', (event) => { if (keptBy(event.target, 'KeyW')) this.release(); });
  }

  axes(): Axes {
    const axes: Axes = { move: [0, 0, 0], turn: [0, 0, 0] };
    for (const [code, which, axis, way] of AXES) if (this.down.has(code)) axes[which][axis] += way;
    return axes;
  }

  /** 1 closes the motors, −1 opens them. */
  closing(): number {
    return (this.down.has(CLOSE) ? 1 : 0) - (this.down.has(OPEN) ? 1 : 0);
  }

  release(): void {
    if (this.down.size === 0) return;
    this.down.clear();
    this.changed(performance.now());
  }
}

/** What the keys do, to be read. */
export function keyList(): HTMLElement {
  return el('dl', { class: 'keys' }, ...WORDS.flatMap(([keys, words]) => [
    el('dt', {}, ...keys.flatMap((key, k) => [k > 0 ? ' ' : null, el('kbd', {}, key)])), el('dd', {}, words)]));
}
