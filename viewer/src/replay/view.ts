/** One replay, or two side by side with one clock: 3D views, timeline, charts and metadata. */
import { points } from '../ui/format';
import { button, el, fill, name, setText, toast } from '../ui/elements';
import { showOverlaySwitches, overlaySwitches, viewButtons } from '../render/controls';
import { Gauges } from '../live/gauges';
import { eventWords } from '../model/events';
import type { Moment } from '../model/moment';
import { Stage } from '../render/stage';
import { type ChartedRun, Charts } from './charts';
import { ClosingDialog } from './closing_dialog';
import { momentAt } from './moments';
import { type Comparing, about, comparePanel, eventList, objectOf } from './panels';
import { Player } from './player';
import { Series } from './series';
import type { Loaded } from './source';
import { Timeline } from './timeline';

/** A run with its 3D view. */
interface Shown extends ChartedRun {
  loaded: Loaded;
  stage: Stage;
  said: HTMLElement;
  moment: Moment | null;
}

export class ReplayView {
  readonly player: Player;
  private readonly shown: Shown[];
  private readonly timeline: Timeline;
  private readonly charts: Charts;
  private readonly closing: ClosingDialog;
  private readonly gauges = new Gauges();
  private readonly objects = el('select', { id: 'object' });
  private readonly place = el('p', { class: 'num' });
  private picking = false;

  constructor(app: HTMLElement, loaded: Loaded[], start: number, comparing: Comparing) {
    app.className = 'stage-page replay';
    const pictures = el('div', { class: 'pictures' });
    const side = el('div', { class: 'side' });
    const dock = el('div', { class: 'dock' });
    app.replaceChildren(el('h1', { class: 'visually-hidden' }, 'Replay'), pictures, side, dock);
    // All elements first, so that each stage has its final size when it chooses its view.
    const places = loaded.map(() => el('div', { class: 'stage' }));
    pictures.append(...places);
    this.shown = loaded.map((one, k) => this.picture(places[k] ?? pictures, one, loaded.length > 1 ? String.fromCharCode(65 + k) : ''));
    linkCameras(this.stages);
    const first = loaded[0]?.recording;
    const duration = Math.max(...loaded.map(({ recording }) => recording.duration));
    const tickS = Math.min(...loaded.map(({ recording }) => recording.tickS));
    this.player = new Player(duration, tickS);
    const go = (time: number): void => this.player.seek(time);
    const stages = (): Stage[] => this.shown.map(({ stage }) => stage);
    this.charts = new Charts(this.shown, duration, go);
    this.closing = new ClosingDialog(this.shown, duration, go);
    const marks = this.shown.flatMap(({ loaded: { recording }, mark }, row) =>
      recording.events.map((event) => ({
        event,
        row,
        words: [mark, objectOf(recording, event)?.name, eventWords(event.kind, recording.scene.goals)].filter(Boolean).join(' '),
      })),
    );
    this.timeline = new Timeline(
      this.player,
      tickS,
      marks,
      el(
        'span',
        { class: 'row end' },
        button('Closing', () => this.closing.open(this.player.time), {
          title: 'Closing: measured and predicted',
          'aria-label': 'Closing: measured and predicted',
        }),
        button('Copy link', () => void this.copy(loaded), { class: 'quiet' }),
      ),
    );
    dock.append(this.timeline.element, this.charts.element);
    this.shown[0]?.stage.renderer.domElement.parentElement?.append(el('div', { class: 'hud bottom-left' }, viewButtons(stages)));
    this.gauges.setHand(first?.scene.hand ?? null, first?.scene.readings ?? []);
    const switches = overlaySwitches(stages);
    showOverlaySwitches(
      switches,
      loaded.some((one) => one.recording.telemetry.length > 0),
    );
    for (const stage of stages()) stage.setOverlay('regions', true);
    side.append(
      ...this.shown.map((one) => about(one.loaded, one.mark)),
      this.chooser(),
      switches,
      ...this.shown.map((one) =>
        eventList(
          one.loaded.recording,
          (time) => {
            this.player.pause();
            go(time);
          },
          one.mark,
        ),
      ),
      this.gauges.element,
      comparePanel(comparing),
      el('p', {}, el('a', { href: '/replay' }, 'Open another replay')),
      this.closing.element,
    );
    this.player.onTime((time, exact) => this.show(time, exact));
    this.shown[0]?.stage.onFrame(() => this.player.advance(performance.now()));
    this.choose(this.shown[0]?.object ?? null, this.shown[0]);
    this.player.seek(start);
  }

