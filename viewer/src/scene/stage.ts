/** The picture of a world: bodies, hand, lights, camera and overlays. It draws only when something has changed. */
import {
  Box3, Color, DirectionalLight, GridHelper, HemisphereLight, Matrix4, Mesh, MeshStandardMaterial, PCFSoftShadowMap, PerspectiveCamera,
  PlaneGeometry, Raycaster, Scene, ShadowMaterial, Vector2, Vector3, WebGLRenderer, type LineSegments, type Object3D,
} from 'three';
import { OrbitControls } from 'three/addons/controls/OrbitControls.js';
import { forwardKinematics } from '../model/hand';
import { type Moment, POSE } from '../model/moment';
import type { Body, SceneInfo, Vec3 } from '../model/scene';
import { Arrows } from './arrows';
import { Batch } from './batch';
import { Blend } from './blend';
import { Labels } from './labels';
import { Centres, Frames, regionLines } from './marks';
import { type ViewName, look } from './views';

export type { ViewName } from './views';
export type OverlayName = 'ghost' | 'contacts' | 'regions' | 'frames' | 'names' | 'com';

/** What drawing costs: of the last frame. */
export interface Stats { drawCalls: number; triangles: number; scriptMs: number }

const PICKED = new Color('#ffb000');
const GHOST = new Color('#56b4e9');

/** Parts of the scene that belong to one run. */
interface Shown {
  info: SceneInfo;
  solid: Batch;
  furniture: Batch;
  ghost: Batch | null;
  regions: LineSegments;
  frames: Frames;
  centres: Centres;
  links: Body[];
  box: Box3;
}

export class Stage {
  readonly camera = new PerspectiveCamera(45, 1, 0.01, 50);
  readonly three = new Scene();
  readonly renderer: WebGLRenderer;
  readonly controls: OrbitControls;
  private readonly blend = new Blend();
  private readonly arrows = new Arrows();
  private readonly labels: Labels;
  private readonly overlays = new Set<OverlayName>();
  private readonly observer: ResizeObserver;
  private readonly raycaster = new Raycaster();
  private readonly scratch = new Vector3();
  private readonly matrix = new Matrix4();
  private readonly sun = new DirectionalLight('#ffffff', 2.2);
  private shown: Shown | null = null;
  private moment: Moment | null = null;
  private viewName: ViewName = 'free';
  private picked: number | null = null;
  private listeners: ((id: number | null, point: Vec3) => void)[] = [];
  private before: (() => void)[] = [];
  private dirty = true;
  private frame = 0;
  private scriptMs = 0;

  constructor(private readonly container: HTMLElement) {
    this.renderer = new WebGLRenderer({ antialias: true });
    this.renderer.shadowMap.enabled = true;
    this.renderer.shadowMap.type = PCFSoftShadowMap;
    this.renderer.setPixelRatio(Math.min(window.devicePixelRatio, 2));
    const canvas = this.renderer.domElement;
    canvas.tabIndex = 0;
    canvas.setAttribute('role', 'img');
    canvas.setAttribute('aria-label', 'The world in three dimensions. Arrow keys turn the camera, plus and minus zoom.');
    container.append(canvas);
    this.labels = new Labels(container);
    this.camera.up.set(0, 0, 1);
    this.camera.position.set(0.8, -1.4, 1.1);
    this.controls = new OrbitControls(this.camera, canvas);
    this.controls.addEventListener('change', () => { this.dirty = true; });
    this.controls.addEventListener('start', () => { if (this.viewName === 'follow') this.dirty = true; });
    this.lights();
    this.three.add(this.arrows.mesh);
    this.arrows.mesh.visible = false;
    this.observer = new ResizeObserver(() => { this.resize(); });
    this.observer.observe(container);
    matchMedia('(prefers-color-scheme: dark)').addEventListener('change', () => { this.ground(); });
    this.ground();
    this.resize();
    this.pointer(canvas);
    const loop = (now: number): void => {
      this.frame = requestAnimationFrame(loop);
      this.draw(now);
    };
    this.frame = requestAnimationFrame(loop);
  }

