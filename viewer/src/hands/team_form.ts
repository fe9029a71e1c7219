/** Form for a team's token, on a practice server for its name. */
import { el } from '../ui/elements';
import type { Access } from './access';

/** The form; `used` gets the input. The token is kept only in memory. */
export function teamForm(official: boolean, now: Access, used: (access: Access) => void): HTMLElement {
  const token = el('input', { type: 'password', id: 'token', autocomplete: 'off', spellcheck: 'false' });
  const team = el('input', { id: 'team', autocomplete: 'off', spellcheck: 'false', maxlength: 64, value: now.team ?? undefined });
  if (now.token !== null) token.value = now.token;
  const says = el('span', { class: 'soft', role: 'status' });
  const submit = (event: Event): void => {
    event.preventDefault();
    used({ token: token.value.trim() || null, team: official ? null : team.value.trim() || null });
    says.textContent = official ? 'Using this token.' : 'Using this name.';
  };
  return el(
    'form',
    { on: { submit } },
    official
      ? el(
          'div',
          { class: 'field' },
          el('label', { for: 'token' }, 'Token of your team'),
          token,
          el('p', { class: 'hint' }, 'This page keeps it only in memory.'),
        )
      : el(
          'div',
          { class: 'field' },
          el('label', { for: 'team' }, 'Name of your team'),
          team,
          el('p', { class: 'hint' }, 'A practice server needs no token.'),
        ),
    el('div', { class: 'row' }, el('button', { type: 'submit' }, official ? 'Use this token' : 'Use this name'), says),
  );
}
