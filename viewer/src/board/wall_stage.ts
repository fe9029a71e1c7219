/** The wall's stage. It is loaded with the first run, so that the ranking appears without waiting for it. */
import { type Moment, POSE } from '../model/moment';
import { sceneOf, type WireScene } from '../model/scene';
import type { Stage } from '../render/stage';

/** Shows messages of the watch socket. */
export interface StageLike { scene(message: Record<string, unknown>): void; poses(message: Record<string, unknown>, at: number): void }

/** Creates the stage, or null if that fails. `created` gets the stage. */
export async function stageFor(place: HTMLElement, created: (stage: Stage) => void = () => undefined): Promise<StageLike | null> {
  let stage: Stage;
  try {
    const { Stage: Drawn } = await import('../render/stage');
    stage = new Drawn(place);
  } catch (error) {
    console.warn('the 3D view could not be created', error);
    return null;
  }
  stage.setOverlay('regions', true);
  created(stage);
  return {
    scene(message) {
      stage.setScene(sceneOf(message as unknown as WireScene));
      stage.view('front');
    },
    poses(message, at) { stage.push(momentOf(message), at); },
  };
}

/** Converts the message `poses`, whose poses are lists of seven numbers. */
export function momentOf(message: Record<string, unknown>): Moment {
  const lists = message['poses'] as number[][];
  const poses = new Float32Array(lists.length * POSE);
  lists.forEach((list, row) => { poses.set(list, row * POSE); });
  return { tick: message['tick'] as number, time: message['sim_time_s'] as number, score: null, poses };
}