  get stages(): Stage[] {
    return this.shown.map(({ stage }) => stage);
  }

  dispose(): void {
    for (const { stage } of this.shown) stage.dispose();
    this.charts.dispose();
    this.closing.dispose();
    this.timeline.dispose();
  }

  private picture(place: HTMLElement, loaded: Loaded, mark: string): Shown {
    const { scene, info } = loaded.recording;
    const said = el('span', { class: 'num' });
    const stage = new Stage(place);
    stage.setScene(scene);
    place.append(
      el(
        'div',
        { class: 'hud top-left' },
        el('div', { class: 'card' }, mark ? el('b', {}, `${mark} `) : null, name(info.get('team') ?? '–'), said),
      ),
    );
    const series = new Series(loaded.recording);
    const object = scene.bodies.find((body) => body.kind === 'object')?.id ?? null;
    const shown: Shown = { loaded, mark, stage, said, series, object, moment: null };
    stage.onPick((id) => this.choose(id, shown));
    return shown;
  }

  /** Panel for choosing an object. */
  private chooser(): HTMLElement {
    const objects = this.shown[0]?.loaded.recording.scene.bodies.filter((body) => body.kind === 'object') ?? [];
    fill(this.objects, el('option', { value: '' }, 'none'), ...objects.map((body) => el('option', { value: body.id }, body.name)));
    this.objects.addEventListener('change', () =>
      this.choose(this.objects.value === '' ? null : Number(this.objects.value), this.shown[0]),
    );
    return el(
      'section',
      { class: 'panel' },
      el('h2', {}, 'Object'),
      el('div', { class: 'field' }, el('label', { for: 'object' }, 'Click an object or choose one'), this.objects),
      this.place,
    );
  }

  /** Chooses the object of the same name in both views. */
  private choose(id: number | null, from: Shown | undefined): void {
    if (this.picking || !from) return;
    this.picking = true;
    const chosen = from.loaded.recording.scene.bodies.find((body) => body.id === id);
    for (const one of this.shown) {
      const same = one.loaded.recording.scene.bodies.find((body) => body.name === chosen?.name && body.kind === chosen.kind);
      one.object = same?.id ?? null;
      one.stage.pick(one.object);
    }
    this.picking = false;
    this.objects.value = chosen?.kind === 'object' ? String(this.shown[0]?.object ?? '') : '';
    this.charts.redraw(chosen?.name ?? 'no object');
    this.where();
  }

  private show(time: number, exact: boolean): void {
    for (const one of this.shown) {
      const { recording } = one.loaded;
      one.moment = momentAt(recording, time, exact);
      one.stage.show(one.moment);
      const score = one.moment.score === null ? '' : `${points(one.moment.score)} points`;
      setText(
        one.said,
        ['', score, time > recording.duration ? `ended at ${recording.duration.toFixed(2)} s` : '']
          .filter((words, k) => k === 0 || words !== '')
          .join(', '),
      );
    }
    const telemetry = this.shown[0]?.moment?.telemetry;
    if (telemetry) this.gauges.show(telemetry);
    this.timeline.show(time);
    this.charts.show(time);
    this.closing.show(time);
    this.where();
  }

  private where(): void {
    const places = this.shown.map(({ stage, object, mark }) => {
      const at = object === null ? null : stage.placeOf(object);
      return at ? `${mark ? `${mark}: ` : ''}x ${at[0].toFixed(3)}, y ${at[1].toFixed(3)}, z ${at[2].toFixed(3)} m` : '';
    });
    setText(this.place, places.filter(Boolean).join('; '));
  }

  private async copy(loaded: Loaded[]): Promise<void> {
    const link = new URL(location.href);
    link.hash = `t=${this.player.time.toFixed(2)}`;
    history.replaceState(null, '', link);
    const needs = loaded.some(({ run }) => run === null) ? ' Local files are not part of the link.' : '';
    try {
      await navigator.clipboard.writeText(link.href);
      toast(`Link copied.${needs}`);
    } catch {
      toast(`The link is in the address bar.${needs}`);
    }
  }
}

/** Synchronizes the cameras of the stages. */
function linkCameras(stages: Stage[]): void {
  for (const stage of stages) {
    let moved = false;
    stage.controls.addEventListener('start', () => {
      moved = true;
    });
    stage.controls.addEventListener('end', () => {
      moved = false;
    });
    stage.controls.addEventListener('change', () => {
      if (!moved) return;
      for (const other of stages) {
        if (other !== stage) other.lookAs(stage);
      }
    });
  }
}
