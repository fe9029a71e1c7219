import { expect, test } from 'vitest';
import { isToken, NO_TOKEN, refusal } from './token';

test('a refusal has words for a person, not those for a program', () => {
  const said = [refusal(401, 'plm_a_b'), refusal(401, null), NO_TOKEN];
  for (const words of said) {
    expect(words).toMatch(/^[A-Z].*\.$/);
    expect(words).not.toMatch(/header|Bearer|`|</);
  }
  expect(new Set(said).size).toBe(said.length);
  expect(refusal(404, 'plm_a_b')).toBeNull();
});

test('a text that no socket carries is not sent', () => {
  expect(isToken('plm_0a1b_c2')).toBe(true);
  for (const wrong of ['', 'two words', 'plm_…', 'a,b', 'ключ']) expect(isToken(wrong)).toBe(false);
});
