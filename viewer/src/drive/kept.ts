/** A run that survives a reload of the page: the tab keeps the session's secret and what the server does not send again. */
import type { ActionRecordingState } from './action_recording';
import type { Action, BaseTarget, HandDescription, Obs, Opened, Scene } from '../wire/messages';

export interface KeptRun {
  resume_token: string;
  team: string;
  task: string;
  hand: HandDescription;
  run: Opened;
  scene: Scene;
  /** The newest observation. */
  observation: Obs;
  recording: ActionRecordingState;
  targets: { base: BaseTarget | null; hand: number[] };
  /** The step without an answer yet. */
  sent: { ticks: number; action: Action } | null;
  paused: boolean;
  factor: number;
}

const KEY = 'palmares.drive';

/** Keeps the run for the next page of this tab. */
export function keep(kept: KeptRun): boolean {
  try {
    sessionStorage.setItem(KEY, JSON.stringify(kept));
    return true;
  } catch {
    return false;
  }
}

/** Takes the kept run: a copy of this tab must not take it, too. */
export function takeKept(): KeptRun | null {
  try {
    const text = sessionStorage.getItem(KEY);
    sessionStorage.removeItem(KEY);
    return text === null ? null : (JSON.parse(text) as KeptRun);
  } catch {
    return null;
  }
}