  /** Another world; what was drawn of the last one is freed. */
  setScene(info: SceneInfo): void {
    this.clear();
    const solid = info.bodies.filter((body) => body.kind !== 'furniture');
    const furniture = info.bodies.filter((body) => body.kind === 'furniture');
    const links = info.bodies.filter((body) => body.kind === 'hand');
    const paint = (body: Body): Color => new Color().setRGB(...body.color, 'srgb');
    const shown: Shown = {
      info,
      links,
      solid: new Batch(solid, new MeshStandardMaterial({ roughness: 0.55 }), paint),
      furniture: new Batch(furniture, new MeshStandardMaterial({ roughness: 0.9, transparent: true, opacity: 0.38, depthWrite: false }), paint),
      ghost: info.hand ? new Batch(links, new MeshStandardMaterial({ transparent: true, opacity: 0.35, depthWrite: false }), () => GHOST) : null,
      regions: regionLines(info.regions),
      frames: new Frames(info.moving.length),
      centres: new Centres(links.length + 1),
      box: sceneBox(info),
    };
    shown.solid.mesh.castShadow = true;
    shown.solid.mesh.receiveShadow = true;
    shown.furniture.mesh.receiveShadow = true;
    shown.furniture.mesh.renderOrder = 1;
    this.three.add(shown.furniture.mesh, shown.solid.mesh, shown.regions, shown.frames.lines, shown.centres.mesh);
    if (shown.ghost) this.three.add(shown.ghost.mesh);
    this.shown = shown;
    this.picked = null;
    this.moment = null;
    this.relabel();
    this.apply();
    this.view(this.viewName);
    this.dirty = true;
  }

  /** Shows a moment as it is. */
  show(moment: Moment): void {
    this.moment = moment;
    this.blend.jump(moment);
    this.place();
  }

  /** Shows a moment of a live world, which came at `at` (ms as of `performance.now`). */
  push(moment: Moment, at: number): void {
    const first = this.moment === null;
    this.moment = moment;
    this.blend.push(moment, at);
    if (first || matchMedia('(prefers-reduced-motion: reduce)').matches) this.blend.jump(moment);
    this.place();
  }

  setOverlay(name: OverlayName, on: boolean): void {
    if (on) this.overlays.add(name);
    else this.overlays.delete(name);
    if (name === 'names') this.relabel();
    this.apply();
    this.place();
  }

  view(name: ViewName): void {
    this.viewName = name;
    if (this.shown) look(this.camera, this.controls, name, this.shown.box, this.handPlace());
    this.dirty = true;
  }

  /** Told of the body that is clicked, or of none. */
  onPick(listener: (id: number | null, point: Vec3) => void): void {
    this.listeners.push(listener);
  }

  /** Called before each frame is drawn. */
  onFrame(listener: () => void): void {
    this.before.push(listener);
  }

  /** Marks a body, by a click or a list beside the picture. */
  pick(id: number | null, point: Vec3 = [0, 0, 0]): void {
    const body = (which: number | null): Body | undefined => this.shown?.info.bodies.find((b) => b.id === which);
    const old = body(this.picked);
    if (old) this.shown?.solid.paint(old.id, new Color().setRGB(...old.color, 'srgb'));
    this.picked = id;
    if (id !== null) this.shown?.solid.paint(id, PICKED);
    this.dirty = true;
    for (const listener of this.listeners) listener(id, point);
  }

  /** Where a body's origin is in the world, m. */
  placeOf(id: number): Vec3 | null {
    const at = this.shown?.solid.placeOf(id, this.scratch);
    return at ? [at.x, at.y, at.z] : null;
  }

  /** Where a body is in the picture, CSS px from its upper left corner. */
  screenPosition(id: number): { x: number; y: number } | null {
    const at = this.shown?.solid.placeOf(id, this.scratch)?.project(this.camera);
    if (!at) return null;
    return { x: ((at.x + 1) / 2) * this.container.clientWidth, y: ((1 - at.y) / 2) * this.container.clientHeight };
  }

