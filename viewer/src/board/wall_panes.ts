/** The wall's ranking, page by page, and its session clocks, in large type. */
import { clock, points } from '../ui/format';
import { el, name, setText } from '../ui/elements';
import type { Board } from './model';
import { columns } from './model';
import { type Move, movement } from './movement';
import { pages } from './rotation';
import { marked } from './table';

/** Teams in a column: more would be too small to read from the back of a hall. */
export const TEAMS = 10;

/** Most characters of a name on one line: with few teams in large letters, with many teams, and over the whole width. */
const [FEW, MANY, WIDE] = [14, 20, 34];
/** A longer name is shown in the smallest letters. */
const LONGEST = 36;

/** The ranking: a column of `TEAMS` beside the picture; two of them, or one with all figures, where there is none. */
export class RankingPane {
  readonly element = el('section', { class: 'ranking', 'aria-label': 'Leaderboard' });
  private board: Board = { tasks: [], rows: [] };
  private moves = new Map<string, Move>();
  private known = false;
  private isAlone = false;
  page = 0;

  /** Number of pages. */
  get count(): number {
    return this.parts.length;
  }

  private get parts(): [number, number][] {
    return pages(this.board.rows.length, this.isAlone ? 2 * TEAMS : TEAMS);
  }

  show(board: Board): void {
    const moves = movement(this.known ? this.board.rows : null, board.rows);
    if (moves.size > 0) this.moves = moves;
    this.board = board;
    this.known = true;
    this.turn(this.page);
  }

  /** Whether nothing is beside the ranking. */
  alone(yes: boolean): void {
    if (yes === this.isAlone) return;
    this.isAlone = yes;
    this.turn(0);
  }

  /** Shows a page, cyclically. */
  turn(page: number): void {
    this.page = ((page % this.count) + this.count) % this.count;
    const total = this.board.rows.length;
    if (total === 0) {
      this.element.replaceChildren(el('p', { class: 'huge' }, 'No finished run yet'));
      return;
    }
    const [from, to] = this.parts[this.page] ?? [0, 0];
    const perColumn = Math.min(TEAMS, total);
    const tables =
      to - from > perColumn
        ? [this.table(from, from + perColumn, []), this.table(from + perColumn, to, [])]
        : [this.table(from, to, this.isAlone ? columns(this.board) : [])];
    // Few teams have larger rows.
    this.element.classList.toggle('few', perColumn <= TEAMS / 2);
    this.element.style.setProperty('--rows', String(perColumn));
    this.element.replaceChildren(
      el('div', { class: 'tables' }, ...tables),
      el('p', { class: 'pages' }, this.count > 1 ? `${from + 1}–${to} of ${total} teams` : ''),
    );
  }

  private table(from: number, to: number, tasks: readonly string[]): HTMLElement {
    const line = tasks.length > 0 ? WIDE : to - from <= TEAMS / 2 ? FEW : MANY;
    const size = (team: string): string | undefined =>
      team.length > Math.max(LONGEST, line) ? 'longest' : team.length > line ? 'long' : undefined;
    const rows = this.board.rows.slice(from, to).map((row) => {
      const move = this.moves.get(row.team);
      return el(
        'tr',
        {},
        el('td', { class: 'n rank' }, row.rank),
        el('th', { scope: 'row', class: size(row.team) }, el('div', {}, name(row.team), move === undefined ? null : marked(move))),
        ...tasks.map((task) => el('td', { class: 'n task' }, row.tasks[task] === undefined ? '–' : points(row.tasks[task].score))),
        el('td', { class: 'n total' }, points(row.total)),
      );
    });
    const head = el(
      'tr',
      {},
      ...['#', 'Team', ...tasks, 'Total'].map((text, index) =>
        el('th', { scope: 'col', class: index === 1 ? undefined : index > 1 && index < tasks.length + 2 ? 'n task' : 'n' }, text),
      ),
    );
    return el('table', {}, el('thead', {}, head), el('tbody', {}, ...rows));
  }
}

/** Clock of an open session; s. */
export interface WallClock {
  id: string;
  team: string;
  left: number | null;
  paused: boolean;
}

/** Most clocks below the picture. */
const MAX_CLOCKS = 4;

/** Clocks of open sessions: those with the least time left. */
export class ClocksPane {
  readonly element = el('section', { class: 'clocks', 'aria-label': 'Session clocks', hidden: true });

  show(clocks: readonly WallClock[]): void {
    const seen = [...clocks].sort((a, b) => (a.left ?? Infinity) - (b.left ?? Infinity)).slice(0, MAX_CLOCKS);
    this.element.hidden = seen.length === 0;
    // Rebuilt only for other sessions: the time alone changes often.
    const signature = JSON.stringify([clocks.length, seen.map((one) => [one.id, one.team, one.paused])]);
    if (this.element.dataset['shown'] !== signature) {
      this.element.dataset['shown'] = signature;
      const more = clocks.length - seen.length;
      this.element.replaceChildren(
        el('h2', {}, 'Time left', more > 0 ? el('span', {}, ` and ${more} more`) : null),
        el(
          'div',
          { class: 'grid' },
          ...seen.map((one) =>
            el(
              'div',
              { class: one.paused ? 'clock-card paused' : 'clock-card' },
              el('div', { class: 'who' }, name(one.team)),
              one.paused ? el('div', { class: 'state' }, 'paused') : null,
              el('div', { class: 'time', 'data-id': one.id }),
            ),
          ),
        ),
      );
    }
    for (const one of seen) {
      const time = this.element.querySelector(`[data-id="${CSS.escape(one.id)}"]`);
      if (time !== null) setText(time, clock(one.left));
    }
  }
}
