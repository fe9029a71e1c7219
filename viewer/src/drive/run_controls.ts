/** The buttons below the image: pause, single step, restart, finish, speed, and recording. */
import { button, el } from '../ui/elements';
import type { RunPhase } from './driver';

const FACTORS: readonly (readonly [number, string])[] = [
  [0.1, '0.1×'],
  [0.25, '0.25×'],
  [0.5, '0.5×'],
  [1, 'real time'],
  [2, '2×'],
  [4, '4×'],
];

export interface RunActions {
  pause(): void;
  step(): void;
  again(sameSeed: boolean): void;
  finish(): void;
  factor(factor: number): void;
  record(on: boolean): void;
}

export class RunControls {
  readonly element: HTMLElement;
  private readonly pause: HTMLButtonElement;
  private readonly step: HTMLButtonElement;
  private readonly finish: HTMLButtonElement;
  private readonly restarts: HTMLButtonElement[];
  private readonly recorded = el('input', { type: 'checkbox', id: 'record', checked: true });

  constructor(orders: RunActions) {
    const factor = el(
      'select',
      { id: 'factor' },
      ...FACTORS.map(([value, label]) => el('option', { value, selected: value === 1 }, label)),
    );
    factor.addEventListener('change', () => orders.factor(Number(factor.value)));
    this.recorded.addEventListener('change', () => orders.record(this.recorded.checked));
    this.pause = button('Pause', () => orders.pause());
    this.step = button('Single step', () => orders.step());
    this.restarts = [button('Again, same seed', () => orders.again(true)), button('Again, new seed', () => orders.again(false))];
    this.finish = button('Finish', () => orders.finish());
    this.element = el(
      'div',
      { class: 'dock row', role: 'group', 'aria-label': 'The run' },
      this.pause,
      this.step,
      ...this.restarts,
      this.finish,
      el('label', { for: 'factor', class: 'row nowrap' }, 'Speed', factor),
      el('div', { class: 'check' }, this.recorded, el('label', { for: 'record' }, 'Record')),
    );
    this.show('closed');
  }

  show(phase: RunPhase): void {
    const open = phase === 'running' || phase === 'paused';
    this.pause.textContent = phase === 'paused' ? 'Resume' : 'Pause';
    this.pause.disabled = !open;
    this.step.disabled = phase !== 'paused';
    this.finish.disabled = !open;
    for (const restart of this.restarts) restart.disabled = !open && phase !== 'over';
  }

  get record(): boolean {
    return this.recorded.checked;
  }
}
