/** SVG drawings of a hand at rest: three sides and one that turns, with a scale bar. */
import { el } from '../ui/elements';
import { type HandShapes, type Outline, outlines, turntable, type View, VIEWS } from './outline';

const SVG = 'http://www.w3.org/2000/svg';
/** Edge of a drawing, SVG units. */
const EDGE = 200;
/** Turns per second of the turning drawing. */
const TURN = 0.08;

function svg(tag: string, attributes: Record<string, string | number>): SVGElement {
  const made = document.createElementNS(SVG, tag);
  for (const [name, value] of Object.entries(attributes)) made.setAttribute(name, String(value));
  return made;
}

/** Centre and half edge of the drawn area, m. */
interface Frame {
  x: number;
  y: number;
  half: number;
}

function frameOf(all: readonly Outline[]): Frame {
  const corners = all.flatMap((one) => one.corners);
  const [xs, ys] = [corners.map((c) => c[0]), corners.map((c) => c[1])];
  const [x0, x1, y0, y1] = [Math.min(...xs), Math.max(...xs), Math.min(...ys), Math.max(...ys)];
  return { x: (x0 + x1) / 2, y: (y0 + y1) / 2, half: Math.max(x1 - x0, y1 - y0, 1e-3) * 0.54 };
}

function draw(picture: SVGElement, all: readonly Outline[], frame: Frame): void {
  const scale = EDGE / 2 / frame.half;
  const drawn = all.map((one) =>
    svg('polygon', {
      class: one.link === 0 ? 'base' : `link l${one.link % 3}`,
      points: one.corners
        .map(([x, y]) => `${((x - frame.x) * scale + EDGE / 2).toFixed(1)},${(EDGE / 2 - (y - frame.y) * scale).toFixed(1)}`)
        .join(' '),
    }),
  );
  // Scale bar of 5 cm.
  const bar = svg('path', { class: 'scale', d: `M8 ${EDGE - 8}h${(0.05 * scale).toFixed(1)}` });
  picture.replaceChildren(...drawn, bar);
}

function picture(label: string): SVGElement {
  return svg('svg', { viewBox: `0 0 ${EDGE} ${EDGE}`, role: 'img', 'aria-label': label, class: 'hand-picture' });
}

/** One drawing with its title. */
export function side(hand: HandShapes, title: string, view: View): HTMLElement {
  const made = picture(`${hand.name}, ${title}`);
  const seen = outlines(hand, view);
  draw(made, seen, frameOf(seen));
  return el('figure', {}, made, el('figcaption', {}, title));
}

/** The four drawings. The turning one stops when it is removed from the page. */
export function sides(hand: HandShapes): HTMLElement {
  const moving = picture(`${hand.name}, turned`);
  const angle = el('input', {
    type: 'range',
    min: 0,
    max: 360,
    step: 1,
    value: 30,
    id: 'turned',
    'aria-label': 'Angle of the hand, degrees',
  });
  const still = matchMedia('(prefers-reduced-motion: reduce)').matches;
  const whole = Array.from({ length: 12 }, (_, i) => outlines(hand, turntable((i * Math.PI) / 6))).flat();
  const frame = frameOf(whole);
  const show = (degrees: number): void => draw(moving, outlines(hand, turntable((degrees * Math.PI) / 180)), frame);
  let own = !still;
  let last = 0;
  angle.addEventListener('input', () => {
    own = false;
    show(Number(angle.value));
  });
  show(30);
  const turn = (now: number): void => {
    if (!own || (last > 0 && !moving.isConnected)) return;
    // At most twenty frames a second.
    if (now - last > 50) {
      const degrees = (Number(angle.value) + (last > 0 ? Math.min(now - last, 200) * 0.36 * TURN : 0)) % 360;
      angle.step = 'any';
      angle.value = String(degrees);
      show(degrees);
      last = now;
    }
    requestAnimationFrame(turn);
  };
  if (own) requestAnimationFrame(turn);
  return el(
    'div',
    { class: 'sides' },
    side(hand, 'palm', VIEWS.palm),
    side(hand, 'side', VIEWS.side),
    side(hand, 'from the fingertips', VIEWS.top),
    el('figure', {}, moving, el('figcaption', {}, el('div', { class: 'slider' }, el('label', { for: 'turned' }, 'turn'), angle))),
    el('p', { class: 'hint' }, 'The bar is 5 cm long.'),
  );
}
