/** `/wall`: for a projector. Ranking beside the featured run and the session clocks, with announcements below, without input. */
import '../style/base.css';
import '../style/wall.css';
import { getJson, ApiError } from '../net/api';
import { clock } from '../ui/format';
import { button, el, mainElement, name, setText } from '../ui/elements';
import type { Board } from '../board/model';
import { worthOf } from '../board/gain';
import { type Showing, turned } from '../board/rotation';
import { openFeed } from '../board/feed';
import { LivePane } from '../board/wall_live';
import { ClocksPane, RankingPane, type WallClock } from '../board/wall_panes';
import { type ClockReading, leftAt, readClock } from '../admin/clocks';
import type { Announcement, CompetitionResponse, Session, TaskInfo } from '../wire/messages';

/** Display time of an announcement, ms. */
const ANNOUNCED_MS = 10 * 60_000;
const PHASES = { closed: 'not open yet', open: 'open', revealed: 'over' } as const;

const ranking = new RankingPane();
let tasks: TaskInfo[] = [];
const live = new LivePane((task) => worthOf(tasks.find((one) => one.name === task)?.goals));
const clocks = new ClocksPane();
const readings = new Map<string, { session: Session; reading: ClockReading }>();

const title = el('h1', {});
const phase = el('p', { class: 'phase' });
const state = el('p', { class: 'held', role: 'status' });
const banner = el('p', { class: 'banner', role: 'status', hidden: true });
const help = el('div', { class: 'help' });
const beside = el('div', { class: 'beside' }, live.element, clocks.element);
const paneArea = el('div', { class: 'panes' }, ranking.element, beside);

declare global {
  interface Window {
    palmares?: Record<string, unknown>;
  }
}
window.palmares = { live };

let info: CompetitionResponse | null = null;
let token: string | null = null;
/** The token with which the sessions were last refused; undefined at first. */
let refusedWith: string | null | undefined;
let stop: () => void = () => undefined;
let shown: Showing = { page: 0, since: 0 };
let held = false;
let connected = false;

function wallClocks(): WallClock[] {
  const now = performance.now();
  const open = [...readings.values()].filter(
    ({ session }) => session.status === 'open' && (session.left_s ?? 1) > 0 && session.elapsed_s > 0,
  );
  if (open.length > 0) {
    const all = open.map(({ session, reading }) => ({
      id: session.session_id,
      team: session.team,
      left: leftAt(reading, now),
      paused: session.paused_unix_ms !== null,
    }));
    return all.filter((one) => one.left !== null);
  }
  const seen = live.clock;
  return seen === null || seen.left === null ? [] : [{ id: 'watched', team: seen.team, left: seen.left, paused: false }];
}

function show(next: Showing): void {
  if (next.page !== ranking.page) ranking.turn(next.page);
  shown = next;
}

/** The picture and the clocks share the width with the ranking, if there are any. */
function arrange(): void {
  const list = wallClocks();
  clocks.show(list);
  live.element.hidden = !live.ready;
  beside.hidden = !live.ready && list.length === 0;
  ranking.alone(beside.hidden);
}

function beat(): void {
  arrange();
  show(turned(shown, ranking.count, performance.now(), held));
  const time = new Date();
  const paused = typeof info?.paused_unix_ms === 'number' && info.phase !== 'revealed';
  const of = info?.mode === 'official' ? `${paused ? 'paused' : PHASES[info.phase ?? 'closed']} · ` : '';
  setText(phase, `${of}${clock(time.getHours() * 60 + time.getMinutes()).padStart(5, '0')}`);
  setText(state, [held ? 'paused' : '', connected ? '' : 'no connection'].filter((text) => text !== '').join(' · '));
}

function skip(by: 1 | -1): void {
  show({ page: (shown.page + by + ranking.count) % ranking.count, since: performance.now() });
}

function hold(): void {
  held = !held;
  beat();
}

function announced({ text, unix_ms: at }: Announcement): void {
  const fresh = Date.now() - at < ANNOUNCED_MS && text !== '';
  banner.hidden = !fresh;
  banner.replaceChildren(name(text));
  if (fresh)
    window.setTimeout(
      () => {
        if (banner.textContent === text) banner.hidden = true;
      },
      ANNOUNCED_MS - (Date.now() - at),
    );
}

function listen(): void {
  stop();
  stop = openFeed(
    {
      ranking: (rows) => ranking.show({ tasks: info?.tasks ?? [], rows }),
      announcement: announced,
      connected: (yes) => {
        connected = yes;
      },
      world: (message) => live.take(message),
      revoked: () => {
        token = null;
        readings.clear();
        live.leave();
        askToken('The token was revoked: the wall shows no official runs and no clocks.');
        listen();
      },
    },
    token,
  );
}

