/** A table whose rows keep their place and focus while their content changes. */
import { type Child, el } from '../ui/elements';

/** A column; `n` for numbers. */
export interface Column {
  head: string;
  class?: string;
}

/** Content of a cell. */
export type Cell = Child | Child[];

/** A table of items, each identified by its key. */
export class KeyedTable<T> {
  readonly element: HTMLElement;
  private readonly body = el('tbody');
  private readonly empty: HTMLElement;
  private readonly table: HTMLTableElement;
  private readonly lines = new Map<string, { line: HTMLTableRowElement; signature: string }>();

  /** `head`: index of the column that names a row. */
  constructor(
    private readonly columns: readonly Column[],
    private readonly key: (item: T) => string,
    private readonly cells: (item: T) => Cell[],
    options: { label: string; empty: string; head?: number; signature?: (item: T) => string },
  ) {
    this.head = options.head ?? 0;
    this.signature = options.signature ?? ((item) => JSON.stringify(item));
    const heads = columns.map((column) =>
      el(
        'th',
        { scope: 'col', class: column.class },
        column.head === '' ? el('span', { class: 'visually-hidden' }, 'Actions') : column.head,
      ),
    );
    this.table = el(
      'table',
      { class: 'cards dense admin' },
      el('caption', { class: 'visually-hidden' }, options.label),
      el('thead', {}, el('tr', {}, ...heads)),
      this.body,
    );
    this.empty = el('p', { class: 'soft', hidden: true }, options.empty);
    this.element = el('div', {}, el('div', { class: 'scroll' }, this.table), this.empty);
  }

  private readonly head: number;
  private readonly signature: (item: T) => string;

  /** Shows these items, in this order. */
  show(items: readonly T[]): void {
    const gone = new Set(this.lines.keys());
    let after: Element | null = null;
    for (const item of items) {
      const key = this.key(item);
      gone.delete(key);
      const signature = this.signature(item);
      let kept = this.lines.get(key);
      if (kept === undefined) {
        kept = { line: el('tr', { 'data-key': key }), signature: '' };
        this.lines.set(key, kept);
      }
      if (kept.signature !== signature) {
        this.write(kept.line, item);
        kept.signature = signature;
      }
      // Only rows in the wrong place are moved: moving takes the focus away.
      const next: Element | null = after === null ? this.body.firstElementChild : after.nextElementSibling;
      if (next !== kept.line) this.body.insertBefore(kept.line, next);
      after = kept.line;
    }
    for (const key of gone) {
      this.lines.get(key)?.line.remove();
      this.lines.delete(key);
    }
    this.table.hidden = items.length === 0;
    this.empty.hidden = items.length > 0;
  }

  /** The row of an item. */
  row(key: string): HTMLTableRowElement | undefined {
    return this.lines.get(key)?.line;
  }

  private write(line: HTMLTableRowElement, item: T): void {
    const focused = line.contains(document.activeElement) ? document.activeElement?.textContent : null;
    line.replaceChildren(
      ...this.cells(item).map((cell, index) => {
        const column = this.columns[index] ?? { head: '' };
        const content = Array.isArray(cell) ? cell : [cell];
        if (index === this.head) return el('th', { scope: 'row' }, ...content);
        const label = column.head === '' ? undefined : column.head;
        return el('td', { class: column.class, 'data-label': label }, ...content);
      }),
    );
    if (focused !== null) {
      const again =
        [...line.querySelectorAll<HTMLElement>('button, a')].find((one) => one.textContent === focused) ??
        line.querySelector<HTMLElement>('button, a');
      again?.focus();
    }
  }
}
