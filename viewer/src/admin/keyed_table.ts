/** A table whose rows keep their place, and their focus, while what they show changes. */
import { type Child, el } from '../ui/elements';

/** A column; `n` for numbers. */
export interface Column { head: string; class?: string }

/** A cell with what stands in it. */
export type Cell = Child | Child[];

/** Keeps a table of things. */
export class KeyedTable<T> {
  readonly element: HTMLElement;
  private readonly body = el('tbody');
  private readonly empty: HTMLElement;
  private readonly table: HTMLTableElement;
  private readonly lines = new Map<string, { line: HTMLTableRowElement; signature: string }>();

  /** `head`: index of the column that names a row. */
  constructor(
    private readonly columns: readonly Column[],
    private readonly key: (thing: T) => string,
    private readonly cells: (thing: T) => Cell[],
    options: { label: string; empty: string; head?: number; signature?: (thing: T) => string },
  ) {
    this.head = options.head ?? 0;
    this.signature = options.signature ?? ((thing) => JSON.stringify(thing));
    const heads = columns.map((column) => el('th', { scope: 'col', class: column.class },
      column.head === '' ? el('span', { class: 'visually-hidden' }, 'Actions') : column.head));
    this.table = el('table', { class: 'cards dense admin' }, el('caption', { class: 'visually-hidden' }, options.label), el('thead', {}, el('tr', {}, ...heads)), this.body);
    this.empty = el('p', { class: 'soft', hidden: true }, options.empty);
    this.element = el('div', {}, el('div', { class: 'scroll' }, this.table), this.empty);
  }

  private readonly head: number;
  private readonly signature: (thing: T) => string;

  /** Shows these, in this order. */
  show(things: readonly T[]): void {
    const gone = new Set(this.lines.keys());
    let after: Element | null = null;
    for (const thing of things) {
      const key = this.key(thing);
      gone.delete(key);
      const signature = this.signature(thing);
      let kept = this.lines.get(key);
      if (kept === undefined) {
        kept = { line: el('tr', { 'data-key': key }), signature: '' };
        this.lines.set(key, kept);
      }
      if (kept.signature !== signature) {
        this.write(kept.line, thing);
        kept.signature = signature;
      }
      // Only what stands elsewhere is moved: moving takes the focus away.
      const next: Element | null = after === null ? this.body.firstElementChild : after.nextElementSibling;
      if (next !== kept.line) this.body.insertBefore(kept.line, next);
      after = kept.line;
    }
    for (const key of gone) {
      this.lines.get(key)?.line.remove();
      this.lines.delete(key);
    }
    this.table.hidden = things.length === 0;
    this.empty.hidden = things.length > 0;
  }

  /** The row of a thing. */
  row(key: string): HTMLTableRowElement | undefined {
    return this.lines.get(key)?.line;
  }

  private write(line: HTMLTableRowElement, thing: T): void {
    const focused = line.contains(document.activeElement) ? document.activeElement?.textContent : null;
    line.replaceChildren(...this.cells(thing).map((cell, index) => {
      const column = this.columns[index] ?? { head: '' };
      const content = Array.isArray(cell) ? cell : [cell];
      if (index === this.head) return el('th', { scope: 'row' }, ...content);
      const label = column.head === '' ? undefined : column.head;
      return el('td', { class: column.class, 'data-label': label }, ...content);
    }));
    if (focused !== null) {
      const again = [...line.querySelectorAll<HTMLElement>('button, a')].find((one) => one.textContent === focused) ?? line.querySelector<HTMLElement>('button, a');
      again?.focus();
    }
  }
}
