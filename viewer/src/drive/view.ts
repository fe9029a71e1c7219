/** `/drive`: a person controls a hand. Connects the 3D view, the inputs and the run. */
import { clock, points } from '../ui/format';
import { button, el, facts, name, setText, toast } from '../ui/elements';
import { showOverlaySwitches, overlaySwitches, viewButtons } from '../render/controls';
import { eventWords } from '../model/events';
import type { Moment } from '../model/moment';
import { countWords } from '../model/outcome';
import type { SceneInfo } from '../model/scene';
import { withVisuals, fetchVisuals } from '../net/visuals';
import { Stage } from '../render/stage';
import type { ActionRecording } from './action_recording';
import { BasePanel } from './base_panel';
import { Driver, type RunPhase, type DriverListener } from './driver';
import { GamepadReader } from './gamepad';
import { Gizmo } from './gizmo';
import { type Command, Keys } from './keys';
import { type KeptRun, keep, takeKept } from './kept';
import { Latency } from './latency';
import type { Push } from './messages';
import { Motors } from './motors';
import { isStill, STILL, sumOf, twistOf } from './motion';
import { PoseForm } from './pose_form';
import { PushArrow } from './push_arrow';
import { PushForm } from './push_form';
import { type Choice, StartForm } from './start';
import { RecordingList } from './recording_list';
import { RunControls } from './run_controls';
import { ContactFeed } from './contact_feed';
import { momentOf, sceneOfReset } from './run_scene';
import type { Field, Obs, Opened, RunResult, Scene } from '../wire/messages';

/** Closing speed of the motors by keys and triggers, in ranges per second. */
const CLOSING = 1;
/** Update interval of the panels, ms; the 3D view updates with every frame. */
const PANEL_MS = 200;

type Tool = 'move' | 'turn' | 'push';

declare global {
  interface Window {
    palmares?: Record<string, unknown>;
  }
}

export class DriveView implements DriverListener {
  readonly latency = new Latency();
  private readonly place = el('div', { class: 'stage' });
  private readonly noteText = el('span', { class: 'card' }, 'Choose a task and a hand, then press Start.');
  private readonly note = el('p', { class: 'stage-note', role: 'status' }, this.noteText);
  private readonly title = el('h1', {}, 'Drive');
  private readonly figures = {
    score: el('span', {}, '–'),
    time: el('span', {}, '–'),
    factor: el('span', {}, '–'),
    seed: el('span', {}, '–'),
  };
  private readonly log = el('ol', { class: 'log', tabindex: 0, 'aria-live': 'polite', 'aria-label': 'Events' });
  private readonly stage: Stage;
  private readonly driver = new Driver(this, this.latency);
  private readonly keys: Keys;
  private readonly pads = new GamepadReader();
  private readonly gizmo: Gizmo;
  private readonly arrow: PushArrow;
  private readonly pushForm: PushForm;
  private readonly base: BasePanel;
  private readonly pose: PoseForm;
  private readonly motors: Motors;
  private readonly start: StartForm;
  private readonly runForm = el('details', { class: 'panel', open: true }, el('summary', {}, 'Start a run'));
  private readonly takes = new RecordingList();
  private readonly transport: RunControls;
  private readonly contactFeed = new ContactFeed();
  private readonly tools = new Map<Tool, HTMLButtonElement>();
  private chosen: Tool = 'move';
  private choice: Choice | null = null;
  private scene: SceneInfo | null = null;
  private observation: Obs | null = null;
  private wrote = { at: 0, time: 0 };
  private frameAt = 0;
  /** The newest moment, for tests. */
  newest: Moment | null = null;

