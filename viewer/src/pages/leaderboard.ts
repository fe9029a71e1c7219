/** `/`: replaces the table in the server's HTML and keeps it up to date. */
import '../style/base.css';
import '../style/board.css';
import { connect, legend, taskCards } from '../board/side_panels';
import { getJson, ApiError } from '../net/api';
import { el, mainElement, part, setText } from '../ui/elements';
import type { Board } from '../board/model';
import { standing } from '../board/places';
import { BoardTable } from '../board/table';
import { openFeed } from '../board/feed';
import type { Announcement, CompetitionResponse, LeaderboardRow, TaskInfo } from '../wire/messages';

/** Time between two requests of the competition’s state, ms. */
const STANDING_MS = 15_000;

async function start(): Promise<void> {
  const app = mainElement();
  const [first, { tasks }] = await Promise.all([
    getJson<CompetitionResponse>('/v1/competition'),
    getJson<{ tasks: TaskInfo[] }>('/v1/tasks'),
  ]);
  let info = first;
  const place = part(app, 'div', 'board');
  const beside = part(app, 'section', 'tasks');
  app.classList.add('board-page');
  // The server's own table is removed.
  for (const old of app.querySelectorAll(':scope > .scroll, :scope > .empty')) old.remove();

  const line = el('p', { class: 'board-line soft', role: 'status' });
  const notice = el('p', { class: 'notice', hidden: true });
  const table = new BoardTable(info);
  const empty = el(
    'section',
    { class: 'empty' },
    el('h2', {}, 'No finished run yet'),
    el('p', {}, 'A team appears here as soon as it finishes a run. How to connect is explained on this page.'),
  );
  place.replaceChildren(notice, line, table.element, empty);
  beside.replaceChildren(el('h2', {}, 'Tasks'), ...taskCards(tasks), connect(info));
  app.querySelector('footer p, footer')?.replaceWith(footer(info));
  if (app.querySelector('footer') === null) app.append(footer(info));

  let teams = 0;
  let live = false;
  const say = (): void => {
    const sentences = standing(info);
    setText(
      line,
      `${sentences === '' ? '' : `${sentences} `}${teams === 1 ? '1 team' : `${teams} teams`}. ${live ? 'Live.' : 'Connection lost. Reconnecting.'}`,
    );
  };
  const show = (board: Board): void => {
    teams = board.rows.length;
    table.element.hidden = teams === 0;
    empty.hidden = teams > 0;
    table.show(board);
    say();
  };
  show(await getJson<Board>('/v1/leaderboard'));
  openFeed({
    ranking: (rows: LeaderboardRow[]) => show({ tasks: info.tasks, rows }),
    announcement: ({ text }: Announcement) => {
      notice.hidden = text === '';
      setText(notice, text);
    },
    connected: (yes) => {
      live = yes;
      say();
    },
  });
  window.setInterval(() => {
    getJson<CompetitionResponse>('/v1/competition').then(
      (now) => {
        info = now;
        say();
      },
      () => undefined,
    );
  }, STANDING_MS);
}

function footer(info: CompetitionResponse): HTMLElement {
  return el(
    'footer',
    {},
    legend(info),
    el('p', {}, el('a', { href: '/v1/leaderboard' }, 'as JSON'), ' ', el('a', { href: '/v1/leaderboard.csv' }, 'as CSV')),
  );
}

start().catch((error: unknown) => {
  // The server's table stays, without updates.
  const why = error instanceof ApiError ? error.message : 'this page has an error';
  mainElement().prepend(el('p', { class: 'notice bad', role: 'alert' }, `This page no longer updates by itself: ${why}. Reload the page.`));
  if (!(error instanceof ApiError)) console.error(error);
});
