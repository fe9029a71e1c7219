/** The wall's ranking pane, page by page, and its pane of session clocks, in large type. */
import { clock, points } from '../ui/format';
import { el, name, setText } from '../ui/elements';
import type { Board } from './model';
import { columns } from './model';
import { type Move, movement } from './movement';
import { pages } from './rotation';
import { marked } from './table';

/** Teams on a page. */
export const TEAMS = 8;

/** A longer name is shown smaller, on two lines; characters. */
const LONG = 30;

/** The ranking, `TEAMS` at a time. */
export class RankingPane {
  readonly element = el('section', { class: 'pane ranking', 'aria-label': 'Leaderboard' });
  private board: Board = { tasks: [], rows: [] };
  private moves = new Map<string, Move>();
  private known = false;
  page = 0;

  /** Number of pages. */
  get count(): number {
    return pages(this.board.rows.length, TEAMS).length;
  }

  show(board: Board): void {
    const moves = movement(this.known ? this.board.rows : null, board.rows);
    if (moves.size > 0) this.moves = moves;
    this.board = board;
    this.known = true;
    this.turn(this.page);
  }

  /** Shows a page, cyclically. */
  turn(page: number): void {
    this.page = ((page % this.count) + this.count) % this.count;
    const [from, to] = pages(this.board.rows.length, TEAMS)[this.page] ?? [0, 0];
    const tasks = columns(this.board);
    const rows = this.board.rows.slice(from, to).map((row) => {
      const move = this.moves.get(row.team);
      return el('tr', {}, el('td', { class: 'n rank' }, row.rank), el('th', { scope: 'row', class: row.team.length > LONG ? 'long' : undefined }, el('div', {}, name(row.team), move === undefined ? null : marked(move))),
        ...tasks.map((task) => el('td', { class: 'n task' }, row.tasks[task] === undefined ? '–' : points(row.tasks[task].score))),
        el('td', { class: 'n total' }, points(row.total)));
    });
    const head = el('tr', {}, ...['#', 'Team', ...tasks, 'Total'].map((text, index) => el('th', { scope: 'col', class: index === 1 ? undefined : index > 1 && index < tasks.length + 2 ? 'n task' : 'n' }, text)));
    this.element.replaceChildren(rows.length === 0
      ? el('p', { class: 'huge' }, 'No finished run yet')
      : el('table', {}, el('thead', {}, head), el('tbody', {}, ...rows)),
    el('p', { class: 'pages' }, this.count > 1 ? `${from + 1}–${to} of ${this.board.rows.length} teams` : ''));
  }
}

/** Clock of an open session; s. */
export interface WallClock { id: string; team: string; left: number | null; paused: boolean }

/** Maximum number of clocks. */
const MAX_CLOCKS = 8;

/** Clocks of open sessions. */
export class ClocksPane {
  readonly element = el('section', { class: 'pane clocks', 'aria-label': 'Session clocks' });

  show(clocks: readonly WallClock[]): void {
    const seen = [...clocks].sort((a, b) => (a.left ?? Infinity) - (b.left ?? Infinity)).slice(0, MAX_CLOCKS);
    // Rebuilt only for other sessions: the time alone changes often.
    const signature = JSON.stringify(seen.map((one) => [one.id, one.team, one.paused]));
    if (this.element.dataset['shown'] !== signature) {
      this.element.dataset['shown'] = signature;
      this.element.replaceChildren(el('h2', {}, 'Sessions'), el('div', { class: 'grid' }, ...seen.map((one) => el('div', { class: one.paused ? 'clock-card paused' : 'clock-card' },
        el('div', { class: 'who' }, name(one.team)), el('div', { class: 'time', 'data-id': one.id }), one.paused ? el('div', { class: 'state' }, 'paused') : null))));
    }
    for (const one of seen) {
      const time = this.element.querySelector(`[data-id="${CSS.escape(one.id)}"]`);
      if (time !== null) setText(time, clock(one.left));
    }
  }
}
