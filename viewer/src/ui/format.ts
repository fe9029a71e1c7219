/** Numbers, times and names as text. */

/** Points with one decimal and a true minus sign; −0 is 0. */
export function points(score: number): string {
  const text = (Math.round(score * 10) / 10 + 0).toFixed(1);
  return text === '-0.0' ? '0.0' : text.replace('-', '−');
}

/** Seconds as a clock: 29:05, 1:02:03. Part of a second counts as a whole one, so that 0:00 is the end. Null is an em dash. */
export function clock(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return '—';
  const whole = Math.max(0, Math.ceil(seconds - 1e-6));
  const two = (n: number): string => String(n).padStart(2, '0');
  const [hours, minutes, rest] = [Math.floor(whole / 3600), Math.floor(whole / 60) % 60, whole % 60];
  return hours > 0 ? `${hours}:${two(minutes)}:${two(rest)}` : `${minutes}:${two(rest)}`;
}

/** Seconds in words, for screen readers. */
export function clockInWords(seconds: number | null | undefined): string {
  if (seconds === null || seconds === undefined || !Number.isFinite(seconds)) return 'without a limit';
  const whole = Math.max(0, Math.ceil(seconds - 1e-6));
  const minutes = Math.floor(whole / 60);
  const of = (n: number, word: string): string => `${n} ${word}${n === 1 ? '' : 's'}`;
  return minutes === 0 ? of(whole, 'second') : `${of(minutes, 'minute')} ${of(whole % 60, 'second')}`;
}

/** Local time of day; the date is added for any day but today. */
export function dateTime(unixMs: number | null | undefined, now: number = Date.now()): string {
  if (unixMs === null || unixMs === undefined) return '—';
  const [at, today] = [new Date(unixMs), new Date(now)];
  const two = (n: number): string => String(n).padStart(2, '0');
  const time = `${two(at.getHours())}:${two(at.getMinutes())}:${two(at.getSeconds())}`;
  if (at.toDateString() === today.toDateString()) return time;
  return `${at.getFullYear()}-${two(at.getMonth() + 1)}-${two(at.getDate())} ${time}`;
}

/** A number with at most four significant digits; powers of ten below 0.001 and from 1,000,000 on. */
export function figure(value: number | null | undefined): string {
  if (value === null || value === undefined) return '–';
  if (!Number.isFinite(value)) return value > 0 ? '∞' : '−∞';
  const size = Math.abs(value);
  const text = size !== 0 && (size < 1e-3 || size >= 1e6) ? value.toExponential(2) : String(Number(value.toPrecision(4)));
  return text.replaceAll('-', '−');
}

/** 1st, 2nd, 3rd, 11th. */
export function ordinal(n: number): string {
  const tens = n % 100;
  if (tens >= 11 && tens <= 13) return `${n}th`;
  return `${n}${['th', 'st', 'nd', 'rd'][n % 10] ?? 'th'}`;
}

const INVISIBLE = /[\p{Cc}\p{Cf}\p{Zl}\p{Zp}\p{Co}\p{Cn}\p{Cs}\p{Default_Ignorable_Code_Point}\u2800]/gu;

/** A name with invisible and direction-changing characters written as `\u{202E}`. */
export function printable(text: string): string {
  return text.replace(INVISIBLE, (one) => `\\u{${(one.codePointAt(0) ?? 0).toString(16).toUpperCase()}}`);
}
