/** Messages of the control socket, as far as the page uses them; docs/protocol.md describes them. SI units. */
import type { Quat, Vec3 } from '../model/scene';
import type { Shape } from '../model/shape';
import type { RunEvent } from '../net/watch';

export interface PoseTarget { position: Vec3; quat_xyzw: Quat }
/** A target of the base: a pose, or a velocity to keep. */
export type BaseTarget = PoseTarget | { linear: Vec3; angular: Vec3 };
/** Changed targets of a step; omitted targets stay as they are. */
export interface Action { base?: BaseTarget; hand?: number[] }
/** A wrench on a link, about its origin, world frame: N, N·m. */
export interface Push { link: string; force: Vec3; torque: Vec3; duration_s: number }

/** A component of an action, with its limits. */
export interface Spec { name: string; unit: string; minimum: number | null; maximum: number | null }
export interface TaskInfo { name: string; description: string; tick_s: number; time_limit_s: number }
export interface HandInfo { name: string; description: string; motors: string[]; joints: string[] }

export interface Welcome {
  op: 'welcome';
  session_id: string;
  team: string;
  competition: { name: string; mode: string };
  limits: { repeat: number };
  specs: { action: Spec[] };
  note?: string;
}

export interface RunInfo { task: string; hand: string; seed: number | null; tick_s: number; time_limit_s: number }
export interface WireSceneBody {
  id: number;
  name: string;
  free: boolean;
  position?: Vec3;
  quat_xyzw?: Quat;
  parts: { position: Vec3; quat_xyzw: Quat; shape: Shape }[];
  color: Vec3;
}
export interface ResetScene { bodies: WireSceneBody[]; regions: { name: string; role?: string; min: Vec3; max: Vec3 }[] }
export interface Actuator { name: string; command: number; position: number; tension: number }

export interface Observation {
  op: 'obs';
  run_id: string;
  tick: number;
  sim_time_s: number;
  hand: { base: { position: Vec3; quat_xyzw: Quat }; actuators: Actuator[] };
  truth?: {
    objects: { position: Vec3[]; quat_xyzw: Quat[] };
    joints: { position: number[] };
    predicted_equilibrium: number[] | null;
  };
  events: RunEvent[];
  score: number;
  terminated: boolean;
  truncated: boolean;
  reason?: string;
  run?: RunInfo;
  scene?: ResetScene;
}

export interface Result {
  op: 'result';
  run_id: string;
  score: number;
  in_goal: number;
  outside: number;
  reason: string;
  ticks: number;
  state_hash: string;
}

export interface Ack { op: 'ack'; tick: number }
