/** `/hands/NAME`: a hand without objects. Sliders close it, the pointer pushes and holds it, tables show its numbers. */
import { Matrix4, Quaternion, Vector3 } from 'three';
import { figure } from '../ui/format';
import { ApiError } from '../net/api';
import { button, el, facts, name, setText } from '../ui/elements';
import { viewButtons } from '../render/controls';
import { palmOf } from '../model/palm';
import { composed, type Pose } from '../model/pose';
import type { Part, Vec3 } from '../model/scene';
import { withVisuals, fetchVisuals } from '../net/visuals';
import { type OverlayName, Stage } from '../render/stage';
import { requestEquilibrium } from './access';
import { closingTable } from './closing_table';
import { LoadPointer, type Mode } from './load_pointer';
import { MethodPanel } from './method_panel';
import type { Opener } from './list';
import { LoadMarks } from './load_marks';
import { MotorSliders } from './motors';
import { NamedFrames } from './named_frames';
import { LatestRequest } from './latest_request';
import { FORCES, numbersOf, usualForce } from './numbers';
import { LoadList } from './load_list';
import { baseTurn, type Posture, POSTURES } from './postures';
import { equilibriumRequest, clampForce, inLink, inWorld, type Load, MAX_LOADS, rounded } from './equilibrium';
import { graspCentre, heightOf, momentOf, placesAt, placesOf, sceneOfHand } from './hand_scene';
import { Tables } from './tables';
import { Tensions } from './tensions';
import { checkReport, uploadForm } from './upload';
import { teamForm } from './team_form';
import type { EquilibriumResponse, EquilibriumRequest, HandDescription, SubmittedHand } from '../wire/messages';

/** Length of the arrow in the scale's label, m. */
const FIVE_CM = 0.05;
const MODES: readonly (readonly [Mode, string])[] = [
  ['look', 'Look'],
  ['force', 'Push'],
  ['hold', 'Hold'],
];
const SHOWN: readonly (readonly [OverlayName, string])[] = [
  ['frames', 'Frames: base, palm, grasp centre, links'],
  ['names', 'Names of links'],
  ['com', 'Centres of mass'],
];

function touchOf(hand: HandDescription): string {
  const patches = hand.tactile ?? [];
  const taxels = patches.reduce((sum, { taxels: [along, across] }) => sum + along * across, 0);
  return taxels > 0 ? `${taxels} taxels in ${patches.length} patches` : 'none';
}

export class HandView {
  readonly stage: Stage;
  readonly loads: Load[] = [];
  /** The shown response, for tests. */
  rest: EquilibriumResponse | null = null;
  readonly asking: LatestRequest<EquilibriumRequest, EquilibriumResponse>;
  private readonly place = el('div', { class: 'stage' });
  private readonly picked = el('p', { class: 'card', role: 'status', hidden: true });
  private readonly sliders: MotorSliders;
  private readonly tensions: Tensions;
  private readonly law: MethodPanel;
  private readonly points: LoadList;
  private readonly tables: Tables;
  private readonly marks: LoadMarks;
  private readonly frames: NamedFrames;
  private readonly grip: LoadPointer;
  private readonly posture = el('select', { id: 'posture' }, ...POSTURES.map(([value, label]) => el('option', { value }, label)));
  private readonly scale: HTMLSelectElement;
  private readonly modes = el('div', { class: 'group', role: 'group', 'aria-label': 'What the pointer does' });
  private readonly baseSays = el('p', { class: 'hint' });
  private readonly says = el('p', { class: 'card', role: 'status' }, 'Computing the equilibrium …');
  private base: Pose = { position: [0, 0, 0], quat: [0, 0, 0, 1] };
  private places: Map<string, Pose>;
  private chosen: number | null = null;
  private next = 1;
  /** Visual shapes of the links, if the hand has any. */
  private visuals: ReadonlyMap<string, Part[]> = new Map();
  /** The dragged load before the drag. */
  private before: Pick<Load, 'force' | 'place'> = { force: [0, 0, 0], place: [0, 0, 0] };

