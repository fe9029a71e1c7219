/** Switches of a picture: overlays and views. Every page with a stage has the same. */
import { button, el } from '../ui/elements';
import type { OverlayName, Stage, ViewName } from './stage';

const OVERLAYS: [OverlayName, string][] = [
  ['contacts', 'Contact forces'], ['ghost', 'Predicted equilibrium'], ['regions', 'Regions of the rules'],
  ['names', 'Names'], ['frames', 'Frames'], ['com', 'Centres of mass'],
];
const VIEWS: [ViewName, string][] = [['free', 'Whole'], ['front', 'Front'], ['side', 'Side'], ['top', 'Top'], ['palm', 'Palm'], ['follow', 'Follow']];

/** Overlays of what only some servers and files tell. */
const NEEDS_TELEMETRY = new Set<OverlayName>(['contacts', 'ghost', 'com']);

/** Offers the overlays for which there is something to show. */
export function showOverlaySwitches(panel: HTMLElement, telemetry: boolean): void {
  for (const row of panel.querySelectorAll<HTMLElement>('[data-overlay]')) {
    if (NEEDS_TELEMETRY.has(row.dataset['overlay'] as OverlayName)) row.hidden = !telemetry;
  }
  for (const hint of panel.querySelectorAll<HTMLElement>('.hint')) hint.hidden = !telemetry;
}

/** A panel of check boxes, one for each overlay; `on` are those that the stages show at the beginning. */
export function overlaySwitches(stages: () => Stage[], on: readonly OverlayName[] = ['regions']): HTMLElement {
  const boxes = OVERLAYS.map(([name, label]) => {
    const box = el('input', { type: 'checkbox', id: `overlay-${name}`, checked: on.includes(name) });
    box.addEventListener('change', () => { for (const stage of stages()) stage.setOverlay(name, box.checked); });
    return el('div', { class: 'check', 'data-overlay': name, hidden: NEEDS_TELEMETRY.has(name) }, box, el('label', { for: `overlay-${name}` }, label));
  });
  return el('details', { class: 'panel', open: true }, el('summary', {}, 'Show'), ...boxes,
    el('p', { class: 'hint', hidden: true }, 'Arrows are as long as the force. Blue holds, yellow is half way to slipping, vermilion slips.'));
}

/** Buttons for the cameras. */
export function viewButtons(stages: () => Stage[]): HTMLElement {
  const group = el('div', { class: 'group', role: 'group', 'aria-label': 'View' });
  for (const [name, label] of VIEWS) {
    const made = button(label, () => {
      for (const stage of stages()) stage.view(name);
      for (const other of group.children) other.setAttribute('aria-pressed', String(other === made));
    }, { 'aria-pressed': String(name === 'free'), class: 'small' });
    group.append(made);
  }
  return group;
}