  constructor(app: HTMLElement) {
    app.classList.add('stage-page', 'drive-page');
    this.stage = new Stage(app.appendChild(this.place));
    this.stage.setOverlay('regions', true);
    this.stage.onFrame(() => this.latency.frame());
    this.stage.onPick((id) => this.picked(id));
    this.arrow = new PushArrow(this.stage, this.place, (at) => this.input(at));
    this.gizmo = new Gizmo(this.stage, (position, quat_xyzw, at) => {
      this.driver.targets.drive({ position, quat_xyzw });
      this.input(at);
    });
    this.keys = new Keys(
      (at) => this.steer(at),
      (what) => this.command(what),
    );
    this.pushForm = new PushForm((push, at) => this.push(push, at));
    this.pose = new PoseForm((target, at) => {
      this.driver.targets.drive(target);
      this.input(at);
    });
    this.base = new BasePanel(
      this.pose.element,
      (frame) => this.gizmo.along(frame === 'hand' ? 'local' : 'world'),
      (on) => {
        this.keys.release();
        this.keys.on = on;
      },
    );
    this.motors = new Motors((hand, at) => {
      this.driver.targets.hand = hand;
      this.input(at);
    });
    this.start = new StartForm((choice) => this.begin(choice));
    this.transport = new RunControls({
      pause: () => this.command('pause'),
      step: () => this.command('step'),
      finish: () => void this.driver.finish(),
      again: (same) => void this.again(same),
      factor: (factor) => {
        this.driver.factor = factor;
      },
      record: (on) => this.driver.recording?.record(on),
    });
    this.build(app);
    this.tool('move');
    window.addEventListener('pagehide', () => this.leave());
    // The connection does not survive in the browser's cache of pages.
    window.addEventListener('pageshow', (event) => {
      if (event.persisted) location.reload();
    });
    const loop = (now: number): void => {
      requestAnimationFrame(loop);
      this.frame(now);
    };
    requestAnimationFrame(loop);
    const kept = takeKept();
    if (kept) void this.resume(kept);
    window.palmares = { stage: this.stage, drive: { latencies: this.latency.all, view: this, driver: this.driver } };
  }

  private build(app: HTMLElement): void {
    const stages = (): Stage[] => [this.stage];
    this.runForm.append(this.start.element);
    const switches = overlaySwitches(stages);
    showOverlaySwitches(switches, true);
    const contacts = switches.querySelector<HTMLInputElement>('#overlay-contacts');
    contacts?.addEventListener('change', () => this.contactFeed.want(contacts.checked));
    const tools = el('div', { class: 'group', role: 'group', 'aria-label': 'What the mouse does' });
    for (const [tool, label] of [
      ['move', 'Move'],
      ['turn', 'Turn'],
      ['push', 'Push'],
    ] as const) {
      const made = button(label, () => this.tool(tool), { class: 'small' });
      this.tools.set(tool, made);
      tools.append(made);
    }
    const gain = el('input', { type: 'range', id: 'push-gain', min: 1, max: 100, step: 1, value: this.arrow.gain / 10 });
    const gainShown = el('output', { for: 'push-gain' }, `${gain.value} N`);
    gain.addEventListener('input', () => {
      this.arrow.gain = 10 * gain.valueAsNumber;
      setText(gainShown, `${gain.value} N`);
    });
    this.place.append(this.note, el('div', { class: 'hud top-left' }, tools), el('div', { class: 'hud bottom-left' }, viewButtons(stages)));
    app.append(
      this.transport.element,
      el(
        'div',
        { class: 'side' },
        el(
          'section',
          { class: 'panel' },
          this.title,
          facts([
            ['Score', this.figures.score],
            ['Run', this.figures.time],
            ['Speed', this.figures.factor],
            ['Seed', this.figures.seed],
          ]),
        ),
        this.runForm,
        this.motors.element,
        this.base.element,
        el(
          'details',
          { class: 'panel', open: true },
          el('summary', {}, 'Push a link'),
          el(
            'p',
            { class: 'hint' },
            'Choose Push above the image and drag an arrow away from a link: it is pushed while you hold the button. Or push it once:',
          ),
          this.pushForm.element,
          el('div', { class: 'slider' }, el('label', { for: 'push-gain' }, '10 cm of arrow ='), gain, gainShown),
        ),
        el('section', { class: 'panel' }, el('h2', {}, 'Events'), this.log),
        this.takes.element,
        switches,
      ),
    );
  }

  // Events of the session.

  phase(phase: RunPhase): void {
    this.transport.show(phase);
    this.tool(this.chosen);
    this.start.enable(phase === 'closed' || phase === 'over' || phase === 'running' || phase === 'paused');
    if (phase === 'opening') this.say('Opening the run …');
    else if (phase === 'ending') this.say('Waiting until the objects settle, then counting …');
    else if (phase === 'running' || phase === 'paused') this.say(null);
  }

