/** Dialogs that ask before an action: with a reason, further fields, and a name to type if the action cannot be undone. */
import { ApiError } from '../net/api';
import { button, type Child, copyText, el, name, toast } from '../ui/elements';
import { errorText } from './admin_client';

/** A field besides the reason. */
export interface Field {
  name: string;
  label: string;
  hint?: string;
  type?: 'text' | 'number' | 'select' | 'textarea' | 'datetime-local';
  /** Whether the field may be empty. */
  optional?: boolean;
  value?: string;
  options?: readonly string[];
  min?: number;
  max?: number;
  maxlength?: number;
}

/** A dialog and its action. */
export interface ActionDialog {
  title: string | Child[];
  /** Describes the effect. */
  text: Child;
  /** Label of the button that does it. */
  verb: string;
  danger?: boolean;
  /** Whether the server requires a reason. */
  needsReason?: boolean;
  fields?: readonly Field[];
  /** Text that must be typed first. */
  typed?: string;
  /** The action. If it throws, the dialog shows the error and stays open. */
  act: (reason: string | null, values: Readonly<Record<string, string>>) => Promise<string | undefined>;
}

let counted = 0;

/** Opens the dialog; resolves to true after the action. */
export function confirmAction(options: ActionDialog): Promise<boolean> {
  counted += 1;
  const id = `ask-${counted}`;
  const error = el('p', { class: 'error', role: 'alert', hidden: true });
  const fields = (options.fields ?? []).map((field) => ({ field, input: control(field, `${id}-${field.name}`) }));
  const reason = el('input', { id: `${id}-reason`, required: options.needsReason === true, maxlength: 500, autocomplete: 'off' });
  const typed =
    options.typed === undefined ? null : el('input', { id: `${id}-typed`, required: true, autocomplete: 'off', spellcheck: 'false' });
  const go = el('button', { type: 'submit', class: options.danger === true ? 'danger' : 'primary' }, options.verb);
  const form = el(
    'form',
    { method: 'dialog', novalidate: true },
    el('h2', { id: `${id}-title` }, ...[options.title].flat()),
    el('p', {}, options.text),
    ...fields.map(({ field, input }) => labelled(field.label, input, field.hint)),
    labelled('Reason', reason, options.needsReason === true ? 'Required; recorded in the audit.' : 'Recorded in the audit.'),
    typed === null ? null : labelled(['To confirm, type: ', name(options.typed ?? '')], typed),
    error,
    el(
      'div',
      { class: 'actions' },
      button('Cancel', () => dialog.close()),
      go,
    ),
  );
  const dialog = el('dialog', { 'aria-labelledby': `${id}-title` }, form);
  document.body.append(dialog);
  const opener = document.activeElement;
  const row = opener?.closest('tr') ?? null;

  return new Promise((resolve) => {
    let done = false;
    dialog.addEventListener('close', () => {
      dialog.remove();
      // The browser returns the focus to the button, unless the action has replaced it.
      if (opener?.isConnected !== true)
        (row?.querySelector<HTMLElement>('button, a') ?? document.querySelector<HTMLElement>('[role=tab][aria-selected=true]'))?.focus();
      resolve(done);
    });
    form.addEventListener('submit', (event) => {
      event.preventDefault();
      // Shown in the page: the browser's bubbles would hide the buttons.
      for (const { field, input } of fields) {
        if (input.validity.valid) continue;
        show(error, `${field.label}: ${input.validationMessage}`);
        input.focus();
        return;
      }
      if (typed !== null && typed.value !== options.typed) {
        show(error, 'The text does not match.');
        typed.focus();
        return;
      }
      const text = reason.value.trim();
      if (options.needsReason === true && text === '') {
        show(error, 'Enter a reason: the server records it in the audit.');
        reason.focus();
        return;
      }
      error.hidden = true;
      go.disabled = true;
      const values = Object.fromEntries(fields.map(({ field, input }) => [field.name, input.value]));
      options.act(text === '' ? null : text, values).then(
        (message) => {
          done = true;
          dialog.close();
          if (message !== undefined) toast(message);
        },
        (failure: unknown) => {
          go.disabled = false;
          if (failure instanceof ApiError && failure.status === 401) dialog.close();
          else show(error, errorText(failure));
        },
      );
    });
    dialog.showModal();
    (fields[0]?.input ?? reason).focus();
  });
}

function show(error: HTMLElement, text: string): void {
  error.textContent = text;
  error.hidden = false;
}

function labelled(label: string | Child[], input: HTMLElement, hint?: string): HTMLElement {
  const below = hint === undefined ? null : el('p', { class: 'hint', id: `${input.id}-hint` }, hint);
  if (below !== null) input.setAttribute('aria-describedby', below.id);
  return el('div', { class: 'field' }, el('label', { for: input.id }, ...[label].flat()), input, below);
}

function control(field: Field, id: string): HTMLInputElement | HTMLSelectElement | HTMLTextAreaElement {
  if (field.type === 'select') {
    return el('select', { id }, ...(field.options ?? []).map((option) => el('option', { value: option }, option)));
  }
  if (field.type === 'textarea') {
    return el('textarea', { id, required: true, maxlength: field.maxlength }, field.value ?? '');
  }
  return el('input', {
    id,
    type: field.type ?? 'text',
    required: field.optional !== true,
    value: field.value,
    min: field.min,
    max: field.max,
    maxlength: field.maxlength,
    autocomplete: 'off',
    spellcheck: 'false',
    step: field.type === 'number' || field.type === 'datetime-local' ? 'any' : undefined,
  });
}

/** Shows a new token once, with a button to copy it. */
export function showToken(whose: Child, token: string): Promise<void> {
  const field = el('input', { id: 'new-token', readonly: true, value: token, class: 'mono', 'aria-describedby': 'new-token-hint' });
  const close = button('I have copied it', () => dialog.close());
  const dialog = el(
    'dialog',
    { 'aria-labelledby': 'new-token-title' },
    el('h2', { id: 'new-token-title' }, 'New token of ', whose),
    el(
      'div',
      { class: 'field' },
      el('label', { for: 'new-token' }, 'Token'),
      field,
      el('p', { class: 'hint', id: 'new-token-hint' }, 'It is shown only once: the server keeps only its hash. Give it only to its owner.'),
    ),
    el(
      'div',
      { class: 'actions' },
      button(
        'Copy',
        () => {
          field.select();
          void copyText(token);
        },
        { class: 'primary' },
      ),
      close,
    ),
  );
  document.body.append(dialog);
  dialog.showModal();
  field.select();
  return new Promise((resolve) =>
    dialog.addEventListener('close', () => {
      field.value = '';
      dialog.remove();
      resolve();
    }),
  );
}