  constructor(
    app: HTMLElement,
    private readonly hand: HandDescription,
    private readonly page: Opener,
    check: SubmittedHand | null,
    title: HTMLElement,
  ) {
    this.places = placesOf(
      hand,
      hand.coordinates.map((c) => c.rest),
      this.base,
    );
    const usual = usualForce(hand);
    this.scale = el('select', { id: 'scale' }, ...FORCES.map((n) => el('option', { value: n, selected: n === usual }, `${n} N`)));
    this.sliders = new MotorSliders(hand.motors, () => this.ask());
    this.tensions = new Tensions(hand.tendons);
    this.law = new MethodPanel(hand);
    this.points = new LoadList(
      hand,
      {
        add: (kind, link) => this.add(kind, link, hand.links.find((one) => one.name === link)?.com ?? [0, 0, 0]),
        remove: (id) => this.remove(id),
        choose: (id) => this.choose(id),
        set: (id, what, axis, value) =>
          this.change(id, (load) => {
            const vector: Vec3 = [...load[what]];
            vector[axis] = value;
            load[what] = what === 'force' ? clampForce(vector) : vector;
          }),
      },
      el('div', { class: 'field row nowrap' }, el('label', { for: 'scale' }, '5 cm of arrow ='), this.scale),
    );
    this.tables = new Tables(hand, [['Closing', () => closingTable(hand, page.access)]]);
    const side = el('div', { class: 'side' });
    app.classList.add('stage-page', 'hand-page');
    app.replaceChildren(this.place, side, this.tables.element);
    this.stage = new Stage(this.place);
    this.marks = new LoadMarks(this.stage, this.place);
    this.frames = new NamedFrames(this.stage, this.place);
    this.grip = new LoadPointer(this.stage, this.marks, this.place, {
      pressed: (kind, link, at) => this.pressed(kind, link, at),
      grabbed: (id) => this.grabbed(id),
      dragged: (id, by) => this.dragged(id, by),
    });
    this.place.append(
      el('div', { class: 'hud top-left' }, this.says, this.picked),
      el(
        'div',
        { class: 'hud bottom-left' },
        this.modeButtons(),
        viewButtons(() => [this.stage]),
      ),
    );
    side.append(
      el(
        'section',
        { class: 'panel' },
        title,
        el('p', {}, name(hand.description)),
        button('Reset', () => this.reset(), { class: 'small' }),
      ),
      ...(check ? [checkReport(check)] : []),
      this.sliders.element,
      this.tensions.element,
      this.points.element,
      this.law.element,
      this.held(),
      this.shown(),
      this.figures(),
      this.further(),
    );
    this.posture.addEventListener('change', () => this.hold(this.posture.value as Posture));
    this.scale.addEventListener('change', () => this.draw());
    this.stage.onPick((id) => this.pick(id));
    this.asking = new LatestRequest(
      (question) => requestEquilibrium(hand.name, question, page.access),
      (rest, question) => this.answered(rest, question),
      (error) => this.failed(error instanceof Error ? error.message : String(error)),
      (error) => error instanceof ApiError && (error.status === 503 || error.status === 429),
    );
    this.hold('model');
    void fetchVisuals(hand.name, page.access.team, page.access.token).then((visuals) => {
      if (visuals.size === 0) return;
      this.visuals = visuals;
      this.hold(this.posture.value as Posture);
    });
    if (check) document.getElementById('check')?.focus();
    window.palmares = { stage: this.stage, hand: this };
  }

  dispose(): void {
    this.asking.close();
    this.stage.dispose();
  }

  /** N for each m of arrow. */
  get gain(): number {
    return Number(this.scale.value) / FIVE_CM;
  }

  /** Position of a load's handle on the canvas, CSS px; for tests. */
  handleOf(id: number): { x: number; y: number } | null {
    return this.marks.handleOf(id);
  }

  // Input.

  private ask(): void {
    this.asking.put(equilibriumRequest(this.sliders.sigma, this.base, this.loads));
  }

  private add(kind: Load['kind'], link: string, point: Vec3): number | null {
    const at = this.places.get(link);
    if (!at || this.loads.filter((load) => load.kind === kind).length >= MAX_LOADS) return null;
    const id = this.next;
    this.next += 1;
    this.loads.push({ id, kind, link, point: rounded(point, 1e5), force: [0, 0, 0], place: [0, 0, 0] });
    const made = this.loads.at(-1);
    // At the rounded point that is sent: any offset from it would cause a force.
    if (made) made.place = inWorld(at, made.point);
    this.choose(id);
    this.ask();
    return id;
  }

