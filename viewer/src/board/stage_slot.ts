/** The stage as the wall uses it: loaded when there is a world, so that the ranking stands before it. */

/** Draws messages of the watch socket. */
export interface StageLike { scene(message: Record<string, unknown>): void; poses(message: Record<string, unknown>, at: number): void }

/** A stage in a place, or null where none can be drawn. */
export function stageFor(place: HTMLElement): Promise<StageLike | null> {
  place.dataset['empty'] = 'true';
  return Promise.resolve(null);
}
