/** Tables of the hand's joints, matrices, tendons and links, with the values at the shown pose. */
import { figure } from '../ui/format';
import { button, type Child, el, name, setText } from '../ui/elements';
import { isAngle } from './numbers';
import type { EquilibriumResponse, HandDescription } from '../wire/messages';

const DEGREES = 180 / Math.PI;
type Cell = Child | HTMLElement;

interface Column {
  head: Child;
  text?: boolean;
  hint?: string;
}

/** A table with row headings. */
function table(label: string, columns: readonly Column[], rows: readonly (readonly Cell[])[]): HTMLElement {
  return el(
    'div',
    { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': label },
    el(
      'table',
      { class: 'dense' },
      el(
        'thead',
        {},
        el(
          'tr',
          {},
          ...columns.map(({ head, text, hint }) => el('th', { scope: 'col', class: text ? undefined : 'n', title: hint }, head)),
        ),
      ),
      el(
        'tbody',
        {},
        ...rows.map((row) =>
          el(
            'tr',
            {},
            ...row.map((cell, k) =>
              k === 0 ? el('th', { scope: 'row' }, cell) : el('td', { class: columns[k]?.text ? undefined : 'n' }, cell),
            ),
          ),
        ),
      ),
    ),
  );
}

/** Fixed digits with a true minus sign. */
export function fixed(value: number, digits: number): string {
  return (Math.abs(value) < 0.5 * 10 ** -digits ? 0 : value).toFixed(digits).replace('-', '−');
}

export class Tables {
  readonly element: HTMLElement;
  private readonly now: HTMLElement[];
  private readonly torques: { spring: HTMLElement; load: HTMLElement; tendon: HTMLElement }[];
  private readonly tension: HTMLElement[];
  private readonly wound: HTMLElement[];
  private readonly angle: boolean[];

  constructor(
    private readonly hand: HandDescription,
    extra: readonly (readonly [string, () => HTMLElement])[],
  ) {
    const { coordinates, tendons } = hand;
    this.angle = coordinates.map((c) => isAngle(hand, c.name));
    this.now = coordinates.map(() => el('b', {}, '–'));
    this.torques = coordinates.map(() => ({ spring: el('span', {}, '–'), load: el('span', {}, '–'), tendon: el('span', {}, '–') }));
    this.tension = tendons.map(() => el('b', {}, '–'));
    this.wound = tendons.map(() => el('span', {}, '–'));
    const pages: readonly (readonly [string, () => HTMLElement])[] = [
      ['Joints', () => this.joints()],
      ['R and E', () => this.matrix()],
      ['Tendons', () => this.tendons()],
      ['Links', () => this.links()],
      ...extra,
    ];
    const place = el('div');
    const made = new Map<string, HTMLElement>();
    const tabs = el('div', { class: 'group', role: 'group', 'aria-label': 'Tables' });
    for (const [title, make] of pages) {
      const tab = button(
        title,
        () => {
          const page = made.get(title) ?? make();
          made.set(title, page);
          place.replaceChildren(page);
          for (const other of tabs.children) other.setAttribute('aria-pressed', String(other === tab));
        },
        { class: 'small', 'aria-pressed': 'false' },
      );
      tabs.append(tab);
    }
    this.element = el('div', { class: 'dock tables' }, tabs, place);
    tabs.querySelector('button')?.click();
  }

  /** Updates the values of the shown pose. */
  show(rest: EquilibriumResponse, sigma: readonly number[]): void {
    const { coordinates, tendons, motors } = this.hand;
    coordinates.forEach((c, k) => {
      const q = rest.q[k] ?? 0;
      // In equilibrium the torques of springs, loads, tendons and joint stops add up to zero.
      const [spring, load] = [c.stiffness * (c.rest - q), rest.torque[k] ?? 0];
      const at = this.now[k];
      if (at) setText(at, this.length(k, q));
      const cells = this.torques[k];
      if (!cells) return;
      setText(cells.spring, fixed(spring, 3));
      setText(cells.load, fixed(load, 3));
      setText(cells.tendon, fixed(-spring - load, 3));
    });
    tendons.forEach((tendon, k) => {
      const motor = motors.findIndex((one) => one.name === tendon.motor);
      const [pull, wound] = [this.tension[k], this.wound[k]];
      if (pull) setText(pull, figure(rest.tension[k]));
      if (wound) setText(wound, figure((motors[motor]?.scaling ?? 0) * ((sigma[motor] ?? 0) - (motors[motor]?.offset ?? 0))));
    });
  }

  /** Degrees or millimetres. */
  private length(k: number, value: number | null): string {
    if (value === null) return '–';
    return this.angle[k] ? `${fixed(value * DEGREES, 1)}°` : `${fixed(1000 * value, 1)} mm`;
  }

  private joints(): HTMLElement {
    const rows = this.hand.coordinates.map((c, k) => [
      name(c.name),
      this.now[k],
      this.length(k, c.minimum),
      this.length(k, c.maximum),
      this.length(k, c.rest),
      figure(c.stiffness),
      figure(c.damping),
      this.torques[k]?.spring,
      this.torques[k]?.load,
      this.torques[k]?.tendon,
    ]);
    return el(
      'div',
      {},
      table(
        'Joints',
        [
          { head: 'Joint', text: true },
          { head: 'now' },
          { head: 'minimum' },
          { head: 'maximum' },
          { head: 'rest q₀' },
          { head: 'stiffness E', hint: 'N·m/rad' },
          { head: 'damping D', hint: 'N·m·s/rad' },
          { head: 'springs', hint: 'E (q₀ − q)' },
          { head: 'loads', hint: 'forces, held points, weight' },
          { head: 'tendons, stops', hint: 'balances the other two' },
        ],
        rows,
      ),
      el(
        'p',
        { class: 'hint' },
        'Torques at the pose shown in N·m (of sliding joints N): springs E (q₀ − q); loads are forces, held points and weight; tendons and stops balance both. E in N·m/rad, D in N·m·s/rad.',
      ),
    );
  }

  private matrix(): HTMLElement {
    const { coordinates, tendons } = this.hand;
    const varies = (tendon: number, coordinate: string): boolean =>
      tendons[tendon]?.elements?.some((element) => element.coordinate === coordinate) === true;
    const rows = coordinates.map((c, k) => [
      name(c.name),
      figure(c.stiffness),
      ...tendons.map((tendon, t) => {
        const arm = tendon.moment_arms[k] ?? 0;
        return `${arm === 0 ? '·' : figure(arm)}${varies(t, c.name) ? ' *' : ''}`;
      }),
    ]);
    const any = tendons.some((tendon) => (tendon.elements?.length ?? 0) > 0);
    return el(
      'div',
      {},
      table(
        'R and E',
        [{ head: 'Joint', text: true }, { head: 'E' }, ...tendons.map((tendon) => ({ head: el('span', {}, 'R ', name(tendon.name)) }))],
        rows,
      ),
      el(
        'p',
        { class: 'hint' },
        'Each column is a tendon’s row of R, its moment arms at rest: the tendon winds s = R q and pulls with torques Rᵀ f. If the hand’s file gives radii in m, R is in m and f in N; if it gives numbers without a unit, f is in N·m.',
        any ? ' * The moment arm varies with the joint.' : '',
      ),
    );
  }

  private tendons(): HTMLElement {
    const rows = this.hand.tendons.map((tendon, k) => [
      name(tendon.name),
      name(tendon.motor),
      this.tension[k],
      figure(tendon.force_limit),
      this.wound[k],
      figure(tendon.stiffness),
      figure(tendon.damping),
      tendon.both_ways ? 'pulls and pushes' : 'pulls',
    ]);
    return el(
      'div',
      {},
      table(
        'Tendons',
        [
          { head: 'Tendon', text: true },
          { head: 'Motor', text: true },
          { head: 'tension f' },
          { head: 'limit' },
          { head: 'wound to s' },
          { head: 'stiffness K' },
          { head: 'damping b' },
          { head: '', text: true },
        ],
        rows,
      ),
      el(
        'p',
        { class: 'hint' },
        'In the hand’s own units, like R. A motor at σ winds to s = scaling · (σ − offset): ',
        this.hand.motors.map((motor) => `${motor.name} ${figure(motor.scaling)} · (σ − ${figure(motor.offset)})`).join(', '),
        '.',
      ),
    );
  }

  private links(): HTMLElement {
    const rows = this.hand.links.map((link) => [
      name(link.name),
      link.parent === null ? '–' : name(link.parent),
      link.coordinate === null ? '–' : name(link.coordinate),
      figure(1000 * link.mass),
      link.com.map((x) => fixed(1000 * x, 1)).join(', '),
      [...new Set(link.shapes.map((shape) => shape.shape.type))].join(', ') || '–',
      [...new Set(link.shapes.map((shape) => figure(shape.friction)))].join(', ') || '–',
    ]);
    return table(
      'Links',
      [
        { head: 'Link', text: true },
        { head: 'on', text: true },
        { head: 'joint', text: true },
        { head: 'mass, g' },
        { head: 'centre of mass, mm' },
        { head: 'shapes', text: true },
        { head: 'friction μ' },
      ],
      rows,
    );
  }
}
