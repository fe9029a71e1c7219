/** The leaderboard table: rows slide to their new places, and changes are marked. */
import type { Board } from './model';
import { columns, replayIsOpen } from './model';
import { points } from '../ui/format';
import { type Move, moveMark, movement, announcementOf } from './movement';
import { el, name, setText } from '../ui/elements';
import type { CompetitionResponse, LeaderboardRow, TaskBest } from '../wire/messages';

/** Duration of a row's slide, ms. */
const SLIDE_MS = 600;

/** One leaderboard table. Scores are in points. */
export class BoardTable {
  readonly element = el('div', { class: 'scroll', tabindex: 0, role: 'region', 'aria-label': 'Leaderboard' });
  private readonly spoken = el('p', { class: 'visually-hidden', 'aria-live': 'polite' });
  private readonly body = el('tbody');
  private readonly head = el('tr');
  private readonly rows = new Map<string, HTMLTableRowElement>();
  private shown: LeaderboardRow[] | null = null;
  private moves = new Map<string, Move>();

  constructor(private readonly info: Pick<CompetitionResponse, 'mode' | 'phase'>) {
    this.element.append(el('table', { class: 'cards board' }, el('thead', {}, this.head), this.body), this.spoken);
  }

  /** Shows a ranking; changes since the previous one are marked until the next change. */
  show(board: Board): void {
    const before = this.shown;
    const moves = movement(before, board.rows);
    if (moves.size > 0) this.moves = moves;
    this.shown = board.rows;
    const tasks = columns(board);
    const places = before === null ? null : this.places();
    const heads = ['Rank', 'Team', 'Total', ...tasks, 'Sensors', 'Runs'];
    this.head.replaceChildren(...heads.map((text) => el('th', { scope: 'col', class: text === 'Team' ? undefined : 'n' }, text)));
    const gone = new Set(this.rows.keys());
    for (const row of board.rows) {
      gone.delete(row.team);
      const line = this.rows.get(row.team) ?? el('tr');
      this.rows.set(row.team, line);
      const hadFocus = line.contains(document.activeElement);
      line.replaceChildren(...this.cells(row, tasks));
      if (hadFocus) line.querySelector('a')?.focus();
      // A team that others overtook gets only the mark next to its name.
      const move = moves.get(row.team);
      line.classList.toggle('changed', move !== undefined && (move.places === null || Math.abs(move.gained) > 1e-9));
      this.body.append(line);
    }
    for (const team of gone) {
      this.rows.get(team)?.remove();
      this.rows.delete(team);
    }
    if (places !== null) this.slide(places);
    if (moves.size > 0) setText(this.spoken, announcementOf(moves, board.rows));
  }

  private cells(row: LeaderboardRow, tasks: readonly string[]): HTMLElement[] {
    const move = this.moves.get(row.team);
    const team = el(
      'th',
      { scope: 'row' },
      el('a', { class: 'team', href: `/teams/${encodeURIComponent(row.team)}` }, name(row.team)),
      move === undefined ? null : marked(move),
    );
    const scores = tasks.map((task) => {
      const best = row.tasks[task];
      return el('td', { class: best === undefined ? 'n none' : 'n', 'data-label': task }, best === undefined ? '–' : this.score(best));
    });
    return [
      el('td', { class: 'n rank' }, row.rank),
      team,
      el('td', { class: 'n total' }, points(row.total)),
      ...scores,
      el('td', { class: row.sensors_rank === null ? 'n none' : 'n', 'data-label': 'Sensors' }, row.sensors_rank ?? '–'),
      el('td', { class: 'n', 'data-label': 'Runs' }, row.runs),
    ];
  }

  private score(best: TaskBest): HTMLElement {
    const text = points(best.score);
    const status =
      best.status === 'practice'
        ? null
        : el('span', { class: `status ${best.status}`, title: best.status }, best.status === 'verified' ? '✓' : '…');
    const said = best.status === 'practice' ? null : el('span', { class: 'visually-hidden' }, ` ${best.status}`);
    if (!replayIsOpen(this.info)) return el('span', {}, text, status, said);
    return el(
      'a',
      { href: `/replay/${encodeURIComponent(best.run_id)}` },
      text,
      status,
      said,
      el('span', { class: 'visually-hidden' }, ', replay'),
    );
  }

  private places(): Map<string, number> {
    return new Map([...this.rows].map(([team, line]) => [team, line.getBoundingClientRect().top]));
  }

  /** Animates the rows from their old places. */
  private slide(places: ReadonlyMap<string, number>): void {
    if (matchMedia('(prefers-reduced-motion: reduce)').matches) return;
    for (const [team, line] of this.rows) {
      const way = (places.get(team) ?? line.getBoundingClientRect().top) - line.getBoundingClientRect().top;
      if (Math.abs(way) > 1)
        line.animate([{ transform: `translateY(${way}px)` }, { transform: 'none' }], { duration: SLIDE_MS, easing: 'ease-in-out' });
    }
  }
}

/** A mark such as ▲2, with its text for screen readers. */
export function marked(move: Move): HTMLElement {
  const { sign, words, way } = moveMark(move);
  return el(
    'span',
    { class: `move ${way}` },
    el('span', { 'aria-hidden': 'true' }, sign),
    el('span', { class: 'visually-hidden' }, `, ${words}`),
  );
}
