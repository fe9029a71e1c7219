/** Light and ground as in the pictures of `palmares render`: a lamp with shadows, light of the sky, a ground that fades away. */
import {
  Color,
  DirectionalLight,
  Fog,
  GridHelper,
  HemisphereLight,
  Mesh,
  MeshBasicMaterial,
  MeshLambertMaterial,
  PlaneGeometry,
  type Scene,
  type Vector3,
} from 'three';
import type { Vec3 } from '../model/scene';
import type { Subject } from './subject';

/** Parts of the light that come from the lamp, and from the sky from above and from below; those of `senses/src/camera/film.rs`. */
const [LAMP, SKY, FLOOR] = [0.8, 0.34, 0.14];
/** From the scene to the lamp: 50 degrees left of the first view, 58 degrees above the ground. */
const TO_LAMP: Vec3 = [-0.19, -0.495, 0.848];
/** Distance of the lamp, and space around the scene that has shadows, as shares of the scene's radius. */
const [AWAY, WITH_SHADOWS] = [4, 1.25];
/** The ground fades from this multiple of the scene's distance on, and is gone at the second one. */
const [FADES, GONE] = [0.6, 3];
/** The ground has this share of the background's colour in a light and in a dark theme, which begins below that brightness. */
const [LIGHT, DARK, DARK_BELOW] = [0.3, 0.75, 0.2];
/** The ground without a scene that has one. */
const GREY: Vec3 = [0.55, 0.57, 0.6];

export class Lights {
  private readonly sun = new DirectionalLight('#ffffff', Math.PI * LAMP);
  private readonly sky = new HemisphereLight('#ffffff', new Color().setScalar(FLOOR / SKY), Math.PI * SKY);
  private readonly fog = new Fog('#ffffff');
  private readonly color = new Color().setRGB(...GREY, 'srgb');
  private readonly shaded = new MeshLambertMaterial();
  /** Without shadows: the shaded ground has one colour. */
  private readonly plain = new MeshBasicMaterial();
  private readonly ground: Mesh = new Mesh(new PlaneGeometry(60, 60), this.shaded);
  /** Shows distances where no shadow does. */
  private readonly grid = new GridHelper(6, 60, '#6f767e', '#868d95').rotateX(Math.PI / 2);

  constructor(scene: Scene) {
    this.sun.shadow.mapSize.set(2048, 2048);
    this.sun.shadow.normalBias = 0.004;
    this.sun.shadow.radius = 2.5;
    this.ground.receiveShadow = true;
    scene.fog = this.fog;
    scene.add(this.sky, this.sun, this.sun.target, this.ground, this.grid);
  }

  /** Lights a scene; `color`: sRGB of its ground, if it has one. */
  show({ scene: points, ground }: Subject, color: Vec3 = GREY): void {
    const centre = points.reduce((sum, point) => sum.add(point), this.sun.target.position.set(0, 0, 0)).divideScalar(points.length);
    const radius =
      WITH_SHADOWS *
      Math.max(
        points.reduce((most, point) => Math.max(most, point.distanceTo(centre)), 0),
        0.4,
      );
    this.sun.position
      .set(...TO_LAMP)
      .multiplyScalar(AWAY * radius)
      .add(centre);
    const eye = this.sun.shadow.camera;
    [eye.left, eye.right, eye.top, eye.bottom, eye.near, eye.far] = [-radius, radius, radius, -radius, 0.1, (AWAY + 2) * radius];
    eye.updateProjectionMatrix();
    this.sun.target.updateMatrixWorld();
    this.color.setRGB(...color, 'srgb');
    this.ground.position.z = Number.isFinite(ground) ? ground : 0;
    this.grid.position.z = this.ground.position.z + 0.0005;
  }

  /** The ground fades into this colour with the distance from `camera`. */
  fade(background: Color, camera: Vector3): void {
    const distance = camera.distanceTo(this.sun.target.position);
    this.fog.color.copy(background);
    [this.fog.near, this.fog.far] = [FADES * distance, GONE * distance];
    this.shaded.color.copy(this.color).lerp(background, background.g < DARK_BELOW ? DARK : LIGHT);
    this.plain.color.copy(this.shaded.color).multiplyScalar(LAMP * TO_LAMP[2] + SKY);
  }

  /** Draws shadows, or none. */
  setShadows(on: boolean): void {
    this.sun.castShadow = on;
    this.grid.visible = !on;
    this.ground.material = on ? this.shaded : this.plain;
  }

  dispose(): void {
    for (const one of [this.sky, this.sun, this.sun.target, this.ground, this.grid]) one.removeFromParent();
    this.sun.dispose();
    for (const one of [this.ground, this.grid]) one.geometry.dispose();
    for (const one of [this.shaded, this.plain, this.grid.material]) one.dispose();
  }
}
