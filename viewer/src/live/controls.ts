/** Switches of a picture: overlays and views. Every page with a stage has the same. */
import { button, el } from '../board/kit';
import type { OverlayName, Stage, ViewName } from '../scene/stage';

const OVERLAYS: [OverlayName, string][] = [
  ['contacts', 'Contact forces'], ['ghost', 'Predicted equilibrium'], ['regions', 'Regions of the rules'],
  ['names', 'Names'], ['frames', 'Frames'], ['com', 'Centres of mass'],
];
const VIEWS: [ViewName, string][] = [['free', 'Whole'], ['front', 'Front'], ['side', 'Side'], ['top', 'Top'], ['palm', 'Palm'], ['follow', 'Follow']];

/** A panel of check boxes, one for each overlay; `on` are switched on at the beginning. */
export function overlaySwitches(stages: () => Stage[], on: readonly OverlayName[] = ['regions']): HTMLElement {
  const boxes = OVERLAYS.map(([name, label]) => {
    const box = el('input', { type: 'checkbox', id: `overlay-${name}`, checked: on.includes(name) });
    box.addEventListener('change', () => { for (const stage of stages()) stage.setOverlay(name, box.checked); });
    return el('div', { class: 'check' }, box, el('label', { for: `overlay-${name}` }, label));
  });
  for (const stage of stages()) for (const name of on) stage.setOverlay(name, true);
  return el('details', { class: 'panel', open: true }, el('summary', {}, 'Show'), ...boxes,
    el('p', { class: 'hint' }, 'Arrows are as long as the force. Blue holds, yellow is half way to slipping, vermilion slips.'));
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
