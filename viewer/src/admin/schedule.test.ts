import { expect, test } from 'vitest';
import { fieldTime, wireTime } from './schedule';

test('a time in a form is local and reaches the server with its offset', () => {
  for (const moment of ['2027-05-04T09:00:00Z', '2027-12-31T23:59:30Z']) {
    const ms = Date.parse(moment);
    expect(fieldTime(ms)).toMatch(/^\d{4}-\d\d-\d\dT\d\d:\d\d:\d\d$/);
    expect(Date.parse(wireTime(fieldTime(ms)))).toBe(ms);
  }
});
