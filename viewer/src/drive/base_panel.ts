/** Panel for moving the base: axes, speed, keys and gamepad. */
import { el, setText } from '../ui/elements';
import { keyList } from './keys';
import type { FrameName } from './motion';
import type { Field } from '../wire/messages';

/** Initial speed of keys and sticks, as a share of the server's limit. */
const INITIAL_SHARE = 0.2;

export class BasePanel {
  readonly element: HTMLElement;
  private readonly frames = el(
    'select',
    { id: 'axes' },
    el('option', { value: 'view' }, 'of the camera'),
    el('option', { value: 'world' }, 'of the world'),
    el('option', { value: 'hand' }, 'of the hand'),
  );
  private readonly speed = el('input', { type: 'range', id: 'speed', min: 0.02, max: 1, step: 0.02, value: INITIAL_SHARE });
  private readonly speedShown = el('output', { for: 'speed' });
  private readonly keysOn = el('input', { type: 'checkbox', id: 'keys-on', checked: true });
  private readonly pad = el('p', { class: 'hint', role: 'status' }, 'No gamepad yet: press one of its buttons.');
  private maxLinear = 0;
  private maxAngular = 0;

  /** `pose`: the form for a pose in numbers. `changed` gets the new axes; `keys` whether keys move the hand. */
  constructor(pose: HTMLElement, changed: (frame: FrameName) => void, keys: (on: boolean) => void) {
    this.frames.addEventListener('change', () => changed(this.frame));
    this.keysOn.addEventListener('change', () => keys(this.keysOn.checked));
    this.speed.addEventListener('input', () => this.write());
    this.element = el(
      'details',
      { class: 'panel', open: true },
      el('summary', {}, 'Move the hand'),
      el('p', { class: 'hint' }, 'Drag the handles in the image, hold keys, use a gamepad, or type a target:'),
      pose,
      el('div', { class: 'field' }, el('label', { for: 'axes' }, 'Axes'), this.frames),
      el('div', { class: 'slider' }, el('label', { for: 'speed' }, 'Speed'), this.speed, this.speedShown),
      el('div', { class: 'check' }, this.keysOn, el('label', { for: 'keys-on' }, 'Keys move the hand')),
      keyList(),
      el('h2', {}, 'Gamepad'),
      this.pad,
      el(
        'p',
        { class: 'hint' },
        'Left stick: move. Right stick: lift and turn. Shoulder buttons: roll. D-pad: tilt. Triggers: close and open the motors. Start: pause.',
      ),
    );
    this.write();
  }

  /** Sets the server's speed limits, m/s and rad/s. */
  limit(linear: Field | undefined, angular: Field | undefined): void {
    this.maxLinear = linear?.maximum ?? 0;
    this.maxAngular = angular?.maximum ?? 0;
    this.write();
  }

  get frame(): FrameName {
    return this.frames.value as FrameName;
  }

  /** m/s at full deflection. */
  get linear(): number {
    return this.speed.valueAsNumber * this.maxLinear;
  }

  /** rad/s at full deflection. */
  get angular(): number {
    return this.speed.valueAsNumber * this.maxAngular;
  }

  gamepad(name: string | null): void {
    setText(this.pad, name ?? 'No gamepad yet: press one of its buttons.');
  }

  private write(): void {
    setText(this.speedShown, this.maxLinear > 0 ? `${this.linear.toFixed(2)} m/s` : `${Math.round(100 * this.speed.valueAsNumber)} %`);
  }
}
