/** The wall's stage. It is loaded with the first run, so that the ranking appears without waiting for it. */
import { type Moment, POSE } from '../model/moment';
import { sceneOf } from '../model/scene';
import type { Stage } from '../render/stage';
import type { Poses, WatchScene } from '../wire/messages';

/** Shows messages of the watch socket. */
export interface StageLike {
  scene(message: WatchScene): void;
  poses(message: Poses, at: number): void;
}

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
      stage.setScene(sceneOf(message));
      stage.view('front');
    },
    poses(message, at) {
      stage.push(momentOf(message), at);
    },
  };
}

/** Converts the message `poses`, whose poses are lists of seven numbers. */
export function momentOf(message: Poses): Moment {
  const lists = message.poses;
  const poses = new Float32Array(lists.length * POSE);
  lists.forEach((list, row) => poses.set(list, row * POSE));
  return { tick: message.tick, time: message.sim_time_s, score: null, poses };
}
