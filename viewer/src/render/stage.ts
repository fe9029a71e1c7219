/** The 3D view of a run: bodies, hand, lights, camera and overlays. It renders only after a change. */
import {
  Color,
  Matrix4,
  MeshLambertMaterial,
  MeshStandardMaterial,
  type MeshStandardMaterialParameters,
  PerspectiveCamera,
  Raycaster,
  Scene,
  Vector2,
  Vector3,
  type LineSegments,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { forwardKinematics } from '../model/hand';
import { type Moment, POSE } from '../model/moment';
import type { Body, SceneInfo, Vec3 } from '../model/scene';
import { ContactArrows } from './contact_arrows';
import { Batch } from './batch';
import { DetailControl, SOFTWARE_LEVEL, keepLevel, lastLevel, wantsPlain } from './detail';
import { PoseInterpolator } from './interpolation';
import { Director, type ViewName } from './director';
import type { Pane } from './framing';
import { type Panel, splitFurniture } from './furniture';
import { Labels } from './labels';
import { Lights } from './lights';
import { Centres, Frames, regionLines } from './overlays';
import { type Renderer, createRenderer } from './renderer';
import { blocks } from './sight';
import { Subject } from './subject';
import { turnByKey } from './camera_keys';

export type { ViewName } from './director';
export type OverlayName = 'ghost' | 'contacts' | 'regions' | 'frames' | 'names' | 'com';

/** Rendering cost of the last frame. */
export interface Stats {
  drawCalls: number;
  triangles: number;
  scriptMs: number;
}

/** Share of the picture that the scene may fill, and the least that the buttons over it leave. */
const [FILLED, LEAST] = [0.94, 0.55];
/** A board that hides more than this share of the hand's links becomes transparent. */
const HIDES = 0.2;
const PICKED = new Color('#ffb000');
const GHOST = new Color('#56b4e9');

/** Drawn objects of one run. */
interface Shown {
  info: SceneInfo;
  /** Whether its meshes are fine. */
  fine: boolean;
  solid: Batch;
  /** Furniture without the ground, and again as glass: panels that the camera looks through. */
  panels: Batch;
  glass: Batch;
  furniture: Panel[];
  ghost: Batch | null;
  regions: LineSegments;
  frames: Frames;
  centres: Centres;
  links: Body[];
  subject: Subject;
}

export class Stage {
  readonly camera = new PerspectiveCamera(45, 1, 0.01, 50);
  readonly three = new Scene();
  readonly renderer: Renderer;
  readonly controls: OrbitControls;
  private readonly blend = new PoseInterpolator();
  private readonly arrows = new ContactArrows();
  private readonly labels: Labels;
  private readonly overlays = new Set<OverlayName>();
  private readonly observer: ResizeObserver;
  private readonly raycaster = new Raycaster();
  private readonly scratch = new Vector3();
  private readonly matrix = new Matrix4();
  private readonly themes = matchMedia('(prefers-color-scheme: dark)');
  private readonly still = matchMedia('(prefers-reduced-motion: reduce)');
  private readonly lights: Lights;
  private readonly control: DetailControl;
  private readonly director: Director;
  private readonly woken = (): void => this.control.restart();
  private readonly retheme = (): void => this.ground();
  private shown: Shown | null = null;
  private moment: Moment | null = null;
  private picked: number | null = null;
  private listeners: ((id: number | null, point: Vec3) => void)[] = [];
  private before: (() => void)[] = [];
  private dirty = true;
  /** The drawn bodies are not yet at the current poses. */
  private stale = false;
  /** A person moves the camera at this moment. */
  private holding = false;
  private pane: Pane = { left: FILLED, right: FILLED, top: FILLED, bottom: FILLED };
  private frame = 0;
  private scriptMs = 0;

  constructor(private readonly container: HTMLElement) {
    this.renderer = createRenderer(container);
    const canvas = this.renderer.domElement;
    this.labels = new Labels(container);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(0.8, -1.4, 1.1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.director = new Director(this.camera, this.controls);
    this.controls.addEventListener('start', () => {
      this.holding = true;
    });
    this.controls.addEventListener('end', () => {
      this.holding = false;
    });
    this.controls.addEventListener('change', () => {
      if (this.holding) this.director.taken(this.shown?.subject ?? null);
      this.dirty = true;
    });
    this.lights = new Lights(this.three);
    this.three.add(this.arrows.mesh);
    this.arrows.mesh.visible = false;
    this.observer = new ResizeObserver(() => this.resize());
    this.observer.observe(container);
    this.themes.addEventListener('change', this.retheme);
    this.control = new DetailControl(lastLevel(this.renderer.software ? SOFTWARE_LEVEL : 0));
    this.control.setPlain(wantsPlain());
    document.addEventListener('visibilitychange', this.woken);
    this.ground();
    this.applyDetail();
    this.pointer(canvas);
    const loop = (now: number): void => {
      this.frame = requestAnimationFrame(loop);
      this.draw(now);
    };
    this.frame = requestAnimationFrame(loop);
  }

  /** Shows another scene and frees the previous one. */
  setScene(info: SceneInfo): void {
    const same = this.shown !== null && JSON.stringify(this.shown.info.regions) === JSON.stringify(info.regions);
    this.clear();
    const solid = info.bodies.filter((body) => body.kind !== 'furniture');
    const { panels, grounds } = splitFurniture(info);
    const subject = new Subject(info);
    const links = info.bodies.filter((body) => body.kind === 'hand');
    const paint = (body: Body): Color => new Color().setRGB(...body.color, 'srgb');
    const { fine } = this.control.detail;
    const batch = (
      of: readonly Body[],
      roughness: number,
      color: (body: Body) => Color,
      more: MeshStandardMaterialParameters = {},
    ): Batch =>
      new Batch(
        of,
        fine ? new MeshStandardMaterial({ roughness, fog: false, ...more }) : new MeshLambertMaterial({ fog: false, ...more }),
        fine,
        color,
      );
    const shown: Shown = {
      info,
      fine,
      links,
      solid: batch(solid, 0.55, paint),
      panels: batch(
        panels.map(({ body }) => body),
        0.9,
        paint,
      ),
      glass: batch(
        panels.map(({ body }) => body),
        0.9,
        paint,
        { transparent: true, opacity: 0.3, depthWrite: false },
      ),
      furniture: panels,
      // The ghost has no base: the prediction concerns the links after it.
      ghost: info.hand ? batch(links.slice(1), 1, () => GHOST, { transparent: true, opacity: 0.35, depthWrite: false }) : null,
      regions: regionLines(info.regions),
      frames: new Frames(info.moving.map((id) => links.some((link) => link.id === id))),
      centres: new Centres(links.length + 1),
      subject,
    };
    shown.solid.mesh.castShadow = true;
    shown.solid.mesh.receiveShadow = true;
    shown.panels.mesh.castShadow = true;
    shown.panels.mesh.receiveShadow = true;
    shown.glass.mesh.receiveShadow = true;
    shown.glass.mesh.renderOrder = 1;
    this.lights.show(subject, grounds[0]?.color);
    this.three.add(shown.panels.mesh, shown.glass.mesh, shown.solid.mesh, shown.regions, shown.frames.lines, shown.centres.mesh);
    if (shown.ghost) this.three.add(shown.ghost.mesh);
    this.shown = shown;
    this.picked = null;
    this.moment = null;
    this.control.restart();
    this.relabel();
    this.apply();
    // The camera stays for the next run of the same task.
    if (!same) this.view(this.director.view);
    this.dirty = true;
  }

  /** Shows a moment without interpolation. */
  show(moment: Moment): void {
    this.moment = moment;
    this.blend.jump(moment);
    this.place();
  }

  /** Moves to a moment of a live run, received at `at` (ms as of `performance.now`). */
  push(moment: Moment, at: number): void {
    const first = this.moment === null;
    this.moment = moment;
    this.blend.push(moment, at);
    if (first || this.still.matches) this.blend.jump(moment);
    this.stale = true;
  }

  setOverlay(name: OverlayName, on: boolean): void {
    if (on) this.overlays.add(name);
    else this.overlays.delete(name);
    if (name === 'names') this.relabel();
    this.apply();
    this.place();
  }

  view(name: ViewName): void {
    this.director.start(name);
    this.measure();
    this.dirty = true;
  }

  /** Takes over another stage's camera, which a person has moved. */
  lookAs(other: Stage): void {
    this.camera.position.copy(other.camera.position);
    this.controls.target.copy(other.controls.target);
    this.controls.update();
    this.director.taken(this.shown?.subject ?? null);
  }

  /** `listener` gets the clicked body, or null. */
  onPick(listener: (id: number | null, point: Vec3) => void): void {
    this.listeners.push(listener);
  }

  /** `listener` is called before each frame. */
  onFrame(listener: () => void): void {
    this.before.push(listener);
  }

  /** Highlights a body, chosen by a click or from a list. */
  pick(id: number | null, point: Vec3 = [0, 0, 0]): void {
    const old = this.shown?.info.bodies.find((body) => body.id === this.picked);
    if (old) this.shown?.solid.paint(old.id, new Color().setRGB(...old.color, 'srgb'));
    this.paint(id);
    for (const listener of this.listeners) listener(id, point);
  }

  private paint(id: number | null): void {
    this.picked = id;
    if (id !== null) this.shown?.solid.paint(id, PICKED);
    this.dirty = true;
  }

  /** World position of a body's origin, m. */
  placeOf(id: number): Vec3 | null {
    const at = this.shown?.solid.placeOf(id, this.scratch);
    return at ? [at.x, at.y, at.z] : null;
  }

  /** Position of a body on the canvas, CSS px from its upper left corner. */
  screenPosition(id: number): { x: number; y: number } | null {
    const at = this.shown?.solid.placeOf(id, this.scratch)?.project(this.camera);
    if (!at) return null;
    return { x: ((at.x + 1) / 2) * this.container.clientWidth, y: ((1 - at.y) / 2) * this.container.clientHeight };
  }

  stats(): Stats {
    const { calls, triangles } = this.renderer.info.render;
    return { drawCalls: calls, triangles, scriptMs: this.scriptMs };
  }

  /** Draws the plainest picture, or as much detail as the frame rate allows. */
  setPlain(on: boolean): void {
    this.control.setPlain(on);
    this.applyDetail();
  }

  /** Index of the present level of detail; 0 is the most detailed. */
  get detail(): number {
    return this.control.index;
  }

  /** Requests a new frame after a change from outside. */
  touch(): void {
    this.dirty = true;
  }

  dispose(): void {
    cancelAnimationFrame(this.frame);
    this.observer.disconnect();
    this.themes.removeEventListener('change', this.retheme);
    this.clear();
    this.lights.dispose();
    this.arrows.dispose();
    this.labels.clear();
    this.controls.dispose();
    document.removeEventListener('visibilitychange', this.woken);
    this.renderer.dispose();
  }

  /** Takes the background colour from the page's theme. */
  private ground(): void {
    const color = getComputedStyle(document.documentElement).getPropertyValue('--stage').trim();
    this.three.background = new Color(color || '#dfe3e8');
    this.dirty = true;
  }

  private applyDetail(): void {
    const { detail } = this.control;
    this.renderer.setDetail(detail);
    this.lights.setShadows(detail.shadows);
    if (this.shown && this.shown.fine !== detail.fine) this.rebuild(this.shown.info);
    this.resize();
  }

  /** Builds the same scene again, in another detail. */
  private rebuild(info: SceneInfo): void {
    const { moment, picked } = this;
    this.setScene(info);
    if (moment) {
      this.moment = moment;
      this.place();
    }
    if (picked !== null) this.paint(picked);
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.container;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.measure();
    this.dirty = true;
  }

  /** Measures the part of the picture that no buttons cover. */
  private measure(): void {
    const area = this.container.getBoundingClientRect();
    if (area.height === 0) return;
    let [top, bottom] = [0, 0];
    for (const over of this.container.querySelectorAll('.hud')) {
      const box = over.getBoundingClientRect();
      if (box.top - area.top < area.bottom - box.bottom) top = Math.max(top, box.bottom - area.top);
      else bottom = Math.max(bottom, area.bottom - box.top);
    }
    const left = (covered: number): number => Math.max(FILLED - (2 * covered) / area.height, LEAST);
    this.pane = { left: FILLED, right: FILLED, top: left(top), bottom: left(bottom) };
  }

  /** A click without a drag picks a body; keys turn the camera. */
  private pointer(canvas: HTMLCanvasElement): void {
    let down: { x: number; y: number } | null = null;
    canvas.addEventListener('pointerdown', (event) => {
      down = { x: event.clientX, y: event.clientY };
    });
    canvas.addEventListener('pointerup', (event) => {
      if (down && Math.hypot(event.clientX - down.x, event.clientY - down.y) < 5) {
        const hit = this.hit(event.clientX, event.clientY);
        this.pick(hit?.id ?? null, hit?.point);
      }
      down = null;
    });
    canvas.addEventListener('keydown', (event) => {
      if (!turnByKey(this.camera, this.controls, event.key)) return;
      this.director.taken(this.shown?.subject ?? null);
      event.preventDefault();
      this.dirty = true;
    });
  }

  /** The body under a point of the window. */
  hit(clientX: number, clientY: number): { id: number; point: Vec3 } | null {
    const area = this.renderer.domElement.getBoundingClientRect();
    const at = new Vector2(((clientX - area.left) / area.width) * 2 - 1, 1 - ((clientY - area.top) / area.height) * 2);
    this.raycaster.setFromCamera(at, this.camera);
    const found = this.shown ? this.raycaster.intersectObject(this.shown.solid.mesh)[0] : undefined;
    const id = this.shown?.solid.bodyOf(found?.batchId) ?? null;
    return found && id !== null ? { id, point: [found.point.x, found.point.y, found.point.z] } : null;
  }

  private relabel(): void {
    const bodies = this.overlays.has('names') ? (this.shown?.info.bodies ?? []) : [];
    const objects = bodies.filter((body) => body.kind === 'object');
    // A hand alone shows the names of its links. They are close together: names that would be far from their link are hidden.
    if (objects.length > 0) this.labels.set(objects);
    else
      this.labels.set(
        bodies.filter((body) => body.kind === 'hand'),
        12,
      );
    this.dirty = true;
  }

  /** Sets which overlays are visible. */
  private apply(): void {
    const { shown, overlays } = this;
    this.arrows.mesh.visible = overlays.has('contacts');
    if (shown) {
      if (shown.ghost) shown.ghost.mesh.visible = overlays.has('ghost');
      shown.regions.visible = overlays.has('regions');
      shown.frames.lines.visible = overlays.has('frames');
      shown.centres.mesh.visible = overlays.has('com');
    }
    this.dirty = true;
  }

  /** Moves all bodies and overlays to the current poses. */
  private place(): void {
    const { shown, moment } = this;
    this.stale = false;
    if (!shown) return;
    shown.info.moving.forEach((id, row) => shown.solid.move(id, this.blend.poses, this.blend.poses, row * POSE, row * POSE + 3));
    const predicted = moment?.telemetry?.predicted;
    if (shown.ghost && this.overlays.has('ghost')) this.placeGhost(shown, predicted ?? null);
    if (this.overlays.has('contacts')) this.arrows.show(moment?.contacts ?? []);
    if (this.overlays.has('frames')) shown.frames.show((k, into) => shown.solid.matrixOf(shown.info.moving[k] ?? -1, into));
    if (this.overlays.has('com')) this.placeCentres(shown);
    shown.subject.place((id, into) => shown.solid.matrixOf(id, into));
    this.dirty = true;
  }

  private placeGhost(shown: Shown, predicted: number[] | null): void {
    const base = shown.links[0];
    const row = base ? shown.info.moving.indexOf(base.id) * POSE : -1;
    if (shown.ghost) shown.ghost.mesh.visible = predicted !== null && row >= 0;
    if (!shown.ghost || !shown.info.hand || !predicted || row < 0) return;
    const p = this.blend.poses;
    const at = (k: number): number => p[row + k] ?? 0;
    const places = forwardKinematics(shown.info.hand, predicted, { position: [at(0), at(1), at(2)], quat: [at(3), at(4), at(5), at(6)] });
    for (const link of shown.links) {
      const pose = places.get(link.name);
      if (pose) shown.ghost.move(link.id, pose.position, pose.quat);
    }
  }

  /** Centres of mass of each link and of the whole hand. */
  private placeCentres(shown: Shown): void {
    const all: Vector3[] = [];
    const whole = new Vector3();
    let mass = 0;
    for (const described of shown.info.hand?.links ?? []) {
      const link = shown.links.find((body) => body.name === described.name);
      if (!link || !shown.solid.matrixOf(link.id, this.matrix)) continue;
      const at = new Vector3(...described.com).applyMatrix4(this.matrix);
      all.push(at);
      whole.addScaledVector(at, described.mass);
      mass += described.mass;
    }
    if (mass > 0) all.push(whole.divideScalar(mass));
    shown.centres.show(all);
  }

  private draw(now: number): void {
    const begun = performance.now();
    if (this.blend.advance(now) || this.stale) this.place();
    for (const listener of this.before) listener();
    if (this.control.frame(now, this.dirty)) {
      keepLevel(this.control.index);
      this.applyDetail();
    }
    if (!this.dirty) return;
    this.dirty = false;
    if (this.shown) this.direct(this.shown, now);
    if (this.three.background instanceof Color) this.lights.fade(this.three.background, this.camera.position);
    const { clientWidth, clientHeight } = this.container;
    this.labels.place(this.camera, clientWidth, clientHeight, (id, into) => this.shown?.solid.placeOf(id, into) ?? null);
    this.renderer.render(this.three, this.camera);
    this.scriptMs = performance.now() - begun;
  }

  /** Moves the camera; panels become glass that it looks at from outside, or that hide the hand. */
  private direct({ subject, panels, glass, furniture }: Shown, now: number): void {
    if (this.holding || !this.controls.enabled) this.director.along(subject, !this.controls.enabled);
    else this.dirty = this.director.frame(subject, this.pane, now, this.still.matches);
    const eye = this.camera.position;
    for (const blocker of subject.blockers) {
      const panel = blocker.kind === 'object' ? undefined : furniture[blocker.body];
      if (!panel) continue;
      const outside = panel.outward !== null && panel.outward.dot(this.scratch.copy(eye).sub(panel.middle)) > 0;
      const hides = outside || subject.links.filter((link) => blocks(blocker, eye, link)).length > HIDES * subject.links.length;
      panels.setVisible(blocker.body, !hides);
      glass.setVisible(blocker.body, hides);
    }
  }

  private clear(): void {
    const { shown } = this;
    if (!shown) return;
    const gone: (Batch | null)[] = [shown.solid, shown.panels, shown.glass, shown.ghost];
    for (const batch of gone) {
      if (!batch) continue;
      const material = batch.mesh.material;
      batch.dispose();
      for (const one of Array.isArray(material) ? material : [material]) one.dispose();
    }
    for (const drawn of [shown.regions, shown.frames.lines, shown.centres.mesh]) {
      drawn.removeFromParent();
      drawn.geometry.dispose();
      for (const one of Array.isArray(drawn.material) ? drawn.material : [drawn.material]) one.dispose();
    }
    shown.centres.mesh.dispose();
    this.shown = null;
  }
}
