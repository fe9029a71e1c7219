/** `/admin`: the organizers' page. It keeps the token only in memory: after a reload it asks again. */
import '../style/base.css';
import '../style/admin.css';
import { auditTab } from '../admin/audit';
import { announceTab, competitionTab } from '../admin/competition';
import { AdminClient, errorText } from '../admin/admin_client';
import { handsTab } from '../admin/hands';
import { runsTab } from '../admin/runs';
import { scheduleTab } from '../admin/schedule';
import { sessionsTab } from '../admin/sessions';
import { showTabs } from '../admin/tabs';
import { teamsTab } from '../admin/teams';
import { getJson, ApiError } from '../net/api';
import { button, el, mainElement, name, setText } from '../ui/elements';
import type { CompetitionResponse } from '../wire/messages';

const app = mainElement();

/** Why a login failed. */
function refusal(error: unknown): string {
  if (error instanceof ApiError && error.status === 403) return 'This token is valid, but it is not an organizer’s.';
  return `${errorText(error)}.`;
}

function login(why?: string): void {
  const field = el('input', {
    type: 'password',
    id: 'token',
    autocomplete: 'off',
    spellcheck: 'false',
    required: true,
    'aria-describedby': 'token-hint',
  });
  const error = el('p', { class: 'error', role: 'alert' }, why ?? '');
  const go = el('button', { type: 'submit', class: 'primary' }, 'Log in');
  const form = el(
    'form',
    { class: 'panel login' },
    el('h1', {}, 'Organizers'),
    el(
      'div',
      { class: 'field' },
      el('label', { for: 'token' }, 'Token'),
      field,
      el(
        'p',
        { class: 'hint', id: 'token-hint' },
        'The first organizer’s token is in the file organizer.token in the server’s data directory. This page keeps it only in memory and asks again after a reload.',
      ),
    ),
    error,
    el('div', { class: 'actions' }, go),
  );
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    const token = field.value.trim();
    go.disabled = true;
    error.textContent = '';
    const admin = new AdminClient(token, (lost) => login(lost));
    // Not through AdminClient: here a refusal concerns the typed token.
    getJson('/v1/admin/teams', token).then(
      () => {
        field.value = '';
        enter(admin);
      },
      (failure: unknown) => {
        admin.leave();
        go.disabled = false;
        error.textContent = refusal(failure);
        field.select();
      },
    );
  });
  stop();
  stop = () => undefined;
  for (const dialog of document.querySelectorAll('dialog')) dialog.close();
  app.replaceChildren(form);
  field.focus();
}

let stop = (): void => undefined;

function enter(admin: AdminClient): void {
  const phase = el('span', { class: 'badge info' });
  const paused = el('span', { class: 'badge warn', hidden: true }, 'paused');
  const title = el('p', { class: 'lead' });
  const showPhase = (info: CompetitionResponse): void => {
    setText(phase, info.phase ?? 'practice');
    paused.hidden = typeof info.paused_unix_ms !== 'number';
    title.replaceChildren(name(info.name));
  };
  const readPhase = (): void => {
    getJson<CompetitionResponse>('/v1/competition').then(showPhase, () => undefined);
  };
  readPhase();
  app.replaceChildren(
    el(
      'div',
      { class: 'title' },
      el('h1', { tabindex: -1 }, 'Organizers'),
      title,
      phase,
      paused,
      button(
        'Log out',
        () => {
          admin.leave();
          login();
        },
        { class: 'small end' },
      ),
    ),
  );
  const tabs = [
    sessionsTab(admin),
    teamsTab(admin),
    scheduleTab(admin),
    handsTab(admin),
    runsTab(admin),
    announceTab(admin),
    competitionTab(admin, showPhase),
    auditTab(admin),
  ];
  const end = showTabs(app, tabs);
  // Notices a revoked token, and what other organizers do, within 3 s.
  const watch = window.setInterval(() => {
    admin.get('/v1/admin/teams').then(readPhase, () => undefined);
  }, 3000);
  stop = () => {
    end();
    window.clearInterval(watch);
  };
  app.querySelector('h1')?.focus();
}

login();
