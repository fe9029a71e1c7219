/** The organizer's desk: whoever is logged in, with the token in memory alone, and what every tab asks of the server. */
import { getJson, postJson, ApiError, saveFile } from '../net/api';
import { toast } from '../ui/elements';

/** A tab of the page. */
export interface Tab {
  /** Short, for the address after #. */
  readonly id: string;
  readonly title: string;
  readonly element: HTMLElement;
  /** How often it is read again while it is seen, ms. */
  readonly period: number;
  /** Reads what it shows. */
  refresh(): Promise<void>;
}

/** Asks with the token. When the server does not take it any more, everything ends. */
export class AdminClient {
  #token: string;
  #over = false;

  constructor(token: string, private readonly lost: (why: string) => void) {
    this.#token = token;
  }

  /** A GET; the type as in docs/schema/openapi.json. */
  get<T>(path: string): Promise<T> {
    return this.#guard(() => getJson<T>(path, this.#token));
  }

  /** A POST. */
  post<T>(path: string, body: Record<string, unknown>): Promise<T> {
    return this.#guard(() => postJson<T>(path, body, this.#token));
  }

  /** Fetches a file and lets the browser keep it. */
  async save(path: string, fileName: string): Promise<void> {
    try {
      await this.#guard(() => saveFile(path, fileName, this.#token));
    } catch (error) {
      toast(errorText(error), true);
    }
  }

  /** The public half of the token, by which it is listed. */
  get tokenId(): string {
    return this.#token.split('_')[1] ?? '';
  }

  /** Forgets the token. */
  leave(): void {
    this.#over = true;
    this.#token = '';
  }

  async #guard<T>(act: () => Promise<T>): Promise<T> {
    if (this.#over) throw new ApiError('nobody is logged in', 401, 'not_authorized');
    try {
      return await act();
    } catch (error) {
      if (error instanceof ApiError && error.status === 401 && !this.#over) {
        this.leave();
        this.lost('The server does not take this token any more: it was revoked. Log in with another one.');
      }
      throw error;
    }
  }
}

/** An error in words. */
export function errorText(error: unknown): string {
  if (error instanceof ApiError) return error.message;
  console.error(error);
  return 'this page has a fault; its console says more';
}