async function readSessions(): Promise<void> {
  // In a competition the sessions need a token.
  if (token === refusedWith || (token === null && info?.mode === 'official')) return;
  const asked = token;
  try {
    const { sessions } = await getJson<{ sessions: Session[] }>('/v1/sessions', asked);
    // The token was revoked meanwhile: its answer is no longer for this wall.
    if (token !== asked) return;
    const now = performance.now();
    const gone = new Set(readings.keys());
    for (const session of sessions) {
      gone.delete(session.session_id);
      readings.set(session.session_id, { session, reading: readClock(session, now, readings.get(session.session_id)?.reading) });
    }
    for (const id of gone) readings.delete(id);
  } catch (error) {
    if (!(error instanceof ApiError) || error.status === 0) return;
    // Another request with the same token would be refused, too.
    if (error.status === 401 || error.status === 403) refusedWith = token;
    readings.clear();
  }
}

/** Fails if the server does not accept the token. A token without access to sessions (403) is valid. */
async function checkToken(given: string): Promise<void> {
  try {
    await getJson('/v1/sessions', given);
  } catch (failure) {
    if (!(failure instanceof ApiError) || failure.status !== 403) throw failure;
  }
}

function askToken(why = ''): void {
  if (document.querySelector('dialog') !== null) return;
  const field = el('input', { type: 'password', id: 'token', autocomplete: 'off', required: true });
  const error = el('p', { class: 'error', role: 'alert' }, why);
  const form = el(
    'form',
    { method: 'dialog' },
    el('h2', { id: 'token-title' }, 'Token for watching'),
    el('p', {}, 'With a viewer’s token the wall shows official runs and session clocks. This page keeps it only in memory.'),
    error,
    el('div', { class: 'field' }, el('label', { for: 'token' }, 'Token'), field),
    el(
      'div',
      { class: 'actions' },
      button('Continue without', () => dialog.close()),
      el('button', { type: 'submit', class: 'primary' }, 'Use this token'),
    ),
  );
  const dialog = el('dialog', { 'aria-labelledby': 'token-title' }, form);
  form.addEventListener('submit', (event) => {
    event.preventDefault();
    const given = field.value.trim();
    // A refused socket would not report why.
    checkToken(given).then(
      () => {
        dialog.close();
        token = given;
        listen();
        void readSessions();
      },
      (failure: unknown) => {
        error.textContent = failure instanceof ApiError ? `${failure.message}.` : 'This page has an error.';
        field.select();
      },
    );
  });
  dialog.addEventListener('close', () => {
    field.value = '';
    dialog.remove();
  });
  document.body.append(dialog);
  dialog.showModal();
}

let quiet = 0;
function showHelp(): void {
  help.classList.add('seen');
  window.clearTimeout(quiet);
  quiet = window.setTimeout(() => help.classList.remove('seen'), 5000);
}

function onKey(event: KeyboardEvent): void {
  if (event.ctrlKey || event.altKey || event.metaKey || document.querySelector('dialog') !== null) return;
  // The space bar activates a focused button.
  if (event.key === ' ' && !(event.target instanceof HTMLButtonElement)) {
    event.preventDefault();
    hold();
  }
  if (event.key === 'ArrowRight') skip(1);
  if (event.key === 'ArrowLeft') skip(-1);
  if (event.key === 't') {
    event.preventDefault();
    askToken();
  }
  showHelp();
}

async function start(): Promise<void> {
  help.append(
    button('Back', () => skip(-1)),
    button('Pause', hold),
    button('Next', () => skip(1)),
    button('Token…', () => askToken()),
    el(
      'span',
      {},
      el('kbd', {}, '←'),
      ' ',
      el('kbd', {}, '→'),
      ' skip, ',
      el('kbd', {}, 'space'),
      ' pause, ',
      el('kbd', {}, 't'),
      ' token',
    ),
  );
  mainElement().replaceChildren(el('header', { class: 'wall-head' }, title, state, phase), paneArea, banner, help);
  document.addEventListener('keydown', onKey);
  document.addEventListener('pointermove', showHelp);
  [info, { tasks }] = await Promise.all([getJson<CompetitionResponse>('/v1/competition'), getJson<{ tasks: TaskInfo[] }>('/v1/tasks')]);
  title.replaceChildren(name(info.name));
  ranking.show(await getJson<Board>('/v1/leaderboard'));
  getJson<{ announcements: Announcement[] }>('/v1/announcements').then(
    ({ announcements }) => {
      const newest = announcements.reduce<Announcement | null>((a, b) => (a === null || b.unix_ms > a.unix_ms ? b : a), null);
      if (newest !== null) announced(newest);
    },
    () => undefined,
  );
  listen();
  await readSessions();
  if (info.mode === 'official') showHelp();
  beat();
  window.setInterval(beat, 250);
  window.setInterval(() => void readSessions(), 2000);
  window.setInterval(() => {
    getJson<CompetitionResponse>('/v1/competition').then(
      (now) => {
        info = now;
      },
      () => undefined,
    );
  }, 15_000);
}

start().catch((error: unknown) => {
  mainElement().replaceChildren(
    el(
      'p',
      { class: 'notice bad', role: 'alert' },
      error instanceof ApiError ? `${error.message}. Trying again.` : 'This page has an error.',
    ),
  );
  if (error instanceof ApiError) window.setTimeout(() => location.reload(), 5000);
  else console.error(error);
});
