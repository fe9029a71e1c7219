import { expect, test } from 'vitest';
import { PAGE_MS, pages, turned } from './rotation';

test('every page is full, and has all rows between the first and the last', () => {
  expect(pages(60, 10)).toHaveLength(6);
  expect(pages(60, 10).at(-1)).toEqual([50, 60]);
  expect(pages(63, 10).at(-1)).toEqual([53, 63]);
  expect(pages(5, 10)).toEqual([[0, 5]]);
  expect(pages(0, 10)).toEqual([[0, 0]]);
});

test('pages follow each other, unless one is held', () => {
  const first = { page: 0, since: 0 };
  expect(turned(first, 3, PAGE_MS - 1, false)).toBe(first);
  expect(turned(first, 3, PAGE_MS, false)).toEqual({ page: 1, since: PAGE_MS });
  expect(turned({ page: 2, since: 0 }, 3, PAGE_MS, false)).toEqual({ page: 0, since: PAGE_MS });
  expect(turned(first, 3, 1e9, true)).toBe(first);
  expect(turned(first, 1, 1e9, false)).toBe(first);
  expect(turned({ page: 5, since: 0 }, 2, 7, true)).toEqual({ page: 0, since: 7 });
});