  private pressed(kind: 'force' | 'hold', link: number, at: Vec3): number | null {
    const body = this.hand.links[link];
    const pose = body && this.places.get(body.name);
    return pose ? this.add(kind, body.name, inLink(pose, at)) : null;
  }

  private grabbed(id: number): void {
    const load = this.loads.find((one) => one.id === id);
    if (load) this.before = { force: load.force, place: load.place };
    this.choose(id);
  }

  /** The force follows the pointer's movement alone; if it followed the moving link, the two would oscillate. */
  private dragged(id: number, by: Vec3): void {
    const { force, place } = this.before;
    const plus = (v: Vec3, times: number): Vec3 => [v[0] + by[0] * times, v[1] + by[1] * times, v[2] + by[2] * times];
    this.change(id, (load) => {
      if (load.kind === 'hold') load.place = plus(place, 1);
      else load.force = clampForce(plus(force, this.gain));
    });
  }

  private change(id: number, how: (load: Load) => void): void {
    const load = this.loads.find((one) => one.id === id);
    if (!load) return;
    how(load);
    this.draw();
    this.ask();
  }

  private remove(id: number): void {
    const k = this.loads.findIndex((load) => load.id === id);
    if (k >= 0) this.loads.splice(k, 1);
    this.draw();
    this.ask();
  }

  private choose(id: number): void {
    this.chosen = id;
    this.draw();
  }

  private reset(): void {
    this.loads.length = 0;
    this.sliders.set(this.hand.motors.map(() => 0));
    this.posture.value = 'model';
    this.hold('model');
  }

  /** Changes the orientation of the base, and resets the camera. */
  private hold(posture: Posture): void {
    const quat = baseTurn(this.hand, posture);
    this.base = { position: [0, 0, heightOf(this.hand, quat)], quat };
    setText(
      this.baseSays,
      `The base’s origin is ${(100 * this.base.position[2]).toFixed(0)} cm above the ground. The palm’s direction is estimated from how the fingers close.`,
    );
    const q = this.rest?.q ?? this.hand.coordinates.map((c) => c.rest);
    // Held points move with the hand.
    const before = this.places;
    this.places = placesOf(this.hand, q, this.base);
    for (const load of this.loads) {
      const [was, is] = [before.get(load.link), this.places.get(load.link)];
      if (was && is) load.place = inWorld(is, inLink(was, load.place));
    }
    this.stage.setScene(withVisuals(sceneOfHand(this.hand, this.base), this.visuals));
    this.stage.view('free');
    this.draw();
    this.ask();
  }

  private pick(id: number | null): void {
    const link = id === null ? undefined : this.hand.links[id];
    this.picked.hidden = link === undefined;
    if (!link) return;
    this.points.choose(link.name);
    this.picked.replaceChildren(
      name(link.name),
      `: ${figure(1000 * link.mass)} g`,
      ...(link.coordinate === null ? [] : [', moves with ', name(link.coordinate)]),
    );
  }

  // Output.

  private answered(rest: EquilibriumResponse, question: EquilibriumRequest): void {
    // If held points were added or removed since the request, its reactions cannot be assigned.
    const same = question.contacts?.length === this.loads.filter((load) => load.kind === 'hold').length;
    this.rest = same ? rest : { ...rest, reactions: [] };
    this.places = placesAt(rest);
    this.tensions.show(rest.tension);
    this.law.show(rest);
    this.says.classList.remove('bad');
    setText(this.says, rest.law === 'closed_form' ? 'Equilibrium by the closed form' : 'Equilibrium by Newton’s method');
    this.tables.show(rest, question.motors);
    this.draw();
  }

  private failed(message: string): void {
    this.law.fail(message);
    this.says.classList.add('bad');
    setText(this.says, `${message[0]?.toUpperCase() ?? ''}${message.slice(1)}. The previous pose is shown.`);
  }

