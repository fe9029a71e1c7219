/** Keyboard control: the meaning of the keys, and the keys that are down. */
import { el } from '../ui/elements';
import type { Axes } from './motion';

/** Keys by physical position: [code, move or turn, axis, sign]. */
const AXES: readonly (readonly [string, 'move' | 'turn', 0 | 1 | 2, 1 | -1])[] = [
  ['KeyD', 'move', 0, 1],
  ['KeyA', 'move', 0, -1],
  ['KeyW', 'move', 1, 1],
  ['KeyS', 'move', 1, -1],
  ['KeyE', 'move', 2, 1],
  ['KeyQ', 'move', 2, -1],
  ['KeyK', 'turn', 0, 1],
  ['KeyI', 'turn', 0, -1],
  ['KeyO', 'turn', 1, 1],
  ['KeyU', 'turn', 1, -1],
  ['KeyJ', 'turn', 2, 1],
  ['KeyL', 'turn', 2, -1],
];
const CLOSE = 'KeyX';
const OPEN = 'KeyZ';
const HELD = new Set([...AXES.map(([code]) => code), CLOSE, OPEN]);

/** The list in the page. */
const WORDS: readonly (readonly [string[], string])[] = [
  [['W', 'S'], 'forward, back'],
  [['A', 'D'], 'left, right'],
  [['Q', 'E'], 'down, up'],
  [['I', 'K'], 'tilt forward, back'],
  [['J', 'L'], 'turn left, right'],
  [['U', 'O'], 'roll left, right'],
  [['X', 'Z'], 'close, open all motors'],
  [['Space'], 'pause, resume'],
  [['.'], 'single step, while paused'],
  [['1', '2', '3'], 'move, turn, push with the mouse'],
];

/** Action of a single key press. */
export type Command = 'pause' | 'step' | 'move' | 'turn' | 'push';
const COMMANDS: Record<string, Command> = { Space: 'pause', Period: 'step', Digit1: 'move', Digit2: 'turn', Digit3: 'push' };

/** Whether the focused element uses the key: text fields use all keys, buttons and check boxes the space bar. */
export function keptBy(target: EventTarget | null, code: string): boolean {
  if (!(target instanceof Element)) return false;
  if (target.closest('dialog[open], textarea, select, [contenteditable]')) return true;
  const input = target.closest('input');
  if (input && !['range', 'checkbox', 'radio', 'button'].includes(input.type)) return true;
  return code === 'Space' && target.closest('input, button, a, summary') !== null;
}

export class Keys {
  /** Whether keys move the hand. */
  on = true;
  private readonly down = new Set<string>();

  /** `changed` is called when a movement key goes down or up, with its time in ms of `performance.now`. */
  constructor(
    private readonly changed: (at: number) => void,
    command: (what: Command) => void,
  ) {
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
    window.addEventListener('keyup', (event) => {
      if (this.down.delete(event.code)) this.changed(event.timeStamp);
    });
    // Without focus the page misses key-up events.
    const release = (): void => this.release();
    window.addEventListener('blur', release);
    document.addEventListener('visibilitychange', release);
    document.addEventListener('focusin', (event) => {
      if (keptBy(event.target, 'KeyW')) this.release();
    });
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

/** A list of the keys and their actions. */
export function keyList(): HTMLElement {
  return el(
    'dl',
    { class: 'keys' },
    ...WORDS.flatMap(([keys, words]) => [
      el('dt', {}, ...keys.flatMap((key, k) => [k > 0 ? ' ' : null, el('kbd', {}, key)])),
      el('dd', {}, words),
    ]),
  );
}
