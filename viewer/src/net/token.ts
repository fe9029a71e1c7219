/** Tokens that a person pastes: whether a text can be one, and the words for a refusal. The server's own words are for programs. */

/** Whether a text can be sent as a token; others are not, since neither a header nor a socket carries them. */
export function isToken(text: string): boolean {
  return /^[\w.~-]+$/.test(text);
}

export const NO_TOKEN = 'This is not a token. A token begins with plm_ and has no spaces: copy all of it.';
export const UNKNOWN_TOKEN =
  'The server does not know this token. Copy all of it, from plm_ to its end. If it was revoked, ask an organizer for another one.';
export const NEEDS_TOKEN = 'This needs a token, which an organizer can give you.';

/** The words for a refusal with this HTTP status; null for a status that has nothing to do with tokens. */
export function refusal(status: number, token: string | null): string | null {
  if (status !== 401) return null;
  return token === null ? NEEDS_TOKEN : UNKNOWN_TOKEN;
}
