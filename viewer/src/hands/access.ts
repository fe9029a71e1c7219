/** Who asks: a team by its token, on a practice server by its name. Kept in this page's memory alone; never in an address. */
import { getJson, postJson, ApiError } from '../net/api';
import type { Equilibrium, EquilibriumRequest, HandDescription, Hands, SubmittedHand } from '../wire/messages';

export interface Access { token: string | null; team: string | null }

export const ANONYMOUS: Access = { token: null, team: null };

/** An address with whose hands are meant; the team's name is no secret. */
function path(rest: string, { token, team }: Access): string {
  return `/v1/hands${rest}${token === null && team !== null ? `?team=${encodeURIComponent(team)}` : ''}`;
}

export function listHands(access: Access): Promise<Hands> {
  return getJson<Hands>(path('', access), access.token);
}

export function describeHand(name: string, access: Access): Promise<HandDescription> {
  return getJson<HandDescription>(path(`/${encodeURIComponent(name)}`, access), access.token);
}

export function requestEquilibrium(name: string, asked: EquilibriumRequest, access: Access): Promise<Equilibrium> {
  return postJson<Equilibrium>(path(`/${encodeURIComponent(name)}/equilibrium`, access), asked, access.token);
}

/** Sends a hand in; what the check refuses is thrown as `Refused`. */
export async function sendHand(archive: Uint8Array<ArrayBuffer>, access: Access): Promise<SubmittedHand> {
  const headers: Record<string, string> = { 'Content-Type': 'application/zip' };
  if (access.token !== null) headers['Authorization'] = `Bearer ${access.token}`;
  let response: Response;
  try {
    response = await fetch(path('', access), { method: 'POST', headers, body: archive, credentials: 'omit' });
  } catch {
    throw new ApiError('the server does not answer, or took no more of the file: is it larger than 32 MiB?', 0, 'unreachable');
  }
  const answer: unknown = await response.json().catch(() => null);
  if (response.ok) return answer as SubmittedHand;
  const problem = (answer ?? {}) as { detail?: string; code?: string };
  throw new ApiError(problem.detail ?? `the server answered ${response.status}`, response.status, problem.code ?? '');
}
