/** The stage as the wall uses it: loaded when there is a world, so that the ranking stands before it. */
import { type Moment, POSE } from '../model/moment';
import { sceneOf, type WireScene } from '../model/scene';
import type { Stage } from '../render/stage';

/** Draws messages of the watch socket. */
export interface StageLike { scene(message: Record<string, unknown>): void; poses(message: Record<string, unknown>, at: number): void }

/** A stage in a place, or null where none can be drawn: without WebGL. `stage` is told when it is there. */
export async function stageFor(place: HTMLElement, told: (stage: Stage) => void = () => undefined): Promise<StageLike | null> {
  let stage: Stage;
  try {
    const { Stage: Drawn } = await import('../render/stage');
    stage = new Drawn(place);
  } catch (error) {
    console.warn('no world can be drawn here', error);
    return null;
  }
  stage.setOverlay('regions', true);
  told(stage);
  return {
    scene(message) {
      stage.setScene(sceneOf(message as unknown as WireScene));
      stage.view('front');
    },
    poses(message, at) { stage.push(momentOf(message), at); },
  };
}

/** The message `poses`, whose poses are lists of seven, as a moment. */
export function momentOf(message: Record<string, unknown>): Moment {
  const lists = message['poses'] as number[][];
  const poses = new Float32Array(lists.length * POSE);
  lists.forEach((list, row) => { poses.set(list, row * POSE); });
  return { tick: message['tick'] as number, time: message['sim_time_s'] as number, score: null, poses };
}
