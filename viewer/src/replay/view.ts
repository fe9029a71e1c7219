/** A replay on the page: picture, time line, events, and what the file says of itself. */
import { clock, points } from '../board/format';
import { button, el, facts, name, setText, toast } from '../board/kit';
import { offerOverlays, overlaySwitches, viewButtons } from '../live/controls';
import { Gauges } from '../live/gauges';
import { Stage } from '../scene/stage';
import { momentAt } from './moments';
import { Player } from './player';
import type { RecordedEvent, Recording } from './recording';

const SPEEDS = [0.1, 0.25, 0.5, 1, 2, 4, 8, 16];
const EVENTS: Record<string, string> = {
  in_goal: 'in the goal', left_goal: 'left the goal', outside: 'outside', back_inside: 'back inside',
  lifted: 'lifted', dropped: 'dropped', slipped: 'slipped', held: 'held', shaken: 'held while shaken',
};

export class ReplayView {
  readonly stage: Stage;
  readonly player: Player;
  private readonly slider: HTMLInputElement;
  private readonly shownTime = el('output', { class: 'clock num' });
  private readonly playing = button('Play', () => { this.toggle(); }, { class: 'primary' });
  private readonly gauges = new Gauges();

  constructor(app: HTMLElement, private readonly recording: Recording, start: number) {
    app.className = 'stage-page';
    const place = el('div', { class: 'stage' });
    const side = el('div', { class: 'side' });
    const dock = el('div', { class: 'dock' });
    app.replaceChildren(place, side, dock);
    this.stage = new Stage(place);
    this.player = new Player(recording.duration, recording.tickS);
    const stages = (): Stage[] => [this.stage];
    place.append(el('div', { class: 'hud bottom-left' }, viewButtons(stages)));
    this.slider = el('input', { type: 'range', min: 0, max: recording.duration, step: recording.tickS, value: 0, 'aria-label': 'Time in the run' });
    this.slider.addEventListener('input', () => { this.player.seek(Number(this.slider.value)); });
    dock.append(this.controls(), this.slider);
    this.stage.setScene(recording.scene);
    this.gauges.setHand(recording.scene.hand ?? null);
    const switches = overlaySwitches(stages);
    this.stage.setOverlay('regions', true);
    offerOverlays(switches, recording.telemetry.length > 0);
    side.append(this.about(), this.events(), this.gauges.element, switches);
    if (recording.telemetry.length === 0) {
      side.append(el('p', { class: 'notice' }, 'This file holds no forces and joint angles: it was recorded by an older server. Contacts, tensions and the prediction are missing.'));
    }
    this.player.onTime((time, exact) => { this.show(time, exact); });
    this.stage.onFrame(() => { this.player.advance(performance.now()); });
    this.keys();
    this.player.seek(start);
  }

  private controls(): HTMLElement {
    const speed = el('select', { class: 'speed', 'aria-label': 'Speed' }, ...SPEEDS.map((s) => el('option', { value: s, selected: s === 1 }, `${s}×`)));
    speed.addEventListener('change', () => { this.player.setSpeed(Number(speed.value)); });
    return el('div', { class: 'row' }, this.playing,
      button('◂ Tick', () => { this.player.step(-1); }), button('Tick ▸', () => { this.player.step(1); }), speed, this.shownTime,
      button('Copy link', () => { void this.copy(); }, { class: 'quiet end' }));
  }

  private about(): HTMLElement {
    const { info, outcome, signed, duration } = this.recording;
    const said = (key: string): string => info.get(key) ?? '–';
    return el('section', { class: 'panel' }, el('h1', {}, name(said('team')), ` \u2013 ${said('task')}`),
      facts([['Hand', name(said('hand'))], ['Score', outcome ? points(outcome.score) : '–'], ['Ended', outcome ? outcome.reason.replaceAll('_', ' ') : '–'],
        ['Length', clock(duration)], ['Kind', said('kind')], ['Signed', signed ? 'yes' : 'no']]),
      el('p', { class: 'hint' }, 'This page shows what the file says. ', el('code', {}, 'palmares verify FILE'), ' proves it.'));
  }

  private events(): HTMLElement {
    const objects = this.recording.scene.bodies.filter((body) => body.kind === 'object');
    const line = (event: RecordedEvent): HTMLElement => {
      const body = event.object === undefined ? null : objects[event.object];
      return el('li', { class: 'row' }, button(clock(event.time), () => { this.player.pause(); this.player.seek(event.time); }, { class: 'small quiet' }),
        el('span', {}, body ? name(body.name) : null, ' ', EVENTS[event.kind] ?? event.kind));
    };
    const { events } = this.recording;
    const list = events.length > 0 ? el('ol', { class: 'log' }, ...events.map(line)) : el('p', { class: 'soft' }, 'The referee noted nothing.');
    return el('section', { class: 'panel' }, el('h2', {}, 'Events'), list);
  }

  private toggle(): void {
    if (this.player.playing) this.player.pause();
    else this.player.play(performance.now());
    this.label();
  }

  private label(): void {
    setText(this.playing, this.player.playing ? 'Pause' : 'Play');
  }

  private show(time: number, exact: boolean): void {
    const moment = momentAt(this.recording, time, exact);
    this.stage.show(moment);
    if (moment.telemetry) this.gauges.show(moment.telemetry);
    this.slider.value = String(time);
    this.slider.setAttribute('aria-valuetext', `${time.toFixed(2)} s`);
    setText(this.shownTime, `${time.toFixed(2)} s of ${this.recording.duration.toFixed(2)}`);
    this.label();
  }

  /** Space plays and pauses, the arrows step by a tick or with shift by a second, wherever no control needs them. */
  private keys(): void {
    document.addEventListener('keydown', (event) => {
      const at = event.target as HTMLElement;
      if (event.ctrlKey || event.metaKey || event.altKey || at.closest('button, input, select, textarea, summary, a, canvas')) return;
      const second = Math.round(1 / this.recording.tickS);
      const steps: Record<string, () => void> = {
        ' ': () => { this.toggle(); },
        ArrowLeft: () => { this.player.step(event.shiftKey ? -second : -1); },
        ArrowRight: () => { this.player.step(event.shiftKey ? second : 1); },
        Home: () => { this.player.seek(0); },
        End: () => { this.player.seek(this.recording.duration); },
      };
      const act = steps[event.key];
      if (!act) return;
      event.preventDefault();
      act();
    });
  }

  private async copy(): Promise<void> {
    const link = new URL(location.href);
    link.hash = `t=${this.player.time.toFixed(2)}`;
    history.replaceState(null, '', link);
    try {
      await navigator.clipboard.writeText(link.href);
      toast('The link is copied.');
    } catch {
      toast('The link is in the address bar.');
    }
  }
}
