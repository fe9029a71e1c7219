import { expect, test } from 'vitest';
import { verification } from './runs';

test('the state of a verification has host, tries and reason', () => {
  expect(verification({})).toBeNull();
  expect(verification({ verify_state: 'waiting', verify_tries: 0 })).toBe('waits for its verification');
  expect(verification({ verify_state: 'waiting', verify_tries: 1, verify_host: 'h2' })).toBe('being verified by h2');
  expect(verification({ verify_state: 'waiting', verify_tries: 1, verify_problem: 'missing_file: gone' })).toBe(
    'waits for its verification after 1 try: missing_file: gone',
  );
  expect(verification({ verify_state: 'stuck', verify_tries: 5, verify_problem: 'missing_file: gone' })).toBe(
    'verification stuck after 5 tries: missing_file: gone',
  );
});
