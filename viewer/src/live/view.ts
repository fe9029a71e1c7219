/** A live run: 3D view, score, events, clocks, and why an object counts or does not. */
import { clock, points } from '../ui/format';
import { el, facts, name, setText } from '../ui/elements';
import { eventWords } from '../model/events';
import type { Moment } from '../model/moment';
import { countWords, placeWords } from '../model/outcome';
import type { Body, SceneInfo } from '../model/scene';
import { type WatchListener, type WatchTarget, WatchSocket } from '../net/watch';
import { withVisuals, fetchVisuals } from '../net/visuals';
import { Stage } from '../render/stage';
import { showOverlaySwitches, overlaySwitches, viewButtons } from '../render/controls';
import { Gauges } from './gauges';
import type { Clock, Event as RunEvent, Final, Verdict } from '../wire/messages';

/** Maximum number of events in the log. */
const MAX_EVENTS = 100;
/** Update interval of the panels, ms; the 3D view updates with every frame. */
const PANEL_MS = 200;

declare global {
  interface Window {
    palmares?: Record<string, unknown>;
  }
}

export class LiveView implements WatchListener {
  private readonly place = el('div', { class: 'stage' });
  private readonly noteText = el('span', { class: 'card' }, 'Connecting …');
  private readonly note = el('p', { class: 'stage-note', role: 'status' }, this.noteText);
  private readonly who = el('h1', {}, 'Live');
  private readonly announced = el('p', { class: 'notice', role: 'status', hidden: true });
  private readonly figures = {
    score: el('span', { class: 'num' }, '–'),
    run: el('span', { class: 'num' }, '–'),
    session: el('span', { class: 'num' }, '–'),
    factor: el('span', { class: 'num' }, '–'),
    late: el('span', { class: 'num' }, '–'),
  };
  private readonly log = el('ol', { class: 'log', tabindex: 0, 'aria-live': 'polite', 'aria-label': 'Events' });
  private readonly objects = el('select', { id: 'object' });
  private readonly verdict = el('div', { role: 'status' }, el('p', { class: 'soft' }, 'Click an object or choose one above.'));
  /** Figures from the session's clock; hidden until the first one. */
  private readonly clocks = facts([
    ['Session left', this.figures.session],
    ['Speed', this.figures.factor],
    ['Delay', this.figures.late],
  ]);
  private readonly gauges = new Gauges();
  private readonly switches = overlaySwitches(() => [this.stage]);
  private readonly tokenField = el('input', { type: 'password', id: 'token', autocomplete: 'off', spellcheck: 'false' });
  private readonly tokenSays = el('p', { class: 'error', role: 'alert' });
  private readonly token = el(
    'details',
    { class: 'panel' },
    el('summary', {}, 'I have a token'),
    el(
      'form',
      {
        on: {
          submit: (event) => {
            event.preventDefault();
            this.useToken();
          },
        },
      },
      el(
        'div',
        { class: 'field' },
        el('label', { for: 'token' }, 'Token of a viewer or an organizer'),
        this.tokenField,
        el('p', { class: 'hint' }, 'This page keeps it only in memory.'),
        this.tokenSays,
      ),
      el('button', { type: 'submit' }, 'Use this token'),
    ),
  );
  private readonly stage: Stage;
  private socket: WatchSocket;
  private info: SceneInfo | null = null;
  private judged: Verdict[] = [];
  private picked: number | null = null;
  /** The token in use. */
  private activeToken: string | null = null;
  private written = 0;
  /** The newest moment, for tests. */
  newest: Moment | null = null;

  constructor(
    app: HTMLElement,
    private readonly target: WatchTarget,
    token: string | null = null,
  ) {
    app.classList.add('stage-page');
    const side = el('div', { class: 'side' });
    app.replaceChildren(this.place, side);
    this.stage = new Stage(this.place);
    const stages = (): Stage[] => [this.stage];
    this.stage.setOverlay('regions', true);
    this.clocks.hidden = true;
    // After the canvas, so that they are drawn over it.
    this.place.append(this.note, el('div', { class: 'hud bottom-left' }, viewButtons(stages)));
    side.append(
      this.announced,
      el(
        'section',
        { class: 'panel even' },
        this.who,
        facts([
          ['Score', this.figures.score],
          ['Run', this.figures.run],
        ]),
        this.clocks,
      ),
      el(
        'section',
        { class: 'panel' },
        el('h2', {}, 'Objects'),
        el('div', { class: 'field' }, el('label', { for: 'object' }, 'Highlight'), this.objects),
        this.verdict,
      ),
      el('section', { class: 'panel' }, el('h2', {}, 'Events'), this.log),
      this.gauges.element,
      this.switches,
      this.token,
      el('p', {}, el('a', { href: '/live' }, 'Other runs')),
    );
    this.objects.addEventListener('change', () => this.stage.pick(this.objects.value === '' ? null : Number(this.objects.value)));
    this.stage.onPick((id) => this.pick(id));
    this.socket = new WatchSocket(target, this, token);
    window.palmares = { stage: this.stage, live: this };
  }

  scene(scene: SceneInfo): void {
    this.info = scene;
    this.newest = null;
    this.picked = null;
    this.judged = [];
    this.note.hidden = true;
    this.log.replaceChildren();
    this.stage.setScene(scene);
    this.gauges.setHand(scene.hand ?? null, scene.readings ?? []);
    void this.dress(scene);
    this.explain();
    setText(this.figures.score, '–');
    if (scene.run) this.who.replaceChildren(name(scene.run.team), ` \u2013 ${scene.run.task}, `, name(scene.run.hand));
    this.objects.replaceChildren(
      el('option', { value: '' }, 'none'),
      ...this.free().map((body) => el('option', { value: body.id }, body.name)),
    );
  }

