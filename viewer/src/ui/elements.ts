/** Helpers for building pages: elements whose text is never markup, and short messages. */
import { printable } from './format';

/** Attributes and event listeners (`on`) of an element; false omits an attribute. */
export interface Attributes {
  class?: string | undefined;
  on?: Record<string, (event: Event) => void>;
  [attribute: string]: string | number | boolean | undefined | Record<string, (event: Event) => void>;
}

/** Child of an element; null, undefined and false are omitted. */
export type Child = Node | string | number | null | undefined | false;

/** Creates an element. Strings become text, never markup. */
export function el<K extends keyof HTMLElementTagNameMap>(tag: K, given: Attributes = {}, ...children: Child[]): HTMLElementTagNameMap[K] {
  const made = document.createElement(tag);
  for (const [name, value] of Object.entries(given)) {
    if (value === undefined || value === false) continue;
    if (typeof value === 'object') {
      for (const [event, listener] of Object.entries(value)) made.addEventListener(event, listener);
    } else {
      made.setAttribute(name, value === true ? '' : String(value));
    }
  }
  fill(made, ...children);
  return made;
}

/** Appends the children that are not null, undefined or false. */
export function fill(parent: Element, ...children: Child[]): void {
  for (const child of children) {
    if (child === null || child === undefined || child === false) continue;
    parent.append(typeof child === 'number' ? String(child) : child);
  }
}

/** A name in its own text direction, with invisible characters written as codes. */
export function name(text: string): HTMLElement {
  return el('bdi', {}, printable(text));
}

/** A name that breaks after its underscores and hyphens rather than inside a word. */
export function nameInWords(text: string): HTMLElement {
  const parts = printable(text).split(/(?<=[_.-])/u);
  return el('bdi', { class: 'in-words' }, ...parts.flatMap((word, k): Child[] => (k === 0 ? [word] : [el('wbr'), word])));
}

/** A button with its click handler. */
export function button(text: Child, act: () => void, given: Attributes = {}): HTMLButtonElement {
  return el('button', { type: 'button', ...given, on: { click: act } }, text);
}

/** Sets text only when it changes, so that a screen reader does not repeat it. */
export function setText(element: Element, text: string): void {
  if (element.textContent !== text) element.textContent = text;
}

/** A list of terms and values in two columns. */
export function facts(rows: readonly (readonly [string, Child])[]): HTMLElement {
  const list = el('dl', { class: 'facts' });
  for (const [term, value] of rows) fill(list, el('dt', {}, term), el('dd', {}, value));
  return list;
}

let toasts: HTMLElement | null = null;

/** Shows a message for 6 s; an error for 12 s. */
export function toast(text: string, bad = false): void {
  if (toasts === null || !toasts.isConnected) {
    toasts = el('div', { class: 'toasts', role: 'status', 'aria-live': 'polite' });
    document.body.append(toasts);
  }
  const message = el('div', { class: bad ? 'toast bad' : 'toast' }, text);
  toasts.append(message);
  window.setTimeout(() => message.remove(), bad ? 12_000 : 6_000);
}

/** Copies text to the clipboard; false, with a message, where the browser forbids it. */
export async function copyText(text: string): Promise<boolean> {
  try {
    await navigator.clipboard.writeText(text);
    toast('Copied.');
    return true;
  } catch {
    toast('The browser blocks copying here: select the text and copy it by hand.', true);
    return false;
  }
}

/** The page's main element; created where the server's HTML has none. */
export function mainElement(): HTMLElement {
  const found = document.getElementById('app');
  if (found !== null) return found;
  const made = el('main', { id: 'app' });
  document.body.append(made);
  return made;
}

/** The element with this id; created in `parent` if it is missing. */
export function part(parent: HTMLElement, tag: 'div' | 'section' | 'aside', id: string): HTMLElement {
  const found = document.getElementById(id);
  if (found !== null) return found;
  const made = el(tag, { id });
  parent.append(made);
  return made;
}
