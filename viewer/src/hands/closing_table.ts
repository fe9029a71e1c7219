/** Predicted closing without contact: tensions, method and reasons at four values of σ, as `hand check` prints them. */
import { figure } from '../ui/format';
import { el, name } from '../ui/elements';
import type { Access } from './access';
import { requestEquilibrium } from './access';
import { equilibriumRequest } from './equilibrium';
import type { HandDescription } from '../wire/messages';

/** Values of σ, the same for all motors. */
const SIGMA = [0.25, 0.5, 0.75, 1];

export function closingTable(hand: HandDescription, access: Access): HTMLElement {
  const body = el('tbody');
  const says = el('p', { class: 'hint', role: 'status' }, 'Computing …');
  void (async () => {
    for (const sigma of SIGMA) {
      const cells = [el('th', { scope: 'row' }, sigma.toFixed(2))];
      try {
        const rest = await requestEquilibrium(
          hand.name,
          equilibriumRequest(
            hand.motors.map(() => sigma),
            { position: [0, 0, 0], quat: [0, 0, 0, 1] },
            [],
          ),
          access,
        );
        cells.push(
          ...rest.tension.map((f) => el('td', { class: 'n' }, figure(f))),
          el('td', { class: 'one-line' }, rest.law === 'closed_form' ? 'closed form' : 'Newton'),
          el('td', {}, rest.beyond_closed_form.join('; ') || '–'),
        );
      } catch (error) {
        cells.push(el('td', { colspan: hand.tendons.length + 2, class: 'bad' }, error instanceof Error ? error.message : String(error)));
      }
      body.append(el('tr', {}, ...cells));
    }
    says.textContent =
      'All motors at the same σ, without contact, predicted by the model. “palmares hand check” also simulates this and compares.';
  })();
  return el(
    'div',
    {},
    el(
      'div',
      { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Closing' },
      el(
        'table',
        { class: 'dense' },
        el(
          'thead',
          {},
          el(
            'tr',
            {},
            el('th', { scope: 'col' }, 'σ'),
            ...hand.tendons.map((tendon) => el('th', { scope: 'col', class: 'n' }, 'f ', name(tendon.name))),
            el('th', { scope: 'col' }, 'method'),
            el('th', { scope: 'col' }, 'why not the closed form'),
          ),
        ),
        body,
      ),
    ),
    says,
  );
}
