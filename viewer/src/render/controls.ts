/** Overlay switches and view buttons; the same on every page with a 3D view. */
import { button, el } from '../ui/elements';
import { keepPlain, wantsPlain } from './detail';
import type { OverlayName, Stage, ViewName } from './stage';

const OVERLAYS: [OverlayName, string][] = [
  ['contacts', 'Contact forces'],
  ['ghost', 'Predicted equilibrium'],
  ['regions', 'Regions of the rules'],
  ['names', 'Names'],
  ['frames', 'Frames'],
  ['com', 'Centres of mass'],
];
const VIEWS: [ViewName, string][] = [
  ['free', 'Whole'],
  ['front', 'Front'],
  ['side', 'Side'],
  ['top', 'Top'],
  ['palm', 'Palm'],
  ['follow', 'Follow'],
];

/** Overlays that need telemetry. */
const NEEDS_TELEMETRY = new Set<OverlayName>(['contacts', 'ghost', 'com']);

/** Shows the switches that need telemetry only if there is telemetry. */
export function showOverlaySwitches(panel: HTMLElement, telemetry: boolean): void {
  for (const row of panel.querySelectorAll<HTMLElement>('[data-overlay]')) {
    if (NEEDS_TELEMETRY.has(row.dataset['overlay'] as OverlayName)) row.hidden = !telemetry;
  }
  for (const hint of panel.querySelectorAll<HTMLElement>('.hint')) hint.hidden = !telemetry;
}

/** A panel with a check box for each overlay; `on` are those initially shown. */
export function overlaySwitches(stages: () => Stage[], on: readonly OverlayName[] = ['regions']): HTMLElement {
  const boxes = OVERLAYS.map(([name, label]) => {
    const box = el('input', { type: 'checkbox', id: `overlay-${name}`, checked: on.includes(name) });
    box.addEventListener('change', () => {
      for (const stage of stages()) stage.setOverlay(name, box.checked);
    });
    return el(
      'div',
      { class: 'check', 'data-overlay': name, hidden: NEEDS_TELEMETRY.has(name) },
      box,
      el('label', { for: `overlay-${name}` }, label),
    );
  });
  return el(
    'details',
    { class: 'panel', open: true },
    el('summary', {}, 'Show'),
    ...boxes,
    plainSwitch(stages),
    el(
      'p',
      { class: 'hint', hidden: true },
      'The length of an arrow is its force. Blue: the contact sticks; yellow: half way to slipping; red: it slips.',
    ),
  );
}

/** The switch for slow machines; every page of this browser keeps it. Without it the frame rate decides. */
function plainSwitch(stages: () => Stage[]): HTMLElement {
  const box = el('input', { type: 'checkbox', id: 'plain', checked: wantsPlain() });
  box.addEventListener('change', () => {
    keepPlain(box.checked);
    for (const stage of stages()) stage.setPlain(box.checked);
  });
  return el('div', { class: 'check' }, box, el('label', { for: 'plain' }, 'Plain picture, for slow machines'));
}

/** Buttons for the camera views. */
export function viewButtons(stages: () => Stage[]): HTMLElement {
  const group = el('div', { class: 'group', role: 'group', 'aria-label': 'View' });
  for (const [name, label] of VIEWS) {
    const made = button(
      label,
      () => {
        for (const stage of stages()) stage.view(name);
        for (const other of group.children) other.setAttribute('aria-pressed', String(other === made));
      },
      { 'aria-pressed': String(name === 'free'), class: 'small' },
    );
    group.append(made);
  }
  return group;
}