  opened(run: Opened, scene: Scene, first: Obs): void {
    const hand = this.choice?.hand;
    if (!hand) return;
    const specs = this.driver.welcome?.specs.action ?? [];
    const spec = (of: string): Field | undefined => specs.find((one) => one.name === of);
    this.scene = sceneOfReset(scene, hand, first);
    this.stage.setScene(this.scene);
    void this.dress(this.scene, hand.name);
    this.runForm.open = false;
    this.arrow.setScene(this.scene);
    this.gizmo.limit(spec('base.position'));
    this.pose.limit(spec('base.position'));
    this.base.limit(spec('base.linear'), spec('base.angular'));
    this.motors.offer(first.hand.actuators, spec('hand'));
    this.pushForm.offer(hand.links.map((link) => link.name));
    this.driver.targets.held = () => this.arrow.wrench();
    if (!this.transport.record) this.driver.recording?.record(false);
    if (this.driver.recording) this.takes.show(this.driver.recording);
    this.contactFeed.follow(first.run_id);
    this.start.showSeed(run.seed);
    this.title.replaceChildren(`${run.task}, `, name(run.hand));
    setText(this.figures.seed, run.seed === null ? 'hidden' : String(run.seed));
    this.log.replaceChildren();
    this.wrote = { at: 0, time: 0 };
    this.observed(first);
  }

  observed(observation: Obs): void {
    const hand = this.choice?.hand;
    if (!hand) return;
    this.observation = observation;
    const moment = momentOf(observation, hand);
    if (this.contactFeed.contacts) moment.contacts = this.contactFeed.contacts;
    this.newest = moment;
    this.stage.show(moment);
    this.arrow.show(moment);
    this.handles(observation);
    if (observation.events.length > 0) this.events(observation);
    this.panels(observation);
  }

  ended(result: RunResult): void {
    this.contactFeed.follow(null);
    if (this.driver.recording) this.takes.show(this.driver.recording);
    setText(this.figures.score, points(result.score));
    this.say(
      `The run is over: ${points(result.score)} points${this.scene ? `, ${countWords(result, this.scene)}` : ''} (${result.reason.replaceAll('_', ' ')}). Start another run, or download the recording.`,
    );
  }

  failed(message: string, lost: boolean): void {
    if (this.driver.recording) this.takes.show(this.driver.recording);
    if (lost) {
      this.say(`${message} The run is lost, but its recording is kept. You can start another run.`);
      this.start.fail(message);
      this.runForm.open = true;
    } else if (this.driver.phase === 'closed' || this.driver.phase === 'over') {
      this.say(message);
      this.start.fail(message);
      this.runForm.open = true;
    } else {
      toast(message, true);
    }
  }

  noted(message: string): void {
    toast(message);
  }

  // Input.

  /** Shows the hand's visual shapes, if it has any. */
  private async dress(scene: SceneInfo, hand: string): Promise<void> {
    const seen = withVisuals(scene, await fetchVisuals(hand, this.choice?.team ?? null, this.choice?.token ?? null));
    if (seen === scene || this.scene !== scene) return;
    this.stage.setScene(seen);
    if (this.newest) this.stage.show(this.newest);
  }

  private async begin(choice: Choice): Promise<void> {
    const before = this.choice;
    this.choice = choice;
    const same = before !== null && before.team === choice.team && before.token === choice.token && this.driver.phase !== 'closed';
    if (same) return this.driver.reset(choice.task, choice.hand, choice.seed);
    if (this.driver.phase !== 'closed') {
      await this.driver.finish();
      this.driver.disconnect();
    }
    return this.driver.connect(choice.team, choice.token, choice.task, choice.hand, choice.seed);
  }

  /** Continues the run that this tab showed before a reload. */
  private async resume(kept: KeptRun): Promise<void> {
    this.choice = { task: kept.task, hand: kept.hand, seed: kept.run.seed, team: kept.team, token: null };
    if (await this.driver.resume(kept)) {
      this.logged(this.driver.recording?.events ?? []);
      return;
    }
    this.choice = null;
    this.say('The run of this tab is over: the server waits 30 seconds for a page that comes back. Start another run.');
  }

  /** The page goes: a run without a token waits for its next page; the server ends any other. */
  private leave(): void {
    const { choice } = this;
    const kept = choice && choice.token === null ? this.driver.keep(choice.hand) : null;
    if (kept && keep(kept)) this.driver.leave();
    else this.driver.disconnect();
  }

  private async again(sameSeed: boolean): Promise<void> {
    const { choice } = this;
    if (choice) await this.driver.reset(choice.task, choice.hand, sameSeed ? (this.driver.recording?.run.seed ?? null) : null);
  }