  stats(): Stats {
    const { calls, triangles } = this.renderer.info.render;
    return { drawCalls: calls, triangles, scriptMs: this.scriptMs };
  }

  /** Something was changed from outside: draw again. */
  touch(): void {
    this.dirty = true;
  }

  dispose(): void {
    cancelAnimationFrame(this.frame);
    this.observer.disconnect();
    this.clear();
    this.controls.dispose();
    this.renderer.dispose();
    this.renderer.domElement.remove();
  }

  private lights(): void {
    this.three.add(new HemisphereLight('#ffffff', '#9a948c', 1.3));
    this.sun.position.set(0.9, -1.1, 2.4);
    this.sun.castShadow = true;
    this.sun.shadow.mapSize.set(1024, 1024);
    const eye = this.sun.shadow.camera;
    [eye.left, eye.right, eye.top, eye.bottom, eye.near, eye.far] = [-1.4, 1.4, 1.4, -1.4, 0.1, 6];
    this.sun.shadow.normalBias = 0.004;
    this.three.add(this.sun, this.sun.target);
    const floor = new Mesh(new PlaneGeometry(8, 8), new ShadowMaterial({ opacity: 0.28 }));
    floor.receiveShadow = true;
    floor.position.z = -0.0005;
    const grid = new GridHelper(4, 40, '#7b838c', '#a5acb4').rotateX(Math.PI / 2);
    grid.position.z = -0.001;
    grid.material.transparent = true;
    grid.material.opacity = 0.35;
    this.three.add(floor, grid);
  }

  /** The colour behind everything is the page's. */
  private ground(): void {
    const color = getComputedStyle(document.documentElement).getPropertyValue('--stage').trim();
    this.three.background = new Color(color || '#dfe3e8');
    this.dirty = true;
  }

  private resize(): void {
    const { clientWidth: width, clientHeight: height } = this.container;
    if (width === 0 || height === 0) return;
    this.renderer.setSize(width, height, false);
    this.camera.aspect = width / height;
    this.camera.updateProjectionMatrix();
    this.dirty = true;
  }

  /** A click that is no drag picks; keys turn the camera. */
  private pointer(canvas: HTMLCanvasElement): void {
    let down: { x: number; y: number } | null = null;
    canvas.addEventListener('pointerdown', (event) => { down = { x: event.clientX, y: event.clientY }; });
    canvas.addEventListener('pointerup', (event) => {
      if (down && Math.hypot(event.clientX - down.x, event.clientY - down.y) < 5) {
        const hit = this.hit(event.clientX, event.clientY);
        this.pick(hit?.id ?? null, hit?.point);
      }
      down = null;
    });
    canvas.addEventListener('keydown', (event) => {
      const turns: Record<string, [number, number]> = { ArrowLeft: [-0.1, 0], ArrowRight: [0.1, 0], ArrowUp: [0, -0.1], ArrowDown: [0, 0.1] };
      const turn = turns[event.key];
      const zoom = event.key === '+' || event.key === '=' ? 0.9 : event.key === '-' ? 1 / 0.9 : null;
      if (!turn && zoom === null) return;
      event.preventDefault();
      const offset = this.camera.position.clone().sub(this.controls.target);
      if (zoom !== null) offset.multiplyScalar(zoom);
      if (turn) {
        const polar = Math.min(Math.max(Math.acos(offset.z / offset.length()) + turn[1], 0.02), Math.PI - 0.02);
        const around = Math.atan2(offset.y, offset.x) + turn[0];
        offset.setFromSphericalCoords(offset.length(), polar, 0);
        const flat = Math.hypot(offset.x, offset.z);
        offset.set(flat === 0 ? 0 : Math.cos(around) * Math.sin(polar) * offset.length(), Math.sin(around) * Math.sin(polar) * offset.length(), Math.cos(polar) * offset.length());
      }
      this.camera.position.copy(this.controls.target).add(offset);
      this.controls.update();
    });
  }

