/** `/teams/NAME`: a team's place, its best runs, its scores in time, and its runs with their replays. */
import '../style/base.css';
import '../style/team.css';
import { type Board, columns, replayIsOpen } from '../board/model';
import { scoreChart, type Scored } from '../board/score_chart';
import { getJson, ApiError } from '../net/api';
import { dateTime, ordinal, points } from '../ui/format';
import { el, facts, mainElement, name } from '../ui/elements';
import type { CompetitionResponse, LeaderboardRow, RunList, RunRecord, TaskBest } from '../wire/messages';

const app = mainElement();
const team = document.body.dataset['arg'] ?? '';
/** Rows of the table of runs at first. */
const FIRST = 20;

/** The mark of a status, with its word. */
function mark(status: string): HTMLElement | null {
  if (status === 'practice') return null;
  return el('span', { class: `badge ${status === 'verified' ? 'ok' : status === 'rejected' ? 'bad' : 'warn'}` }, status);
}

function summary(row: LeaderboardRow, teams: number): HTMLElement {
  return el(
    'div',
    { class: 'figures' },
    el('p', {}, el('b', {}, ordinal(row.rank)), ` of ${teams} ${teams === 1 ? 'team' : 'teams'}`),
    el('p', {}, el('b', {}, points(row.total)), ' points in all'),
    el('p', {}, el('b', {}, String(row.runs)), row.runs === 1 ? ' run' : ' runs'),
    row.sensors_rank === null ? null : el('p', {}, el('b', {}, ordinal(row.sensors_rank)), ' with sensors only'),
  );
}

function bests(board: Board, row: LeaderboardRow, open: boolean): HTMLElement {
  const cell = (best: TaskBest): HTMLElement[] => [
    el('td', { class: 'n', 'data-label': 'Score' }, points(best.score)),
    el('td', { 'data-label': 'When' }, dateTime(best.ended_unix_ms), ' ', mark(best.status)),
    el(
      'td',
      {},
      open
        ? el(
            'a',
            { href: `/replay/${encodeURIComponent(best.run_id)}` },
            'Replay',
            el('span', { class: 'visually-hidden' }, ` of ${best.run_id}`),
          )
        : null,
    ),
  ];
  return el(
    'section',
    {},
    el('h2', {}, 'Best runs'),
    el(
      'div',
      { class: 'scroll', tabindex: 0 },
      el(
        'table',
        { class: 'cards' },
        el(
          'thead',
          {},
          el(
            'tr',
            {},
            ...['Task', 'Score', 'When', ''].map((head) => el('th', { scope: 'col', class: head === 'Score' ? 'n' : undefined }, head)),
          ),
        ),
        el(
          'tbody',
          {},
          ...columns(board).map((task) => {
            const best = row.tasks[task];
            return el(
              'tr',
              {},
              el('th', { scope: 'row' }, task),
              ...(best === undefined ? [el('td', { class: 'n none', 'data-label': 'Score' }, '–'), el('td'), el('td')] : cell(best)),
            );
          }),
        ),
      ),
    ),
  );
}

function charts(runs: readonly Scored[]): HTMLElement {
  const tasks = [...new Set(runs.map((run) => run.task))].sort();
  return el(
    'section',
    {},
    el('h2', {}, 'Scores in time'),
    el('p', { class: 'soft' }, 'A point is a run and leads to its replay; the line is the best so far.'),
    el(
      'div',
      { class: 'columns' },
      ...tasks.map((task) =>
        scoreChart(
          task,
          runs.filter((run) => run.task === task),
        ),
      ),
    ),
  );
}

function row(run: RunRecord): HTMLElement {
  return el(
    'tr',
    {},
    el('th', { scope: 'row' }, run.task),
    el('td', { 'data-label': 'Hand' }, name(run.hand)),
    el('td', { class: 'n', 'data-label': 'Score' }, run.score === null ? '–' : points(run.score)),
    el('td', { 'data-label': 'Ended' }, dateTime(run.ended_unix_ms), ' ', mark(run.status)),
    el(
      'td',
      {},
      el(
        'a',
        { href: `/replay/${encodeURIComponent(run.run_id)}` },
        'Replay',
        el('span', { class: 'visually-hidden' }, ` of ${run.run_id}`),
      ),
    ),
  );
}

function list(runs: readonly RunRecord[], more: boolean): HTMLElement {
  const body = el('tbody', {}, ...runs.slice(0, FIRST).map(row));
  const all = el(
    'button',
    {
      type: 'button',
      on: {
        click: () => {
          body.append(...runs.slice(FIRST).map(row));
          all.remove();
        },
      },
    },
    `Show all ${runs.length}`,
  );
  return el(
    'section',
    {},
    el('h2', {}, 'Runs'),
    el(
      'div',
      { class: 'scroll', tabindex: 0 },
      el(
        'table',
        { class: 'cards' },
        el(
          'thead',
          {},
          el(
            'tr',
            {},
            ...['Task', 'Hand', 'Score', 'Ended', ''].map((head) =>
              el('th', { scope: 'col', class: head === 'Score' ? 'n' : undefined }, head),
            ),
          ),
        ),
        body,
      ),
    ),
    runs.length > FIRST ? all : null,
    more ? el('p', { class: 'soft' }, 'Only the newest runs are listed.') : null,
  );
}

async function start(): Promise<void> {
  document.title = `${team} – Palmares`;
  const [info, board, { runs, more }] = await Promise.all([
    getJson<CompetitionResponse>('/v1/competition'),
    getJson<Board>('/v1/leaderboard'),
    getJson<RunList>(`/v1/runs?team=${encodeURIComponent(team)}`),
  ]);
  const place = board.rows.find((one) => one.team === team);
  const open = replayIsOpen(info);
  const scored = runs
    .filter((run): run is RunRecord & Scored => run.score !== null && run.ended_unix_ms !== null)
    .sort((a, b) => (a.ended_unix_ms ?? 0) - (b.ended_unix_ms ?? 0));
  app.classList.add('team-page');
  app.replaceChildren(
    el(
      'div',
      { class: 'title' },
      el('h1', {}, name(team)),
      el('p', { class: 'lead' }, name(info.name)),
      el('a', { class: 'end', href: '/' }, 'All teams'),
    ),
  );
  if (place === undefined)
    app.append(
      el(
        'section',
        { class: 'empty' },
        el('h2', {}, 'No finished run'),
        el('p', {}, 'No team of this name has a finished run on this server.'),
      ),
    );
  else app.append(summary(place, board.rows.length), bests(board, place, open));
  if (scored.length > 0) app.append(charts(scored), list(runs, more));
  else if (!open && place !== undefined)
    app.append(el('p', { class: 'notice' }, 'The other runs and all replays are public when the competition is over.'));
  else if (place !== undefined) app.append(facts([['Runs', 'This server has no replays of this team.']]));
}

start().catch((error: unknown) => {
  app.replaceChildren(
    el(
      'p',
      { class: 'notice bad', role: 'alert' },
      error instanceof ApiError ? `${error.message}. Reload the page.` : 'This page has an error.',
    ),
  );
  if (!(error instanceof ApiError)) console.error(error);
});