  private command(what: Command): void {
    if (what === 'pause') this.driver.pause(this.driver.phase === 'running');
    else if (what === 'step') this.driver.single();
    else this.tool(what);
  }

  private tool(tool: Tool): void {
    this.chosen = tool;
    for (const [one, made] of this.tools) made.setAttribute('aria-pressed', String(one === tool));
    const open = this.driver.phase === 'running' || this.driver.phase === 'paused';
    this.gizmo.show(!open || tool === 'push' ? null : tool === 'move' ? 'translate' : 'rotate');
    this.arrow.on = open && tool === 'push';
  }

  private push(push: Push, at: number): void {
    this.driver.targets.push(push);
    this.input(at);
  }

  private picked(id: number | null): void {
    const body = this.scene?.bodies.find((one) => one.id === id);
    if (body?.kind === 'hand') this.pushForm.choose(body.name);
  }

  /** An input at `at`, ms of `performance.now`: the next step carries it, and may be taken early. */
  private input(at: number): void {
    if (this.driver.phase !== 'running') return;
    this.latency.input(at);
    this.driver.pump();
  }

  /** Sets the base's velocity from keys and sticks; without input the last target stays. */
  private steer(at: number | null): void {
    const pad = this.pads.read();
    if (pad?.pause) this.command('pause');
    const axes = sumOf(this.keys.axes(), pad?.state.axes ?? STILL);
    const { targets } = this.driver;
    if (this.observation && !this.gizmo.dragging && (!isStill(axes) || targets.moving)) {
      const right = this.stage.camera.matrixWorld.elements;
      targets.drive(
        twistOf(
          axes,
          this.base.frame,
          [right[0], right[1], right[2]],
          this.observation.hand.base.quat_xyzw,
          this.base.linear,
          this.base.angular,
        ),
      );
    }
    if (at !== null) this.input(at);
    else if (pad?.fresh) this.input(performance.now());
  }

  private frame(now: number): void {
    const passed = Math.min(now - this.frameAt, 100) / 1000;
    this.frameAt = now;
    this.steer(null);
    this.base.gamepad(this.pads.name);
    const closing = this.keys.closing() + this.pads.closing;
    if (closing !== 0 && this.driver.phase === 'running') this.driver.targets.hand = this.motors.close(closing * CLOSING * passed);
    this.driver.pump();
  }

  // Output.

  /** Moves the handles to the base's target pose, or to the base while it keeps a velocity. */
  private handles({ hand: { base } }: Obs): void {
    const target = this.driver.targets.pose;
    this.gizmo.put((target ?? base).position, (target ?? base).quat_xyzw);
  }

  private events(observation: Obs): void {
    const objects = this.scene?.bodies.filter((body) => body.kind === 'object') ?? [];
    for (const event of observation.events) {
      const body = event.object === undefined ? undefined : objects[event.object];
      const noted = { ...event, name: body?.name ?? null };
      this.driver.recording?.events.push(noted);
      this.logged([noted]);
    }
  }

  private logged(events: ActionRecording['events']): void {
    for (const event of events) {
      const time = clock(event.tick * (this.driver.recording?.run.tick_s ?? 0));
      this.log.prepend(
        el(
          'li',
          {},
          el('time', { class: 'num' }, time),
          el('span', {}, event.name === null ? null : name(event.name), ' ', eventWords(event.kind, this.scene?.goals)),
        ),
      );
    }
  }

  private panels(observation: Obs): void {
    const now = performance.now();
    if (now - this.wrote.at < PANEL_MS && this.driver.phase === 'running') return;
    const seconds = (now - this.wrote.at) / 1000;
    setText(this.figures.score, points(observation.score));
    setText(this.figures.time, `${observation.sim_time_s.toFixed(1)} s, tick ${observation.tick}`);
    setText(
      this.figures.factor,
      this.wrote.at > 0 && this.driver.phase === 'running'
        ? `${((observation.sim_time_s - this.wrote.time) / seconds).toFixed(2)}× real time`
        : '–',
    );
    this.motors.show(observation.hand.actuators);
    this.pose.show(observation.hand.base.position, observation.hand.base.quat_xyzw);
    if (this.driver.recording) this.takes.show(this.driver.recording);
    this.wrote = { at: now, time: observation.sim_time_s };
  }

  private say(message: string | null): void {
    this.note.hidden = message === null;
    if (message !== null) setText(this.noteText, message);
  }
}
