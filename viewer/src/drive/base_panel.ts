/** How the base is moved: along which axes, how fast, by which keys, and with which gamepad. */
import { el, setText } from '../ui/elements';
import { keyList } from './keys';
import type { Spec } from './messages';
import type { FrameName } from './motion';

/** Keys and sticks go at this share of what the server allows, at first. */
const SHARE = 0.2;

export class BasePanel {
  readonly element: HTMLElement;
  private readonly frames = el('select', { id: 'axes' },
    el('option', { value: 'view' }, 'as the camera looks'), el('option', { value: 'world' }, 'of the world'), el('option', { value: 'hand' }, 'of the hand'));
  private readonly speed = el('input', { type: 'range', id: 'speed', min: 0.02, max: 1, step: 0.02, value: SHARE });
  private readonly speedShown = el('output', { for: 'speed' });
  private readonly keysOn = el('input', { type: 'checkbox', id: 'keys-on', checked: true });
  private readonly pad = el('p', { class: 'hint', role: 'status' }, 'No gamepad: press one of its buttons.');
  private linearMost = 0;
  private angularMost = 0;

  /** `changed` is told when axes change; `keys` whether keys drive. */
  constructor(changed: (frame: FrameName) => void, keys: (on: boolean) => void) {
    this.frames.addEventListener('change', () => { changed(this.frame); });
    this.keysOn.addEventListener('change', () => { keys(this.keysOn.checked); });
    this.speed.addEventListener('input', () => { this.write(); });
    this.element = el('details', { class: 'panel', open: true }, el('summary', {}, 'Move the hand'),
      el('p', { class: 'hint' }, 'Drag the handles in the picture, hold keys, or take a gamepad.'),
      el('div', { class: 'field' }, el('label', { for: 'axes' }, 'Axes'), this.frames),
      el('div', { class: 'slider' }, el('label', { for: 'speed' }, 'Speed'), this.speed, this.speedShown),
      el('div', { class: 'check' }, this.keysOn, el('label', { for: 'keys-on' }, 'Keys drive the hand')),
      keyList(),
      el('h2', {}, 'Gamepad'), this.pad,
      el('p', { class: 'hint' }, 'Left stick moves; right stick lifts and turns; shoulders roll; the cross tips; triggers close and open the motors; start pauses.'));
    this.write();
  }

  /** The server's limits of speed, m/s and rad/s. */
  limit(linear: Spec | undefined, angular: Spec | undefined): void {
    this.linearMost = linear?.maximum ?? 0;
    this.angularMost = angular?.maximum ?? 0;
    this.write();
  }

  get frame(): FrameName {
    return this.frames.value as FrameName;
  }

  /** m/s at full deflection. */
  get linear(): number {
    return this.speed.valueAsNumber * this.linearMost;
  }

  /** rad/s at full deflection. */
  get angular(): number {
    return this.speed.valueAsNumber * this.angularMost;
  }

  gamepad(name: string | null): void {
    setText(this.pad, name ?? 'No gamepad: press one of its buttons.');
  }

  private write(): void {
    setText(this.speedShown, this.linearMost > 0 ? `${this.linear.toFixed(2)} m/s` : `${Math.round(100 * this.speed.valueAsNumber)} %`);
  }
}
