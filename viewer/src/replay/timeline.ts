/** The timeline below the image: play, step, speed, slider with event marks, and their keys. */
import { isGoodNews } from '../model/events';
import { button, el, setText } from '../ui/elements';
import type { Player } from './player';
import type { RecordedEvent } from './recording';

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];

/** An event mark; `row` 0 is above the slider, 1 below it. */
export interface EventMark {
  event: RecordedEvent;
  words: string;
  row: number;
}

export class Timeline {
  readonly element: HTMLElement;
  private readonly bar: HTMLInputElement;
  private readonly clock = el('output', { class: 'clock num' });
  private readonly playing = button('Play', () => this.toggle(), { class: 'primary play', title: 'Space' });
  private readonly keyed = (event: KeyboardEvent): void => this.key(event);

  constructor(
    private readonly player: Player,
    private readonly tickS: number,
    marks: EventMark[],
    ...more: HTMLElement[]
  ) {
    const last = Math.max(Math.round(player.duration / tickS), 1);
    const speed = el(
      'select',
      { class: 'speed', 'aria-label': 'Speed' },
      ...SPEEDS.map((s) => el('option', { value: s, selected: s === 1 }, `${s}×`)),
    );
    speed.addEventListener('change', () => player.setSpeed(Number(speed.value)));
    this.bar = el('input', { type: 'range', min: 0, max: last, step: 1, value: 0, 'aria-label': 'Time in the run' });
    this.bar.addEventListener('input', () => player.seek(Number(this.bar.value) * tickS));
    this.element = el(
      'div',
      { class: 'timeline' },
      el(
        'div',
        { class: 'row' },
        this.playing,
        el(
          'div',
          { class: 'group' },
          button('−1 tick', () => player.step(-1), { title: 'Left arrow' }),
          button('+1 tick', () => player.step(1), { title: 'Right arrow' }),
        ),
        speed,
        this.clock,
        ...more,
      ),
      el('div', { class: 'bar' }, this.marks(marks), this.bar),
    );
    document.addEventListener('keydown', this.keyed);
  }

  show(time: number): void {
    this.bar.value = String(Math.round(time / this.tickS));
    this.bar.setAttribute('aria-valuetext', `${time.toFixed(2)} s`);
    setText(this.clock, `${time.toFixed(2)} of ${this.player.duration.toFixed(2)} s`);
    setText(this.playing, this.player.playing ? 'Pause' : 'Play');
  }

  dispose(): void {
    document.removeEventListener('keydown', this.keyed);
  }

  private toggle(): void {
    if (this.player.playing) this.player.pause();
    else this.player.play(performance.now());
    setText(this.playing, this.player.playing ? 'Pause' : 'Play');
  }

  /** Marks for the pointer; keyboard users have the list of events. */
  private marks(marks: EventMark[]): HTMLElement {
    const place = el('div', { class: 'marks', 'aria-hidden': 'true' });
    for (const { event, words, row } of marks) {
      const good = isGoodNews(event.kind);
      const mark = button(
        '',
        () => {
          this.player.pause();
          this.player.seek(event.time);
        },
        {
          tabindex: -1,
          title: `${event.time.toFixed(2)} s: ${words}`,
          class: `mark ${good ? 'good' : 'poor'}${row === 1 ? ' below' : ''}`,
        },
      );
      mark.style.setProperty('--at', String(Math.min(event.time / Math.max(this.player.duration, 1e-3), 1)));
      place.append(mark);
    }
    return place;
  }

  /**
   * Space plays and pauses; arrows step by a tick, with shift by a second; Home and End go to the ends. Focused controls keep their
   * own keys.
   */
  private key(event: KeyboardEvent): void {
    const at = event.target as HTMLElement;
    if (event.defaultPrevented || event.ctrlKey || event.metaKey || event.altKey) return;
    if (at !== this.bar && at.closest('input:not([type=checkbox]), select, textarea, canvas, [tabindex="0"]')) return;
    if (event.key === ' ' && at.closest('button, input[type=checkbox], summary, a')) return;
    const second = Math.round(1 / this.tickS);
    const acts: Record<string, () => void> = {
      ' ': () => this.toggle(),
      ArrowLeft: () => this.player.step(event.shiftKey ? -second : -1),
      ArrowRight: () => this.player.step(event.shiftKey ? second : 1),
      Home: () => this.player.seek(0),
      End: () => this.player.seek(this.player.duration),
    };
    const act = acts[event.key];
    if (!act) return;
    event.preventDefault();
    act();
  }
}