  /** What is under a point of the window. */
  hit(clientX: number, clientY: number): { id: number; point: Vec3 } | null {
    const area = this.renderer.domElement.getBoundingClientRect();
    const at = new Vector2(((clientX - area.left) / area.width) * 2 - 1, 1 - ((clientY - area.top) / area.height) * 2);
    this.raycaster.setFromCamera(at, this.camera);
    const found = this.shown ? this.raycaster.intersectObject(this.shown.solid.mesh)[0] : undefined;
    const id = this.shown?.solid.bodyOf(found?.batchId) ?? null;
    return found && id !== null ? { id, point: [found.point.x, found.point.y, found.point.z] } : null;
  }

  private handPlace(): Vector3 | null {
    const base = this.shown?.links[0];
    return base ? this.shown?.solid.placeOf(base.id, new Vector3()) ?? null : null;
  }

  private relabel(): void {
    const on = this.overlays.has('names') && this.shown;
    this.labels.set(on ? this.shown?.info.bodies.filter((body) => body.kind === 'object') ?? [] : []);
    this.dirty = true;
  }

  /** Which overlays are seen. */
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

  /** Puts everything where the present poses say. */
  private place(): void {
    const { shown, moment } = this;
    if (!shown) return;
    shown.info.moving.forEach((id, row) => { shown.solid.move(id, this.blend.poses, this.blend.poses, row * POSE, row * POSE + 3); });
    const predicted = moment?.telemetry?.predicted;
    if (shown.ghost && this.overlays.has('ghost')) this.placeGhost(shown, predicted ?? null);
    if (this.overlays.has('contacts')) this.arrows.show(moment?.contacts ?? []);
    if (this.overlays.has('frames')) shown.frames.show((k, into) => shown.solid.matrixOf(shown.info.moving[k] ?? -1, into));
    if (this.overlays.has('com')) this.placeCentres(shown);
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

  /** Of every link, and of the hand as a whole. */
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
    if (this.blend.advance(now)) this.place();
    for (const listener of this.before) listener();
    if (!this.dirty) return;
    this.dirty = false;
    if (this.viewName === 'follow') this.follow();
    const { clientWidth, clientHeight } = this.container;
    this.labels.place(this.camera, clientWidth, clientHeight, (id, into) => this.shown?.solid.placeOf(id, into) ?? null);
    this.renderer.render(this.three, this.camera);
    this.scriptMs = performance.now() - begun;
  }

  private follow(): void {
    const hand = this.handPlace();
    if (!hand) return;
    const step = hand.sub(this.controls.target);
    this.controls.target.add(step);
    this.camera.position.add(step);
    this.camera.lookAt(this.controls.target);
  }

  private clear(): void {
    const { shown } = this;
    if (!shown) return;
    const gone: (Batch | null)[] = [shown.solid, shown.furniture, shown.ghost];
    for (const batch of gone) {
      if (!batch) continue;
      const material = batch.mesh.material;
      batch.dispose();
      for (const one of Array.isArray(material) ? material : [material]) one.dispose();
    }
    for (const drawn of [shown.regions, shown.frames.lines, shown.centres.mesh] as (Object3D & { geometry: { dispose(): void } })[]) {
      drawn.removeFromParent();
      drawn.geometry.dispose();
    }
    this.shown = null;
  }
}

/** A box around what is worth looking at: objects, regions and the hand. */
function sceneBox(info: SceneInfo): Box3 {
  const box = new Box3();
  for (const body of info.bodies) if (body.kind !== 'furniture') box.expandByPoint(new Vector3(...body.position));
  for (const region of info.regions) box.expandByPoint(new Vector3(...region.min)).expandByPoint(new Vector3(...region.max));
  return box.isEmpty() ? new Box3(new Vector3(-0.3, -0.3, 0), new Vector3(0.3, 0.3, 0.4)) : box.expandByScalar(0.05);
}