  /** Shows the hand's visual shapes, if it has any. */
  private async dress(scene: SceneInfo): Promise<void> {
    if (!scene.run || !scene.hand) return;
    const seen = withVisuals(scene, await fetchVisuals(scene.hand.name, scene.run.team, this.activeToken));
    if (seen === scene || this.info !== scene) return;
    this.stage.setScene(seen);
    if (this.newest) this.stage.show(this.newest);
  }

  moment(moment: Moment, at: number): void {
    if (this.newest === null) showOverlaySwitches(this.switches, moment.telemetry !== undefined);
    this.newest = moment;
    this.stage.push(moment, at);
    if (!this.panels(at)) return;
    setText(this.figures.run, clock(moment.time));
    if (moment.score !== null) setText(this.figures.score, points(moment.score));
    if (moment.telemetry) this.gauges.show(moment.telemetry);
  }

  score(score: number): void {
    setText(this.figures.score, points(score));
  }

  events(events: RunEvent[]): void {
    for (const event of events) {
      const body = event.object === undefined ? null : this.free()[event.object];
      const time = clock(event.tick * (this.info?.run?.tick_s ?? 0.01));
      this.log.prepend(
        el(
          'li',
          {},
          el('time', { class: 'num' }, time),
          el('span', {}, body ? name(body.name) : null, ' ', eventWords(event.kind, this.info?.goals)),
        ),
      );
    }
    while (this.log.children.length > MAX_EVENTS) this.log.lastElementChild?.remove();
  }

  clock(session: Clock): void {
    this.clocks.hidden = false;
    setText(this.figures.session, session.paused ? 'paused' : session.session_left_s === null ? 'no limit' : clock(session.session_left_s));
    setText(this.figures.factor, session.real_time_factor === null ? '–' : `${session.real_time_factor.toFixed(1)}× real time`);
    setText(this.figures.late, session.late_s === null ? 'none (lockstep)' : `${(1000 * session.late_s).toFixed(1)} ms`);
  }

  verdicts(verdicts: Verdict[]): void {
    this.judged = verdicts;
    this.explain();
  }

  ended(outcome: Final | null, fault?: string): void {
    if (outcome) setText(this.figures.score, points(outcome.score));
    const what = outcome
      ? `The run is over: ${points(outcome.score)} points${this.info ? `, ${countWords(outcome, this.info)}` : ''} (${outcome.reason.replaceAll('_', ' ')}).`
      : `The run stopped because of a fault${fault ? ` (${fault.replaceAll('_', ' ')})` : ''}.`;
    this.say(`${what} The session's next run appears here when it begins.`);
  }

  announcement(text: string): void {
    this.announced.hidden = text === '';
    this.announced.replaceChildren(name(text));
  }

  runs(): void {
    /* This page lists no runs. */
  }

  state(state: 'connecting' | 'watching' | 'waiting'): void {
    if (state === 'watching') return;
    this.say(
      state === 'waiting'
        ? 'No run is being played. The next one appears here when it begins.'
        : this.info
          ? 'Connection lost. Reconnecting …'
          : 'Connecting …',
    );
  }

  refused(message: string, code: string): void {
    this.say(message);
    if (code !== 'not_authorized' && code !== 'forbidden') return;
    this.tokenSays.textContent = message;
    this.token.open = true;
    this.token.parentElement?.prepend(this.token);
    this.tokenField.focus();
  }

  /** Shows a message over the 3D view. */
  private say(text: string): void {
    this.note.hidden = false;
    setText(this.noteText, text);
  }

  private useToken(): void {
    this.socket.close();
    this.tokenSays.textContent = '';
    this.token.open = false;
    this.say('Connecting …');
    this.activeToken = this.tokenField.value.trim() || null;
    this.socket = new WatchSocket(this.target, this, this.activeToken);
    this.tokenField.value = '';
  }

  private free(): Body[] {
    return this.info?.bodies.filter((body) => body.kind === 'object') ?? [];
  }

  private pick(id: number | null): void {
    this.picked = id;
    this.objects.value = id === null ? '' : String(id);
    this.explain();
  }

  /** Shows why the chosen object counts or does not. */
  private explain(): void {
    const place = this.free().findIndex((body) => body.id === this.picked);
    const body = this.info?.bodies.find((one) => one.id === this.picked);
    const verdict = this.judged.find((one) => one.object === place);
    if (!body) this.verdict.replaceChildren(el('p', { class: 'soft' }, 'Click an object or choose one above.'));
    else if (!verdict)
      this.verdict.replaceChildren(el('p', {}, name(body.name), body.kind === 'hand' ? ' is part of the hand.' : ' is highlighted.'));
    else {
      const rules = verdict.reasons.map((reason) =>
        el('li', { class: reason.holds ? 'ok' : 'bad' }, reason.holds ? '✓ ' : '✗ ', reason.rule.replaceAll('_', ' '), figures(reason)),
      );
      this.verdict.replaceChildren(el('p', {}, name(body.name), placeWords(verdict, this.info?.goals)), el('ul', {}, ...rules));
    }
  }

  private panels(now: number): boolean {
    if (now - this.written < PANEL_MS) return false;
    this.written = now;
    return true;
  }
}

function figures(reason: { value: number | null; limit: number | null; unit: string }): string {
  if (reason.value === null) return '';
  const limit = reason.limit === null ? '' : `, limit ${Number(reason.limit.toPrecision(3))} ${reason.unit}`;
  return ` (${Number(reason.value.toPrecision(3))} ${reason.unit}${limit})`;
}
