/** `/admin`: what organizers do. The token is kept in memory alone: a reload asks for it again. */
import '../style/base.css';
import '../style/admin.css';
import { auditTab } from '../admin/audit';
import { announceTab, competitionTab } from '../admin/competition';
import { AdminClient, errorText } from '../admin/admin_client';
import { handsTab } from '../admin/hands';
import { runsTab } from '../admin/runs';
import { sessionsTab } from '../admin/sessions';
import { showTabs } from '../admin/tabs';
import { teamsTab } from '../admin/teams';
import { getJson, ApiError } from '../net/api';
import { button, el, mainElement, name, setText } from '../ui/elements';
import type { CompetitionInfo } from '../board/model';

const app = mainElement();

/** Why a token does not let one in. */
function refusal(error: unknown): string {
  if (error instanceof ApiError && error.status === 401) return `That token is not valid here: ${error.message}.`;
  if (error instanceof ApiError && error.status === 403) return `That token is valid, but not an organizer’s: ${error.message}.`;
  return `${errorText(error)}.`;
}

function login(why?: string): void {
  const field = el('input', { type: 'password', id: 'token', autocomplete: 'off', spellcheck: 'false', required: true, 'aria-describedby': 'token-hint' });
  const error = el('p', { class: 'error', role: 'alert' }, why ?? '');
  const go = el('button', { type: 'submit', class: 'primary' }, 'Log in');
  const form = el('form', { class: 'panel login' },
    el('h1', {}, 'Organizers'),
    el('div', { class: 'field' }, el('label', { for: 'token' }, 'Token'), field,
      el('p', { class: 'hint', id: 'token-hint' }, 'The first organizer’s is in the server’s data directory, in organizer.token. It is kept in this page’s memory and nowhere else: a reload asks again.')),
    error, el('div', { class: 'actions' }, go));
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    const token = field.value.trim();
    go.disabled = true;
    error.textContent = '';
    if (!/^[\x21-\x7e]+$/.test(token)) {
      error.textContent = 'That is no token: one begins with plm_ and has no spaces.';
      go.disabled = false;
      return;
    }
    const desk = new AdminClient(token, (lost) => { login(lost); });
    // Asked without the desk's guard: here a refusal is about what was typed.
    getJson('/v1/admin/teams', token).then(() => { field.value = ''; enter(desk); }, (failure: unknown) => {
      desk.leave();
      go.disabled = false;
      error.textContent = refusal(failure);
      field.select();
    });
  });
  stop();
  stop = () => undefined;
  for (const dialog of document.querySelectorAll('dialog')) dialog.close();
  app.replaceChildren(form);
  field.focus();
}

let stop = (): void => undefined;

function enter(desk: AdminClient): void {
  const phase = el('span', { class: 'badge info' });
  const title = el('p', { class: 'lead' });
  const told = (info: CompetitionInfo): void => {
    setText(phase, info.phase ?? 'practice');
    title.replaceChildren(name(info.name));
  };
  getJson<CompetitionInfo>('/v1/competition').then(told, () => undefined);
  app.replaceChildren(el('div', { class: 'title' }, el('h1', { tabindex: -1 }, 'Organizers'), title, phase,
    button('Log out', () => { desk.leave(); login(); }, { class: 'small end' })));
  const tabs = [sessionsTab(desk), teamsTab(desk), handsTab(desk), runsTab(desk), announceTab(desk), competitionTab(desk, told), auditTab(desk)];
  const end = showTabs(app, tabs);
  // Whoever's token is revoked loses the page also while nothing is read.
  const watch = window.setInterval(() => { desk.get('/v1/admin/teams').catch(() => undefined); }, 3000);
  stop = () => { end(); window.clearInterval(watch); };
  app.querySelector('h1')?.focus();
}

login();
