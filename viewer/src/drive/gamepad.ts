/** Gamepads with the standard layout: sticks move and turn the base, triggers close and open the motors. */
import type { Axes } from './motion';

/** Dead zone of the sticks. */
const DEAD_ZONE = 0.15;

export interface PadState {
  axes: Axes;
  closing: number;
  pause: boolean;
}

const withDeadZone = (value: number | undefined): number => {
  const size = Math.abs(value ?? 0);
  return size < DEAD_ZONE ? 0 : Math.sign(value ?? 0) * ((size - DEAD_ZONE) / (1 - DEAD_ZONE));
};

/** The state of a gamepad: left stick moves, right stick lifts and turns, shoulders roll, D-pad tilts, triggers close and open. */
export function padState(pad: Pick<Gamepad, 'axes' | 'buttons'>): PadState {
  const held = (k: number): number => pad.buttons[k]?.value ?? 0;
  return {
    axes: {
      move: [withDeadZone(pad.axes[0]), 0 - withDeadZone(pad.axes[1]), 0 - withDeadZone(pad.axes[3])],
      turn: [held(13) - held(12), held(5) - held(4), 0 - withDeadZone(pad.axes[2])],
    },
    closing: held(7) - held(6),
    pause: held(9) > 0.5,
  };
}

export class GamepadReader {
  /** Name of the gamepad in use. */
  name: string | null = null;
  /** 1 closes the motors, −1 opens them. */
  closing = 0;
  private stamp = 0;
  private paused = false;

  /** Reads the first gamepad; `fresh`: it has changed since the last call; `pause`: start was pressed. */
  read(): { state: PadState; fresh: boolean; pause: boolean } | null {
    const pad = navigator.getGamepads().find((one) => one?.connected);
    this.name = pad?.id ?? null;
    this.closing = 0;
    if (!pad) return null;
    const state = padState(pad);
    this.closing = state.closing;
    const fresh = pad.timestamp !== this.stamp;
    this.stamp = pad.timestamp;
    const pause = state.pause && !this.paused;
    this.paused = state.pause;
    return { state, fresh, pause };
  }
}
