/** The scores of a team's runs of a task, in their order: a point for each run, and the best so far as a line. */
import { dateTime, points } from '../ui/format';
import { el } from '../ui/elements';
import type { RunRecord } from '../wire/messages';

/** Size of the drawing, in its own units; it scales with its place. */
const [WIDTH, HEIGHT] = [360, 170];
const [LEFT, RIGHT, TOP, BOTTOM] = [34, 10, 12, 24];
/** Most lines across. */
const LINES = 4;

/** A run with a score and its end. */
export type Scored = Pick<RunRecord, 'run_id' | 'task' | 'score' | 'ended_unix_ms' | 'status'> & { score: number };

/** The best score so far, run by run. */
export function bestSoFar(scores: readonly number[]): number[] {
  let best = -Infinity;
  return scores.map((score) => (best = Math.max(best, score)));
}

/** Round values from at most `least` to at least `most`, for lines across. */
export function ticks(least: number, most: number): number[] {
  const span = Math.max(most - least, 1);
  const unit = 10 ** Math.floor(Math.log10(span / LINES));
  const step = [1, 2, 5, 10].map((factor) => factor * unit).find((size) => span / size <= LINES) ?? span;
  const [from, to] = [Math.floor(least / step + 1e-9), Math.ceil(most / step - 1e-9)];
  return Array.from({ length: Math.max(2, to - from + 1) }, (_, k) => (from + k) * step);
}

function svg(tag: string, given: Record<string, string | number>, ...children: (Node | string)[]): SVGElement {
  const made = document.createElementNS('http://www.w3.org/2000/svg', tag);
  for (const [name, value] of Object.entries(given)) made.setAttribute(name, String(value));
  made.append(...children);
  return made;
}

/** The chart of runs in order of time. */
export function scoreChart(task: string, runs: readonly Scored[]): HTMLElement {
  const scores = runs.map((run) => run.score);
  const lines = ticks(Math.min(0, ...scores), Math.max(...scores));
  const [low = 0, high = 1] = [lines[0], lines.at(-1)];
  const x = (k: number): number => LEFT + (WIDTH - LEFT - RIGHT) * (runs.length === 1 ? 0.5 : k / (runs.length - 1));
  const y = (score: number): number => HEIGHT - BOTTOM - ((HEIGHT - TOP - BOTTOM) * (score - low)) / (high - low);
  const best = bestSoFar(scores);
  const path = best.map((score, k) => (k === 0 ? `M${x(0)},${y(score)}` : `H${x(k)}V${y(score)}`)).join('');
  const most = best.at(-1) ?? 0;
  const drawing = svg(
    'svg',
    {
      viewBox: `0 0 ${WIDTH} ${HEIGHT}`,
      role: 'group',
      'aria-label': `Scores of ${runs.length} runs of ${task}; the best is ${points(most)}`,
    },
    ...lines.map((value) =>
      svg(
        'g',
        { class: 'across' },
        svg('line', { x1: LEFT, x2: WIDTH - RIGHT, y1: y(value), y2: y(value) }),
        svg('text', { x: LEFT - 8, y: y(value) + 4, 'text-anchor': 'end' }, points(value).replace(/\.0$/, '')),
      ),
    ),
    svg('path', { d: path, class: 'best' }),
    ...runs.map((run, k) =>
      svg(
        'a',
        { href: `/replay/${encodeURIComponent(run.run_id)}`, tabindex: -1 },
        svg(
          'circle',
          { cx: x(k), cy: y(run.score), r: 4, class: run.score === most ? 'run top' : 'run' },
          svg('title', {}, `${points(run.score)}, ${dateTime(run.ended_unix_ms)}`),
        ),
      ),
    ),
    svg('text', { x: LEFT, y: HEIGHT - 6 }, dateTime(runs[0]?.ended_unix_ms)),
    ...(runs.length > 1
      ? [svg('text', { x: WIDTH - RIGHT, y: HEIGHT - 6, 'text-anchor': 'end' }, dateTime(runs.at(-1)?.ended_unix_ms))]
      : []),
  );
  const figure = el('figure', { class: 'scores' }, el('figcaption', {}, task));
  figure.append(drawing);
  return figure;
}
