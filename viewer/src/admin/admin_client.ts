/** The API client of a logged-in organizer, with the token only in memory; and the interface of a tab. */
import { getJson, postJson, ApiError, saveFile } from '../net/api';
import { toast } from '../ui/elements';

/** A tab of the page. */
export interface Tab {
  /** Short, for the address after #. */
  readonly id: string;
  readonly title: string;
  readonly element: HTMLElement;
  /** Time between two refreshes while the tab is visible, ms. */
  readonly period: number;
  /** Reads its data again. */
  refresh(): Promise<void>;
}

/** Sends requests with the token. When the server no longer accepts the token, it logs out. */
export class AdminClient {
  #token: string;
  #over = false;

  constructor(
    token: string,
    private readonly lost: (why: string) => void,
  ) {
    this.#token = token;
  }

  /** A GET; the types are in docs/schema/openapi.json. */
  get<T>(path: string): Promise<T> {
    return this.#guard(() => getJson<T>(path, this.#token));
  }

  /** A POST. */
  post<T>(path: string, body: Record<string, unknown>): Promise<T> {
    return this.#guard(() => postJson<T>(path, body, this.#token));
  }

  /** Downloads a file. */
  async save(path: string, fileName: string): Promise<void> {
    try {
      await this.#guard(() => saveFile(path, fileName, this.#token));
    } catch (error) {
      toast(errorText(error), true);
    }
  }

  /** The public part of the token, which lists show. */
  get tokenId(): string {
    return this.#token.split('_')[1] ?? '';
  }

  /** Forgets the token. */
  leave(): void {
    this.#over = true;
    this.#token = '';
  }

  async #guard<T>(act: () => Promise<T>): Promise<T> {
    if (this.#over) throw new ApiError('you are logged out', 401, 'not_authorized');
    try {
      return await act();
    } catch (error) {
      if (error instanceof ApiError && error.status === 401 && !this.#over) {
        this.leave();
        this.lost('Your token was revoked. Log in with another one.');
      }
      throw error;
    }
  }
}

/** An error as text. */
export function errorText(error: unknown): string {
  if (error instanceof ApiError) return error.message;
  console.error(error);
  return 'this page has an error; details are in the browser console';
}
