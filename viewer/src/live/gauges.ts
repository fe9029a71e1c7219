/**
 * The hand's telemetry as bars and figures: motors, tensions, contact forces on fingers and patches, sensors, deviation of joints from
 * the prediction.
 */
import { points } from '../ui/format';
import { el, nameInWords, setText } from '../ui/elements';
import { type Channel, readingsOf } from '../model/channel';
import type { Telemetry } from '../model/moment';
import type { HandDescription } from '../wire/messages';

/** Number of listed joints: those farthest from the prediction. */
const LISTED = 6;
const DEGREES = 180 / Math.PI;
/** Force of a full bar, N. */
const FINGER_N = 100;
const PATCH_N = 20;

interface Gauge {
  row: HTMLElement;
  meter: HTMLMeterElement;
  figure: HTMLElement;
}

function gauge(label: string, max: number, unit: string): Gauge {
  const meter = el('meter', { min: 0, max, 'aria-label': label });
  const figure = el('output', {});
  return {
    row: el('div', { class: 'slider' }, el('span', {}, nameInWords(label)), meter, figure, el('span', { class: 'visually-hidden' }, unit)),
    meter,
    figure,
  };
}

function sliders(gauges: readonly Gauge[]): HTMLElement {
  return el('div', { class: 'sliders' }, ...gauges.map(({ row }) => row));
}

export class Gauges {
  readonly element = el('details', { class: 'panel', hidden: true, open: true });
  private motors: Gauge[] = [];
  private tendons: Gauge[] = [];
  private fingers: Gauge[] = [];
  private patches: Gauge[] = [];
  private joints = el('dl', { class: 'facts' });
  private readings = el('dl', { class: 'facts' });
  private hand: HandDescription | null = null;
  private channels: readonly Channel[] = [];

  /** Creates the gauges of a hand; `channels`: those of `Telemetry.readings`. */
  setHand(hand: HandDescription | null, channels: readonly Channel[]): void {
    this.hand = hand;
    this.channels = channels;
    this.element.hidden = hand === null;
    if (!hand) return;
    this.motors = hand.motors.map((motor) => gauge(`${motor.name}, closed`, 1, 'of 1'));
    this.tendons = hand.tendons.map((tendon) => gauge(`${tendon.name}, tension`, tendon.force_limit, ''));
    this.fingers = (hand.fingers ?? []).map((name) => gauge(name, FINGER_N, 'N'));
    this.patches = (hand.tactile ?? []).map((patch) => gauge(patch.name, PATCH_N, 'N'));
    const skin = this.patches.length > 0 ? [el('h3', {}, 'Force on each tactile patch, N'), sliders(this.patches)] : [];
    this.joints = el('dl', { class: 'facts' });
    this.readings = el('dl', { class: 'facts' });
    const sensors = channels.length > 0 ? [el('h3', {}, 'Sensors'), this.readings] : [];
    this.element.replaceChildren(
      el('summary', {}, 'Hand: motors and sensors'),
      sliders([...this.motors, ...this.tendons]),
      el('h3', {}, 'Contact force on each finger, N'),
      sliders(this.fingers),
      ...skin,
      ...sensors,
      el('h3', {}, 'Farthest from the predicted equilibrium'),
      this.joints,
    );
  }

  show(telemetry: Telemetry): void {
    telemetry.motors.forEach((motor, k) => {
      const work = motor.work === undefined ? '' : `, ${motor.work.toFixed(2)} J`;
      set(this.motors[k], motor.position, `${motor.position.toFixed(2)}${work}`);
    });
    telemetry.fingers?.forEach(({ force }, k) => newtons(this.fingers[k], Math.hypot(...force)));
    let taxel = 0;
    this.hand?.tactile?.forEach((patch, k) => {
      const count = patch.taxels[0] * patch.taxels[1];
      const pressed = (telemetry.touch ?? []).slice(taxel, taxel + count);
      newtons(
        this.patches[k],
        pressed.reduce((sum, force) => sum + (force[2] ?? 0), 0),
      );
      taxel += count;
    });
    telemetry.tension.forEach((tension, k) => set(this.tendons[k], Math.abs(tension), tension.toPrecision(3)));
    this.readings.replaceChildren(
      ...readingsOf(this.channels, telemetry.readings ?? []).flatMap(({ label, unit, numbers }) => [
        el('dt', {}, label),
        el('dd', { class: 'num' }, `${numbers.map((x) => x.toFixed(2)).join(', ')} ${unit}`),
      ]),
    );
    const { predicted, q } = telemetry;
    if (!predicted) {
      this.joints.replaceChildren(el('dt', {}, 'No prediction'), el('dd', {}, 'not available for this hand'));
      return;
    }
    const deviations = q.map((value, k) => ({
      name: this.hand?.coordinates[k]?.name ?? String(k),
      by: (value - (predicted[k] ?? value)) * DEGREES,
    }));
    deviations.sort((a, b) => Math.abs(b.by) - Math.abs(a.by));
    this.joints.replaceChildren(
      ...deviations.slice(0, LISTED).flatMap(({ name, by }) => [el('dt', {}, name), el('dd', { class: 'num' }, `${points(by)}°`)]),
    );
  }
}

function newtons(gauge: Gauge | undefined, value: number): void {
  set(gauge, value, value.toFixed(1));
}

function set(gauge: Gauge | undefined, value: number, text: string): void {
  if (!gauge) return;
  gauge.meter.value = value;
  setText(gauge.figure, text);
}