  private draw(): void {
    this.stage.show(momentOf(this.hand, this.places));
    this.marks.show(this.loads, this.places, this.rest, 1 / this.gain, this.chosen);
    this.points.show(this.loads, this.rest, this.chosen);
    this.drawFrames();
  }

  private drawFrames(): void {
    const palm = palmOf(this.hand);
    // z points out of the palm, x to the fingertips.
    const out = new Vector3(...palm.direction);
    const along = new Vector3(...palm.middle).addScaledVector(out, -out.dot(new Vector3(...palm.middle)));
    if (along.length() < 1e-3) along.set(1, 0, 0).addScaledVector(out, -out.x);
    along.normalize();
    const turn = new Quaternion().setFromRotationMatrix(new Matrix4().makeBasis(along, new Vector3().crossVectors(out, along), out));
    const frame = composed(this.base, { position: palm.middle, quat: [turn.x, turn.y, turn.z, turn.w] });
    const centre = graspCentre(this.hand, this.places);
    this.frames.show([this.base, frame, ...(centre ? [{ position: centre, quat: frame.quat }] : [])]);
  }

  private figures(): HTMLElement {
    const { hand } = this;
    const { shapes, size, torque, strongest } = numbersOf(hand);
    const edges = size.map((edge) => (1000 * edge).toFixed(0)).join(' × ');
    return el(
      'section',
      { class: 'panel' },
      el('h2', {}, 'Key numbers'),
      facts([
        ['Mass', `${figure(1000 * hand.mass)} g`],
        ['Size at rest', `${edges} mm`],
        ['Links', `${hand.links.length}, with ${shapes} shapes`],
        ['Coordinates', hand.coordinates.length],
        ['Tendons', hand.tendons.length],
        ['Motors', hand.motors.length],
        ['Strongest joint', el('span', {}, name(strongest), `: up to ${figure(torque)} N·m`)],
        ['Touch', touchOf(hand)],
        ['Joint encoders', (hand.sensors?.joints?.on ?? ['none']).join(', ')],
        ['Accelerometer', hand.sensors?.accelerometer ? `on ${hand.sensors.accelerometer.link}` : 'none'],
        ['Cameras', (hand.sensors?.cameras ?? []).map(({ name, width, height }) => `${name}, ${width} × ${height}`).join('; ') || 'none'],
      ]),
    );
  }

  private modeButtons(): HTMLElement {
    for (const [mode, label] of MODES) {
      const made = button(
        label,
        () => {
          this.grip.mode = mode;
          for (const other of this.modes.children) other.setAttribute('aria-pressed', String(other === made));
        },
        { class: 'small', 'aria-pressed': String(mode === 'look') },
      );
      this.modes.append(made);
    }
    return this.modes;
  }

  private held(): HTMLElement {
    return el(
      'section',
      { class: 'panel' },
      el('h2', {}, 'Base'),
      el('div', { class: 'field' }, el('label', { for: 'posture' }, 'Orientation'), this.posture, this.baseSays),
    );
  }

  private shown(): HTMLElement {
    return el(
      'details',
      { class: 'panel', open: true },
      el('summary', {}, 'Show'),
      ...SHOWN.map(([overlay, label]) => {
        const box = el('input', { type: 'checkbox', id: `overlay-${overlay}` });
        box.addEventListener('change', () => {
          this.stage.setOverlay(overlay, box.checked);
          if (overlay === 'frames') this.frames.visible = box.checked;
        });
        return el('div', { class: 'check' }, box, el('label', { for: `overlay-${overlay}` }, label));
      }),
      el(
        'p',
        { class: 'hint' },
        'Axes x, y, z are red, green, blue. The palm’s frame is estimated; its z axis points out of the palm. The grasp centre is between the fingertips, with the palm’s axes.',
      ),
    );
  }

  private further(): HTMLElement {
    return el(
      'details',
      { class: 'panel' },
      el('summary', {}, 'Your own hand'),
      teamForm(this.page.official, this.page.access, (access) => {
        this.page.access = access;
      }),
      uploadForm(
        () => this.page.access,
        this.page.official,
        (hand) => this.page.open(hand.name, hand),
      ),
      el('p', {}, el('a', { href: '/hands' }, 'All hands')),
    );
  }
}
