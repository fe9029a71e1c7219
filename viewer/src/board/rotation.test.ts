import { expect, test } from 'vitest';
import { after, pages, type Pane, rotate } from './rotation';

const panes = (live: boolean, clocks = true): Pane[] => [
  { id: 'board', ms: 10_000, ready: true }, { id: 'live', ms: 20_000, ready: live }, { id: 'clocks', ms: 8000, ready: clocks },
];

test('panes follow each other, those with nothing to show are left out', () => {
  let shown = rotate(panes(false), null, 0, false, null);
  expect(shown).toEqual({ id: 'board', since: 0 });
  shown = rotate(panes(false), shown, 9999, false, null);
  expect(shown?.id).toBe('board');
  shown = rotate(panes(false), shown, 10_000, false, null);
  expect(shown).toEqual({ id: 'clocks', since: 10_000 });
  shown = rotate(panes(true), shown, 18_000, false, null);
  expect(shown?.id).toBe('board');
  expect(rotate([], shown, 0, false, null)).toBeNull();
});

test('a held pane stays, unless it has nothing to show any more', () => {
  expect(rotate(panes(true), { id: 'board', since: 0 }, 1e9, true, 1e9)?.id).toBe('board');
  expect(rotate(panes(false), { id: 'live', since: 0 }, 10, true, null)?.id).toBe('clocks');
});

test('what is exciting comes soon and stays while it is', () => {
  expect(rotate(panes(true), { id: 'board', since: 0 }, 3000, false, 2900)?.id).toBe('board');
  expect(rotate(panes(true), { id: 'board', since: 0 }, 4000, false, 2900)).toEqual({ id: 'live', since: 4000 });
  expect(rotate(panes(true), { id: 'live', since: 4000 }, 30_000, false, 29_000)?.id).toBe('live');
  expect(rotate(panes(true), { id: 'live', since: 4000 }, 42_000, false, 29_000)?.id).toBe('clocks');
});

test('back and forth around the corner', () => {
  expect(after(panes(true), 2)?.id).toBe('board');
  expect(after(panes(true), 0, -1)?.id).toBe('clocks');
  expect(pages(60, 8)).toHaveLength(8);
  expect(pages(60, 8).at(-1)).toEqual([56, 60]);
  expect(pages(0, 8)).toEqual([[0, 0]]);
});
