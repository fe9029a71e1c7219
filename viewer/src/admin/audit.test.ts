import { expect, test } from 'vitest';
import { lastOf } from './audit';

test('the last record is found with few requests, also from an earlier last record', async () => {
  for (const last of [0, 1, 2, 3, 7, 8, 1000, 12_345]) {
    let count = 0;
    const has = (after: number): Promise<boolean> => {
      count += 1;
      return Promise.resolve(after < last);
    };
    expect(await lastOf(has)).toBe(last);
    expect(count).toBeLessThan(40);
    for (const known of [0, Math.floor(last / 2), Math.max(0, last - 1), last]) expect(await lastOf(has, known)).toBe(last);
  }
});
