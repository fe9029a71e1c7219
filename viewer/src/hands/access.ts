/** The API of hands. A team is identified by its token, on a practice server by its name. The token is kept only in memory. */
import { getJson, postJson, ApiError } from '../net/api';
import { isToken, NO_TOKEN, refusal } from '../net/token';
import type { EquilibriumResponse, EquilibriumRequest, HandDescription, Hands, SubmittedHand } from '../wire/messages';

export interface Access {
  token: string | null;
  team: string | null;
}

export const ANONYMOUS: Access = { token: null, team: null };

/** An address, with the team's name if there is no token; the name is not secret. */
function path(rest: string, { token, team }: Access): string {
  return `/v1/hands${rest}${token === null && team !== null ? `?team=${encodeURIComponent(team)}` : ''}`;
}

export function listHands(access: Access): Promise<Hands> {
  return getJson<Hands>(path('', access), access.token);
}

export function describeHand(name: string, access: Access): Promise<HandDescription> {
  return getJson<HandDescription>(path(`/${encodeURIComponent(name)}`, access), access.token);
}

export function requestEquilibrium(name: string, sent: EquilibriumRequest, access: Access): Promise<EquilibriumResponse> {
  return postJson<EquilibriumResponse>(path(`/${encodeURIComponent(name)}/equilibrium`, access), sent, access.token);
}

/** Uploads a hand; throws `ApiError` if the check rejects it. */
export async function uploadHand(archive: Uint8Array<ArrayBuffer>, access: Access): Promise<SubmittedHand> {
  const headers: Record<string, string> = { 'Content-Type': 'application/zip' };
  if (access.token !== null && !isToken(access.token)) throw new ApiError(NO_TOKEN, 401, 'not_authorized');
  if (access.token !== null) headers['Authorization'] = `Bearer ${access.token}`;
  let response: Response;
  try {
    response = await fetch(path('', access), { method: 'POST', headers, body: archive, credentials: 'omit' });
  } catch {
    throw new ApiError('the server does not answer, or stopped the upload: is the file larger than 32 MiB?', 0, 'unreachable');
  }
  const answer: unknown = await response.json().catch(() => null);
  if (response.ok) return answer as SubmittedHand;
  const problem = (answer ?? {}) as { detail?: string; code?: string };
  throw new ApiError(
    refusal(response.status, access.token) ?? problem.detail ?? `the server answered ${response.status}`,
    response.status,
    problem.code ?? '',
  );
}
