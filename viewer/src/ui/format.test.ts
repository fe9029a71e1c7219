import { expect, test } from 'vitest';
import { clock, clockInWords, figure, dateTime, ordinal, points, printable } from './format';

test('points have one decimal, a true minus, and no negative zero', () =>
  expect([3, -0.5, 0, -0.04, 12.25].map(points)).toEqual(['3.0', '−0.5', '0.0', '0.0', '12.3']));

test('a clock rounds seconds up, so that 0:00 is the end', () => {
  expect([1745, 1744.2, 0.4, 0, -3, 3723, 60].map(clock)).toEqual(['29:05', '29:05', '0:01', '0:00', '0:00', '1:02:03', '1:00']);
  expect([null, undefined, Infinity].map(clock)).toEqual(['—', '—', '—']);
  expect([61, 60, 1, null].map(clockInWords)).toEqual(['1 minute 1 second', '1 minute 0 seconds', '1 second', 'without a limit']);
});

test('a time on another day includes the date', () => {
  const now = new Date(2027, 4, 3, 12, 0, 0).getTime();
  expect(dateTime(now - 3_600_000, now)).toBe('11:00:00');
  expect(dateTime(now - 86_400_000, now)).toBe('2027-05-02 12:00:00');
  expect(dateTime(null, now)).toBe('—');
});

test('numbers keep four digits', () =>
  expect([0.6, 0.31416, 1e-9, 0, 1e6, 250, -3, null, Infinity].map(figure)).toEqual([
    '0.6',
    '0.3142',
    '1.00e−9',
    '0',
    '1.00e+6',
    '250',
    '−3',
    '–',
    '∞',
  ]));

test('ordinals', () =>
  expect([1, 2, 3, 4, 11, 12, 13, 21, 22, 60, 111].map(ordinal)).toEqual([
    '1st',
    '2nd',
    '3rd',
    '4th',
    '11th',
    '12th',
    '13th',
    '21st',
    '22nd',
    '60th',
    '111th',
  ]));

test('invisible characters in a name are written as codes', () => {
  expect(printable('\u202esbarc')).toBe('\\u{202E}sbarc');
  expect(printable('\u200b')).toBe('\\u{200B}');
  expect(printable('דגים <b>')).toBe('דגים <b>');
  expect(printable('a\u2800b')).toBe('a\\u{2800}b');
});
