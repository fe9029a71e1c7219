/** Forces and held points as a list of numbers, so that everything the pointer does is also possible by keyboard. */
import { button, el, name, setText } from '../ui/elements';
import { type Load, MAX_FORCE, reactionOf } from './equilibrium';
import { formatNewtons } from './load_marks';
import { fixed } from './tables';
import type { EquilibriumResponse, HandDescription } from '../wire/messages';

const AXES = ['x', 'y', 'z'] as const;
type Vector = 'point' | 'force' | 'place';
/** Title, unit, and factor from SI to that unit. */
const VECTORS: Record<Vector, { title: string; unit: string; by: number; digits: number }> = {
  point: { title: 'Point, in the link’s frame', unit: 'mm', by: 1000, digits: 1 },
  force: { title: 'Force, in the world', unit: 'N', by: 1, digits: 3 },
  place: { title: 'Held at, in the world', unit: 'mm', by: 1000, digits: 1 },
};

interface Row {
  load: Load;
  element: HTMLElement;
  title: HTMLElement;
  says: HTMLElement;
  inputs: Map<Vector, HTMLInputElement[]>;
}

export interface LoadActions {
  add(kind: Load['kind'], link: string): void;
  remove(id: number): void;
  choose(id: number): void;
  /** A number was typed, for axis 0 to 2. */
  set(id: number, what: Vector, axis: number, value: number): void;
}

export class LoadList {
  readonly element: HTMLElement;
  private readonly links = el('select', { id: 'load-link' });
  private readonly list = el('div', { class: 'loads' });
  private rows: Row[] = [];

  constructor(
    hand: HandDescription,
    private readonly wanted: LoadActions,
    scale: HTMLElement,
  ) {
    // Initially a fingertip: the base does not move.
    const last = hand.links.at(-1)?.name;
    this.links.append(...hand.links.map((link) => el('option', { value: link.name, selected: link.name === last }, link.name)));
    const add = (kind: Load['kind'], text: string): HTMLElement =>
      button(
        text,
        () => {
          this.wanted.add(kind, this.links.value);
          this.list.lastElementChild?.querySelector<HTMLElement>('.vector:last-of-type input')?.focus();
        },
        { class: 'small' },
      );
    this.element = el(
      'section',
      { class: 'panel' },
      el('h2', {}, 'Forces and held points'),
      el(
        'p',
        { class: 'hint' },
        'Choose Push or Hold below the image, press on a link and drag. You can drag a handle again. Or enter numbers:',
      ),
      el('div', { class: 'field' }, el('label', { for: 'load-link' }, 'Link'), this.links),
      el('div', { class: 'row' }, add('force', 'Push it'), add('hold', 'Hold it')),
      scale,
      this.list,
    );
  }

  choose(link: string): void {
    this.links.value = link;
  }

  /** Updates the list, except a number that is being typed. */
  show(loads: readonly Load[], rest: EquilibriumResponse | null, chosen: number | null): void {
    if (loads.length !== this.rows.length || loads.some((load, k) => load !== this.rows[k]?.load)) {
      const known = new Map(this.rows.map((row) => [row.load, row]));
      this.rows = loads.map((load) => known.get(load) ?? this.row(load));
      // Rows that stay are not moved: they would lose the focus.
      for (const [load, row] of known) if (!loads.includes(load)) row.element.remove();
      for (const row of this.rows) if (!row.element.isConnected) this.list.append(row.element);
    }
    this.rows.forEach((row, k) => this.write(row, k + 1, reactionOf(row.load, loads, rest), chosen));
  }

  private write(
    { load, element, title, says, inputs }: Row,
    number: number,
    reaction: EquilibriumResponse['reactions'][number] | null,
    chosen: number | null,
  ): void {
    element.classList.toggle('chosen', load.id === chosen);
    setText(title, `${number}: ${load.kind === 'force' ? 'push' : 'hold'} `);
    for (const [what, fields] of inputs) {
      const { by, digits } = VECTORS[what];
      fields.forEach((field, axis) => {
        const value = String(Number(((load[what][axis] ?? 0) * by).toFixed(digits)) + 0);
        if (field !== document.activeElement && field.value !== value) field.value = value;
      });
    }
    if (load.kind === 'force') setText(says, `${formatNewtons(Math.hypot(...load.force))} N`);
    else if (!reaction) setText(says, 'computing …');
    else {
      const force = reaction.force.map((x) => fixed(x, 2)).join(', ');
      const off = reaction.gap > 1e-3 ? ` It cannot reach its target: ${(1000 * reaction.gap).toFixed(1)} mm are missing.` : '';
      setText(says, `Held by ${formatNewtons(Math.hypot(...reaction.force))} N (${force}).${off}`);
      says.classList.toggle('warn', off !== '');
    }
  }

  private row(load: Load): Row {
    const inputs = new Map<Vector, HTMLInputElement[]>();
    const vector = (what: Vector): HTMLElement => {
      const { title, unit, by } = VECTORS[what];
      const fields = AXES.map((axis) =>
        el('input', {
          type: 'number',
          step: 'any',
          required: true,
          'aria-label': `${axis}, ${unit}`,
          ...(what === 'force' ? { min: -MAX_FORCE, max: MAX_FORCE } : {}),
        }),
      );
      inputs.set(what, fields);
      // The other two keep all their digits, not only the shown ones: an error of 0.01 mm adds 1 N at a held point.
      fields.forEach((field, axis) => {
        field.addEventListener('input', () => {
          if (Number.isFinite(field.valueAsNumber)) this.wanted.set(load.id, what, axis, field.valueAsNumber / by);
        });
        field.addEventListener('focus', () => this.wanted.choose(load.id));
      });
      return el('fieldset', { class: 'vector' }, el('legend', {}, `${title}, ${unit}`), ...fields);
    };
    const title = el('span', {});
    const says = el('p', { class: 'num' });
    const remove = button(
      'Remove',
      () => {
        this.wanted.remove(load.id);
        this.links.focus();
      },
      { class: 'small end', 'aria-label': `Remove this ${load.kind === 'force' ? 'push' : 'hold'} of ${load.link}` },
    );
    const element = el(
      'div',
      { class: 'load' },
      el('h3', { class: 'row' }, el('span', {}, title, name(load.link)), remove),
      says,
      load.kind === 'force' ? vector('force') : vector('place'),
      el('details', {}, el('summary', {}, 'Where on the link'), vector('point')),
    );
    return { load, element, title, says, inputs };
  }
}
