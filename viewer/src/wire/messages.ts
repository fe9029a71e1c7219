/**
 * Types of all messages and HTTP bodies, derived from docs/schema: `cargo xtask generate` writes them. SI units unless a field
 * says otherwise; vectors are in the world frame, quaternions are x, y, z, w.
 */

/** An accelerometer: it reads acceleration minus gravity, in the frame of its link. */
export interface Accelerometer {
  /** Link of the URDF that carries it. */
  link: string;
  /** Largest magnitude along each axis, m/s². */
  range: number;
  /** Standard deviation of the noise, m/s². */
  noise: number;
  /** Standard deviation of the constant error, m/s². */
  bias: number;
}

/** `ack`: the action or push is accepted. */
export interface Ack {
  /** The id of the request. */
  id: number;
  /** The tick at which it takes effect: the observation of this tick is the first with its effect. */
  tick: number;
}

/** `act`: sets the action of a realtime run, from the next tick on. */
export interface Act {
  /** Targets; an omitted field keeps its last target. */
  action: Action;
  /** Cameras whose images the next observation has; see `step`. */
  cameras?: string[];
}

/** Targets for one tick. An omitted field keeps its last target. */
export interface Action {
  /** Target of the hand's base. */
  base?: BaseTarget;
  /** Part of its largest force that every motor may use, each in [0, 1]; 1 until a run has its first. */
  effort?: number[];
  /** σ of every motor, in the hand's motor order, each in [0, 1]. */
  hand?: number[];
}

/** The action of the step from `tick` to `tick + 1`. */
export interface ActionMessage {
  /** The tick before the step. */
  tick: number;
  /** As applied: clipped and complete. */
  action: Action;
  /** External wrenches that begin with this step. */
  pushes?: PushMessage[];
  /** Digest of every bit of the state at `tick + 1`, 16 hexadecimal digits. Early files have it only every hundred ticks. */
  state?: string;
}

/** What a motor's sensors read. */
export interface ActuatorObservation {
  /** Name of the motor. */
  name: string;
  /** Commanded σ. */
  command: number;
  /** σ the motor has reached. */
  position: number;
  /** dσ/dt, 1/s. */
  velocity: number;
  /** Tension of its tendons, in the tendon's unit (hand.toml); negative where a drive pushes. */
  tension: number;
}

/** The hands of all teams, oldest first. */
export interface AllHands {
  hands: HandRow[];
  /** Whether there are more, which `limit` left out. */
  more: boolean;
}

/** An announcement of an organizer. */
export interface Announcement {
  /** Counts up from 1. */
  id: number;
  /** Its text; empty to withdraw the one before. */
  text: string;
  /** Time, ms since 1970 UTC. */
  unix_ms: number;
}

/** Announcements, newest first. */
export interface Announcements {
  announcements: Announcement[];
}

/** A joint of an arm. */
export interface ArmJointInfo {
  /** Its name in the URDF. */
  name: string;
  /** `rad`, or `m` for a joint that slides. */
  unit: string;
  /** Least position; null for a joint without end. */
  minimum: number | null;
  /** Largest position; null for a joint without end. */
  maximum: number | null;
  /** Largest speed, 1/s. */
  speed: number;
}

/** Readings of the joints of an arm, in its order. Their encoders have no error. */
export interface ArmReading {
  /** rad, or m of a joint that slides. */
  position: number[];
  /** rad/s or m/s, mean of the last tick. */
  velocity: number[];
}

/** Records of the audit, oldest first. */
export interface Audit {
  records: AuditEntry[];
  /** Whether there are more, which `limit` left out. */
  more: boolean;
}

/** A record. */
export interface AuditEntry {
  /** Counts up from 1. */
  seq: number;
  /** Time, ms since 1970 UTC. */
  unix_ms: number;
  /** Id of the token that was used, or `server`. */
  actor: string;
  /** Label of this token: its holder. */
  label: string | null;
  /** The action. */
  action: string;
  /** Its object. */
  subject: string;
  /** Granted time, s; for `session.grant`. */
  seconds: number | null;
  /** The reason. */
  reason: string | null;
}

/** A pose or velocity of the hand's base in the world frame, or the joints of its arm. */
export type BaseTarget =
  | { position: [number, number, number]; quat_xyzw: [number, number, number, number] }
  | { linear: [number, number, number]; angular: [number, number, number] }
  | { joints: number[] };

/** Kind of a body. */
export type BodyKind = 'object' | 'furniture' | 'hand';

/** Pose and velocity of a body in the world frame. */
export interface BodyState {
  /** Origin of the body frame, m. */
  position: [number, number, number];
  /** Orientation, x, y, z, w. */
  quat_xyzw: [number, number, number, number];
  /** Velocity of the origin, m/s. */
  linear: [number, number, number];
  /** rad/s */
  angular: [number, number, number];
}

/** `bye`: ends the session; an open run is stopped and scored first. */
export type Bye = Record<string, never>;

/** A depth camera with a colour image of the same view. Its optical frame has x to the right, y down and z forward. */
export interface Camera {
  /** Unique among the cameras of a run: `wrist`. */
  name: string;
  /** Origin of the optical frame, m: in the world for a camera of a task, in its link for one of a hand. */
  position: [number, number, number];
  /** Orientation of the optical frame, x, y, z, w. */
  quat_xyzw: [number, number, number, number];
  /** Pixels in a row. */
  width: number;
  /** Rows. */
  height: number;
  /** Horizontal field of view, degrees. */
  fov_deg: number;
  /** Smallest depth in an image, m. */
  near: number;
  /** Largest depth in an image, m. */
  far: number;
  /** Unit of the 16-bit depth, m. */
  depth_unit: number;
  /** Errors compared with an ideal camera. */
  stereo: Stereo;
  /** Link of the hand that carries it; absent for a fixed camera of a task. */
  link?: string;
}

/** An image of a camera. */
export interface CameraImage {
  /** The camera's name. */
  camera: string;
  /** The tick after which it was exposed; with `noise: "real"` some ticks before that of the observation. */
  tick: number;
  /** Pixels in a row. */
  width: number;
  /** Rows. */
  height: number;
  /** Focal lengths, pixels. The point (x, y, z) of the optical frame is at u = fx x/z + cx, v = fy y/z + cy, where the middle of the first pixel is at 0.5, 0.5. */
  fx: number;
  /** See `fx`. */
  fy: number;
  /** The optical axis in the image, pixels. */
  cx: number;
  /** See `cx`. */
  cy: number;
  /** Origin of the optical frame (x right, y down, z forward) in the world when it was exposed, m. */
  position: [number, number, number];
  /** Orientation of the optical frame, x, y, z, w. */
  quat_xyzw: [number, number, number, number];
  /** Unit of `depth`, m. */
  depth_unit: number;
  /** Id of the visible body, 16 bits a pixel: those of the scene, then the hand's links; 65535 for none. Only with sensing `truth`. */
  bodies?: string;
  /** Distance along the optical axis, 16 bits a pixel; 0 where there is no reading. */
  depth?: string;
  /** sRGB, three bytes a pixel. */
  rgb?: string;
}

/** A camera of a task or a hand. */
export interface CameraInfo {
  /** Its name in `step.cameras`. A hand's camera has the prefix `hand_` in a task that has a camera of its name. */
  name: string;
  /** Pixels in a row. */
  width: number;
  /** Rows. */
  height: number;
  /** Horizontal field of view, degrees. */
  fov_deg: number;
  /** Shortest distance with a reading, m. */
  near: number;
  /** Longest distance with a reading, m. */
  far: number;
  /** The images that it takes. */
  images: ImageInfo[];
}

/** A channel of a hand, as clients and viewers learn it. */
export interface ChannelInfo {
  /** Name of its array in environments and batches. */
  name: string;
  /** Its key in `obs.hand`. */
  key: string;
  /** Shape of the array. */
  shape: number[];
  /** Columns along the array's last axis. Where a column has a name, `obs.hand` has an object with these names, or a list of such objects, one for each row. */
  columns: ColumnInfo[];
  /** For people. */
  description: string;
  /** Present and true if the channel is only in observations with sensing `truth`. */
  truth?: boolean;
}

/** Whether a team can be added. */
export interface CheckedTeam {
  /** Its name as it is stored, or as it was sent if it is not valid. */
  team: string;
  /** Whether it exists. */
  exists: boolean;
  /** The reason why it cannot be added. */
  problem: string | null;
}

/** The client program: `"name/version"`, or an object. */
export type ClientInfo =
  | string
  | { name: string; version?: string };

/** `clock`: the session's clock, once a second. */
export interface Clock {
  /** The run. */
  run_id: string;
  /** Time left in the session, s; null when it has no limit. */
  session_left_s: number | null;
  /** Time that the session has spent, s; null when its clock is not known. */
  elapsed_s: number | null;
  /** Whether an organizer has stopped the session's clock. */
  paused: boolean | null;
  /** Simulated time per time in the last second; null in the first message. */
  real_time_factor: number | null;
  /** Largest delay of a tick in the last second, s; null in a lockstep run. */
  late_s: number | null;
}

/** The kind of an error. */
export type Code = 'bad_json' | 'unknown_op' | 'bad_request' | 'bad_action' | 'stale_tick' | 'wrong_state' | 'unknown_task' | 'unknown_hand' | 'unknown_camera' | 'hand_in_the_way' | 'not_authorized' | 'forbidden' | 'session_taken' | 'session_over' | 'not_scheduled' | 'capacity' | 'rate_limited' | 'too_large' | 'too_slow' | 'internal' | 'not_found';

/** A colour with its opacity; each component is 0 to 1. */
export interface Color {
  r: number;
  g: number;
  b: number;
  a: number;
}

/** Numbers of a channel that have a unit and a range in common. */
export interface ColumnInfo {
  /** Number of values. */
  width: number;
  /** Unit; empty for a pure number. */
  unit: string;
  /** Least value; null for none. */
  minimum: number | null;
  /** Largest value; null for none. */
  maximum: number | null;
  /** Absent where the channel's numbers have no names. */
  name?: string;
}

/** The competition, or the practice, that the server runs. */
export interface Competition {
  /** Name, for people. */
  name: string;
  /** `practice` (no token, own seeds, full state) or `official`. */
  mode: string;
  /** Length of a session, s; null for none. */
  session_s: number | null;
  /** Time that each `reset` takes from the session, s. */
  reset_cost_s: number;
  /** Sensor errors of runs that request none; in a competition, of every run. */
  noise: Noise;
  /** Tasks whose runs must have sensing `sensors`. */
  sensors_only: string[];
  /** Whether the seed of a run draws the numbers of its hand that are known as ranges. */
  hand_spread: boolean;
  /** Whose scene run `k` of a task has, in a competition: one for all teams, or every team's own. */
  scenes: Scenes;
}

/** The reason for an action on the competition. */
export interface CompetitionActionRequest {
  /** The reason, for the audit. */
  reason?: string;
}

/** The competition after the action. */
export interface CompetitionActionResponse {
  phase: CompetitionPhase;
  /** Number of open sessions. */
  open_sessions: number;
  /** Begin of the pause of all sessions, ms since 1970 UTC; only while they are paused. */
  paused_unix_ms?: number;
}

/** The phase of an official competition. */
export type CompetitionPhase = 'closed' | 'open' | 'revealed';

/** The competition of this server. */
export interface CompetitionResponse {
  /** Name, for people. */
  name: string;
  /** `practice` (no token, own seeds, full state) or `official`. */
  mode: string;
  /** Length of a session, s; null for none. */
  session_s: number | null;
  /** Time that each `reset` takes from the session, s. */
  reset_cost_s: number;
  /** Sensor errors of runs that request none; in a competition, of every run. */
  noise: Noise;
  /** Tasks whose runs must have sensing `sensors`. */
  sensors_only: string[];
  /** Whether the seed of a run draws the numbers of its hand that are known as ranges. */
  hand_spread: boolean;
  /** Whose scene run `k` of a task has, in a competition: one for all teams, or every team's own. */
  scenes: Scenes;
  server: ServerInfo;
  limits: Limits;
  tasks: string[];
  hands: string[];
  /** The worlds as of now. */
  worlds: Worlds;
  /** Public keys that signed earlier replays; left out if there are none. */
  earlier_replay_keys?: string[];
  /** Begin of the pause of all sessions, ms since 1970 UTC; only while they are paused. */
  paused_unix_ms?: number;
  /** Its phase; official competitions only. */
  phase?: CompetitionPhase;
  /** Places for worlds; official competitions only. */
  places?: Places;
  /** Public key of the signatures on replays. */
  replay_key?: string;
  /** The time slots; only with a schedule. */
  schedule?: ScheduleSummary;
  /** The secret, after it was revealed. */
  seed_secret?: string;
  /** SHA-256 of the secret from which the seeds are derived. */
  seed_secret_sha256?: string;
  /** Number of sessions of a team. */
  sessions_per_team?: number;
  /** Runs that wait for their verification; official competitions only. */
  verification?: VerificationNow;
}

/** A touching contact. */
export interface Contact {
  /** Id of the first body: those of the scene, then the hand's links. */
  a: number;
  /** Id of the second body. */
  b: number;
  /** Place in the world, m. */
  position: [number, number, number];
  /** Force on `b`, N. */
  force: [number, number, number];
  /** Used part of its friction, |f_t| / (μ f_n): at 1 it slips. */
  use: number;
}

/** Touching contacts, in every list one entry for each: force on body `b` by body `a`, world frame. */
export interface Contacts {
  /** Name of the first body. */
  a: string[];
  /** Name of the second body. */
  b: string[];
  /** m */
  position: [number, number, number][];
  /** N */
  force: [number, number, number][];
}

/** A message from the server. */
export type ControlReply =
  | ({ op: 'welcome' } & Welcome)
  | ({ op: 'obs' } & Obs)
  | ({ op: 'ack' } & Ack)
  | ({ op: 'result' } & RunResult)
  | ({ op: 'time' } & TimeReport)
  | ({ op: 'error' } & ErrorReply)
  | ({ op: 'warning' } & Warning);

/** An independent coordinate. */
export interface CoordinateDescription {
  /** Name. */
  name: string;
  /** Lower limit, rad or m; absent if unlimited. */
  minimum: number | null;
  /** Upper limit. */
  maximum: number | null;
  /** E, N·m/rad. */
  stiffness: number;
  /** D, N·m·s/rad. */
  damping: number;
  /** Rest position of its spring. */
  rest: number;
  /** Largest torque of its dry friction, N·m, or force, N. */
  friction?: number;
}

/** A cylinder along z. */
export interface CylinderPrimitive {
  pose: FoxglovePose;
  /** Diameters along x and y, and length along z, m. */
  size: Vector3;
  /** Diameter of the lower end, relative to `size`. */
  bottom_scale: number;
  /** Diameter of the upper end, relative to `size`. */
  top_scale: number;
  color: Color;
}

/** A part of a tendon whose moment arm depends on a coordinate. */
export type ElementDescription =
  | { coordinate: string; kind: 'da_vinci'; r0: number; r1: number; r2: number; a1: number; b1: number; l1: number; a2: number; b2: number }
  | { coordinate: string; kind: 'polynomial'; coefficients: number[] }
  | { coordinate: string; kind: 'table'; at: number[]; length: number[] }
  | { coordinate: string; kind: 'eyelets'; before: [number, number]; after: [number, number] };

/** `ended`: the run is over. The next one of the session is shown when it opens. */
export interface Ended {
  /** The run. */
  run_id: string;
  /** Its outcome; null when the world failed. */
  outcome: Final | null;
  /** Reason why the world failed; absent when it did not. */
  fault?: Fault;
}

/** The limits between which a hand that rubs comes to rest. */
export interface EquilibriumBand {
  /** Joint coordinates where it comes to rest while it closes, rad or m. */
  closing: number[];
  /** The same while it opens. */
  opening: number[];
}

/** Pose of the base in the world frame. */
export interface EquilibriumBase {
  /** m */
  position: [number, number, number];
  /** Unit quaternion. */
  quat_xyzw: [number, number, number, number];
}

/** A point of a link that is held in place. */
export interface EquilibriumContact {
  /** Name of the link. */
  link: string;
  /** The point, in the link frame, m. */
  point: [number, number, number];
  /** Its place in the world frame, m. */
  position: [number, number, number];
}

/** A force on a link. */
export interface EquilibriumForce {
  /** Name of the link. */
  link: string;
  /** Point of action in the link frame, m. */
  point: [number, number, number];
  /** The force in the world frame, N; at most 200. */
  force: [number, number, number];
}

/** The reaction at a held point. */
export interface EquilibriumReaction {
  /** Force on the link in the world frame, N; at most 100. */
  force: [number, number, number];
  /** Distance of the point from its place, m: 0.01 mm for each N, and more where it cannot reach its place. */
  gap: number;
}

/** The loads on the hand. */
export interface EquilibriumRequest {
  /** Command σ of every motor, 0 to 1. */
  motors: number[];
  /** Pose of the base; at the origin if left out. */
  base?: EquilibriumBase;
  /** Points that are held in place; at most 32. */
  contacts?: EquilibriumContact[];
  /** Forces with constant direction; at most 32. */
  forces?: EquilibriumForce[];
}

/** The equilibrium. */
export interface EquilibriumResponse {
  /** Joint coordinates, rad or m. */
  q: number[];
  /** Tension of every tendon, in its own unit. */
  tension: number[];
  /** `closed_form` or `newton`. */
  law: string;
  /** Reason why the closed form does not hold: joints at limits, slack tendons, varying moment arms, held points. Empty where it holds. */
  beyond_closed_form: string[];
  /** Pose of every link in the world frame. */
  links: LinkPose[];
  /** Reaction at each of `contacts`. */
  reactions: EquilibriumReaction[];
  /** Torque of forces, contacts and weight on each joint coordinate, N·m or N. */
  torque: number[];
  /** For a hand that rubs, without contacts: the limits between which it rests. All else in the answer is without friction. */
  band?: EquilibriumBand;
}

/** `error`: why a request failed. A request that fails changes nothing. */
export interface ErrorReply {
  /** The kind of the error, for programs. */
  code: Code;
  /** The problem, and the valid values. */
  message: string;
  /** Whether the connection closes after this error. */
  fatal: boolean;
  /** The fault of the run's world, if it is the reason; otherwise absent. */
  fault?: Fault;
  /** The id of the request; absent if it could not be read. */
  id?: number;
  /** Time after which to try again, s. */
  retry_after_s?: number;
}

/** An event of the referee. */
export interface Event {
  /** Time of the event, ticks. */
  tick: number;
  /** Kind of the event: section 4 of docs/tasks.md lists them. */
  kind: string;
  /** Index of the object: with sensing `truth`, and in a run's result. */
  object?: number;
}

/** `events`: events of the referee. */
export interface Events {
  /** The run. */
  run_id: string;
  /** Events in order of time. */
  events: Event[];
}

/** Reason why a world cannot continue. From then on it does not move. The wire, the log and Python take code and wording of a fault from here. A new kind goes to the end, so that the bytes of snapshots do not change. */
export type Fault = 'not_finite' | 'out_of_bounds' | 'unsolvable' | 'work_exhausted' | 'crashed';

/** One field. */
export interface Field {
  /** Path; `[]` stands for every entry of a list. */
  name: string;
  /** Lengths; empty for a single number. */
  shape: Length[];
  /** Unit; empty for a pure number. */
  unit: string;
  /** Least value of an entry; null for none. Commands beyond are clipped. */
  minimum: number | null;
  /** Largest value of an entry; null for none. */
  maximum: number | null;
}

/** A figure of a hand with those of other hands. */
export interface FigureRow {
  /** Name of the figure, also as a field of `[hand_limits]`. */
  figure: string;
  /** Unit of the figure; empty for a count or a ratio. */
  unit: string;
  /** Description of the figure. */
  what: string;
  /** Value of the hand; absent if it has nothing of the kind. */
  value: number | null;
  /** File and element that it was found in. */
  place: string | null;
  /** Values of the built-in hands, by their names. */
  others: Record<string, number>;
  /** The competition's limit; absent if there is none. */
  limit: number | null;
  /** `most` or `least`. */
  bound: string;
  /** Whether the limit allows the value. */
  allowed: boolean;
  /** Whether the value is beyond those of all built-in hands. */
  beyond_others: boolean;
}

/** The outcome of a run. */
export interface Final {
  /** Points. */
  score: number;
  /** Objects in the goal; where the scene has goals, goals reached. */
  in_goal: number;
  /** Objects outside. */
  outside: number;
  /** Reason why it ended. */
  reason: Reason;
  /** Ticks played. */
  ticks: number;
  /** s of simulated time played. */
  sim_time_s: number;
}

/** Load of a finger. */
export interface FingerWrench {
  /** Name of the finger's first link. */
  name: string;
  /** Sum of the forces of all contacts on its links, world frame, N. */
  force: [number, number, number];
  /** Their torque about the origin of the hand's base, world frame, N·m. */
  torque: [number, number, number];
}

/** The shape of a part. */
export type Form =
  | Shape
  | VisualMesh;

/** The pose of a shape in the frame of its entity. */
export interface FoxglovePose {
  /** Position, m. */
  position: Vector3;
  /** Orientation. */
  orientation: Quaternion;
}

/** A time, or a duration. */
export interface FoxgloveTime {
  sec: number;
  nsec: number;
}

/** A goal of a task with its points and tolerances. All given conditions hold at the same time, for `for_s`. */
export interface GoalInfo {
  /** Its name, mostly the kind of its event. */
  name: string;
  /** Points; less than 0 is a penalty. */
  points: number;
  /** Time for which the conditions hold without a break, s. */
  for_s: number;
  /** Least rise of the point above its height at tick 0, m. */
  above_m?: number;
  /** Least distance of the object's centre of mass from the hand's base, m. */
  hand_off_m?: number;
  /** The region that contains the point. */
  inside?: string;
  /** Where the points shrink in proportion to a measured quantity: `slip` from 0 to `slip_m`, `time` from 0 to `slow_s`. */
  less_by?: string;
  /** The object; absent where the goal holds for each object. */
  object?: string;
  /** The regions of which none contains the point. */
  outside?: string[];
  /** The measured point in the object's frame, m; absent: its centre of mass. */
  point?: [number, number, number];
  /** The object's speed is below this, m/s. */
  rest_m_s?: number;
  /** The object moves by less than this in the frame of the hand's base, m. */
  slip_m?: number;
  /** Simulated time from which on the points are 0, s. */
  slow_s?: number;
  /** Largest angle of the object's z from the vertical, degrees. */
  upright_deg?: number;
  /** The box in another object's frame that contains the point. */
  within?: Within;
}

/** A guide on which a tendon rubs. */
export interface GuideDescription {
  /** Name of the coordinate at which it is. */
  coordinate: string;
  /** Coefficient of friction μ. */
  friction: number;
  /** Angle φ by which the tendon wraps around it, rad. */
  wrap_angle: number;
}

/** A decision on a hand. */
export interface HandActionRequest {
  hand_id: string;
  /** The reason, for the team and the audit; `reject` requires it. */
  reason?: string;
}

/** The hand after the decision. */
export interface HandActionResponse {
  hand: HandRow;
}

/** A hand without solver details. Units are SI; poses are those at rest. */
export interface HandDescription {
  /** Identifier. */
  name: string;
  /** One sentence for display. */
  description: string;
  /** Mass of all links, kg. */
  mass: number;
  /** Rigid bodies; the base first, parents before children. */
  links: LinkDescription[];
  /** Independent joint coordinates q, in the order of every vector of joints. */
  coordinates: CoordinateDescription[];
  /** Motors, in the order of the action's `hand` field. */
  motors: MotorDescription[];
  /** Tendons. */
  tendons: TendonDescription[];
  /** The fingers, by the names of their first links: the order of `telemetry.fingers`. */
  fingers: string[];
  /** Tactile patches. */
  tactile: PatchDescription[];
  /** Properties of its sensors, and its optional sensors. */
  sensors: Sensors;
  /** Whether the hand's own weight is cancelled. */
  gravity_compensation: boolean;
  /** Shape, unit and range of the hand's part of an action and of an observation. */
  specs: SpecDescription[];
  /** Pins that close chains of links. */
  linkages?: LinkageDescription[];
  /** Springs across several joints. */
  springs?: SpringDescription[];
  /** How a run begins, if a motor is not at 0 then or a joint not where its spring rests. */
  start?: StartDescription;
  /** Its numbers that are known as ranges. */
  uncertain?: UncertainDescription[];
}

/** Names of a hand's parts; `GET /v1/hands/{name}` returns its geometry. */
export interface HandInfo {
  /** Its name in `reset`. */
  name: string;
  /** Text for people. */
  description: string;
  /** Names of the motors, in the order of `action.hand`. */
  motors: string[];
  /** Names of the joint coordinates, in the order of `truth.joints`. */
  joints: string[];
  /** Names of the joints that have an encoder, in the order of `hand.joints`. */
  encoders: string[];
  /** Names of the taxels, in the order of `hand.touch`. */
  taxels: string[];
  /** The channels of `obs.hand` with this hand. */
  channels: ChannelInfo[];
  /** Its cameras. */
  cameras: CameraInfo[];
}

/** What the hand's own sensors read. */
export interface HandObservation {
  /** Pose and velocity of the base in the world frame, by the arm's encoders. */
  base: BodyState;
  /** Command, position, velocity and tension of every motor, by its encoder and its current. */
  actuators: ActuatorObservation[];
  /** Force and torque between arm and hand in the world frame, torque about the base's origin. */
  wrist: Wrench;
  /** Acceleration minus gravity in the frame of the accelerometer's link, m/s²; absent when the hand has none. */
  acceleration?: [number, number, number];
  /** Joint encoders, in the order of `welcome.hands[].encoders`, rad; absent when the hand has none. */
  joints?: number[];
  /** Force on every taxel along x and y of its patch and into the patch, in the order of `welcome.hands[].taxels`, N; absent when the hand has none. */
  touch?: [number, number, number][];
}

/** A quantity of a hand that can be uncertain. */
export type HandQuantity = 'friction' | 'stiffness' | 'damping' | 'moment_arms' | 'force_limit' | 'speed_limit' | 'tendon_stiffness' | 'tendon_friction';

/** A hand as stored. */
export interface HandRow {
  /** Its id. */
  hand_id: string;
  /** Its team. */
  team: string;
  /** Its name, as in `reset`. */
  name: string;
  /** SHA-256 of the archive, hexadecimal. */
  sha256: string;
  /** Size of the archive, bytes. */
  bytes: number;
  /** `pending`, `approved` or `rejected`. */
  status: string;
  /** The organizer's reason for the decision. */
  note: string | null;
  /** Warnings of the check. */
  warnings: string[];
  /** Time of the upload, ms since 1970 UTC. */
  created_unix_ms: number;
  /** Time of the organizer's decision, ms since 1970 UTC. */
  decided_unix_ms: number | null;
}

export interface Hands {
  /** Hands that can be played, as in `welcome`, including the team's own. */
  hands: HandInfo[];
  /** All hands that the team has uploaded, with their status; only for the team. */
  own?: HandRow[];
}

/** The state at a tick. */
export interface HashMessage {
  /** Ticks since reset. */
  tick: number;
  /** Digest of every bit of the state, 16 hexadecimal digits. */
  state: string;
  /** Hash chain before this message, 64 hexadecimal digits. */
  chain: string;
}

/** `hello`: the first request on every connection. */
export interface Hello {
  /** The client program. In practice its name is the team's name on the leaderboard. */
  client: ClientInfo;
  /** From an earlier `welcome`: resumes that session, within 30 s of the loss of its connection. */
  resume_token?: string;
  /** Practice only: length of the session, s; without it, a practice session has no limit. */
  session_s?: number;
}

/** An elementary motion `x = ratio · q + offset` about or along an axis. */
export interface HingeDescription {
  /** `revolute` or `prismatic`. */
  kind: string;
  /** Frame of the hinge at x = 0 in the frame before it. */
  origin: PoseDescription;
  /** Unit axis in that frame. */
  axis: [number, number, number];
  /** dx/dq */
  ratio: number;
  /** rad or m */
  offset: number;
}

/** An image of a camera, as clients learn it. */
export interface ImageInfo {
  /** Its field in `obs.cameras[]`, and `NAME` in the request `camera.NAME`. */
  name: string;
  /** Shape of the array: rows, pixels in a row, and the numbers of a pixel if it has several. */
  shape: number[];
  /** Unit; empty for a pure number. */
  unit: string;
  /** Least value. */
  minimum: number;
  /** Largest value. */
  maximum: number;
  /** Only with sensing `truth`. */
  truth: boolean;
  /** For people. */
  description: string;
}

/** A new token, shown once. */
export interface IssuedToken {
  /** Its id, by which it is revoked. */
  token_id: string;
  /** The whole token. */
  token: string;
  /** `organizer` or `viewer`, for other tokens. */
  role?: string;
  /** Its team, for a team's token. */
  team?: string;
}

/** Encoders of joints. */
export interface JointEncoders {
  /** Coordinates with an encoder, in the order of the readings. */
  on: string[];
  /** Resolution, rad. */
  resolution: number;
  /** Standard deviation of the constant error of each, rad. */
  bias: number;
  /** Standard deviation of the noise, rad. */
  noise: number;
}

/** Joint coordinates. */
export interface Joints {
  /** rad */
  position: number[];
  /** rad/s */
  velocity: number[];
}

/** A remark on an entity; none is written. */
export interface KeyValuePair {
  key: string;
  value: string;
}

/** The ranking. */
export interface Leaderboard {
  tasks: string[];
  rows: LeaderboardRow[];
  unix_ms: number;
}

/** A team's row in the ranking. */
export interface LeaderboardRow {
  /** From 1. */
  rank: number;
  /** The team. */
  team: string;
  /** Sum of the best scores. */
  total: number;
  /** Finished runs. */
  runs: number;
  /** When the total was reached: the end of the last run in it, ms since 1970 UTC. */
  reached_unix_ms: number;
  /** Whether no run of the team had the true state. */
  sensors_only: boolean;
  /** Its rank among the teams with `sensors_only`. */
  sensors_rank: number | null;
  /** Best run of each task. */
  tasks: Record<string, TaskBest>;
}

/** A length that is fixed, or that of the hand or scene. */
export type Length =
  | number
  | string;

/** Limits of requests and connections; those of actions are in `specs`. */
export interface Limits {
  /** Largest message of a client, bytes. */
  message_bytes: number;
  /** Largest `repeat` of a `step`. */
  repeat: number;
  /** Largest rate of requests of a connection, 1/s. */
  requests_per_s: number;
  /** Requests that a connection may send at once above that rate. */
  requests_burst: number;
  /** Time that a session without a connection waits for its client, s. */
  resume_grace_s: number;
  /** Period of the server's pings, s. */
  ping_interval_s: number;
  /** A connection that is silent, or does not read a message, for this long is closed, s. */
  ping_timeout_s: number;
  /** Largest time between the opening of a connection and `hello`, s. */
  hello_timeout_s: number;
  /** Realtime: after this number of ticks without an action, the hand holds still. */
  hold_ticks: number;
  /** Realtime: largest number of unread observations; the server drops the oldest of more. */
  outbox_obs: number;
}

/** A rigid body. */
export interface LinkDescription {
  /** Name. */
  name: string;
  /** Name of the parent link; absent for the base. */
  parent: string | null;
  /** Name of the coordinate that moves it. */
  coordinate: string | null;
  /** Its hinges from the parent outwards: one, or two for a rolling joint. */
  hinges: HingeDescription[];
  /** kg */
  mass: number;
  /** Centre of mass in the link frame, m. */
  com: [number, number, number];
  /** Pose in the base frame when the hand is at rest. */
  base_from_link_at_rest: PoseDescription;
  /** Collision shapes. */
  shapes: PlacedShape[];
}

/** Pose of a link. */
export interface LinkPose {
  /** Its name. */
  name: string;
  /** m */
  position: [number, number, number];
  /** Unit quaternion. */
  quat_xyzw: [number, number, number, number];
}

/** A pin that closes a chain of links. */
export interface LinkageDescription {
  /** Name. */
  name: string;
  /** Names of the two links. */
  links: [string, string];
  /** The pin in the frame of each link, m. */
  points: [[number, number, number], [number, number, number]];
  /** Stiffness, N/m. */
  stiffness: number;
  /** Damping, N·s/m. */
  damping: number;
}

/** `list`: lists the open runs. */
export type List = Record<string, never>;

/** A condition with its measured value. */
export interface Measured {
  /** Name of the condition: section 4 of docs/tasks.md lists them. */
  rule: string;
  /** Whether the condition holds. */
  holds: boolean;
  /** The measured value; absent before the first measurement. */
  value: number | null;
  /** The limit of the value. */
  limit: number;
  /** Unit of value and limit. */
  unit: string;
}

/** Pace of the world of a run. */
export type Mode = 'lockstep' | 'realtime';

/** State of a motor. */
export interface Motor {
  /** Commanded σ. */
  command: number;
  /** σ the motor has reached. */
  position: number;
  /** Tension of its tendons, in the tendon's unit (hand.toml); negative where a drive pushes. */
  tension: number;
  /** Work on its tendons since reset, ∫ f ds, J. */
  work: number;
}

/** A motor. */
export interface MotorDescription {
  /** Name. */
  name: string;
  /** `s_ref = scaling · (σ − offset)`. */
  scaling: number;
  /** σ at which `s_ref` is 0. */
  offset: number;
  /** Largest |dσ/dt|, 1/s. */
  speed_limit: number;
  /** Largest mechanical power, W. */
  power_limit?: number;
  /** Load at which it stands still, in the tendon's unit; the speed falls linearly with the load. */
  stall_force?: number;
}

/** The encoder of a motor, and its estimate of tension from the motor's current. */
export interface MotorSensor {
  /** Resolution of the position, in σ. */
  resolution: number;
  /** Standard deviation of its constant error, in σ. */
  bias: number;
  /** Standard deviation of the tension's noise, as a part of the tendon's largest force. */
  tension_noise: number;
  /** Standard deviation of the tension's constant error of scale. */
  tension_gain: number;
}

/** An announcement, and the reason for it. */
export interface NewAnnouncement {
  /** At most 500 characters; an empty text withdraws the one before. */
  text: string;
  /** The reason, for the audit. */
  reason?: string;
}

/** A team to add. */
export interface NewTeam {
  team: string;
  /** Label of its token. */
  label?: string;
}

/** A new token of an organizer or a viewer. */
export interface NewToken {
  /** `organizer` or `viewer`. */
  role: string;
  /** Its holder, for people. */
  label?: string;
  /** The reason, for the audit. */
  reason?: string;
}

/** Errors of the sensors. */
export type Noise = 'none' | 'real';

/** Pose and velocity of the free objects in the world frame: in every table one row for each. */
export interface Objects {
  /** Origin of the body frame, m. */
  position: [number, number, number][];
  /** Orientation, x, y, z, w. */
  quat_xyzw: [number, number, number, number][];
  /** Velocity of the origin, m/s. */
  linear: [number, number, number][];
  /** rad/s */
  angular: [number, number, number][];
}

/** `obs`: the state after `reset` or `step`, or after a tick of a realtime run. */
export interface Obs {
  /** Identifies the run. */
  run_id: string;
  /** s; null for a session without a limit. */
  session_left_s: number | null;
  /** Ticks since reset. */
  tick: number;
  /** s since reset. */
  sim_time_s: number;
  /** The action as applied: clipped to the spec, with omitted fields filled in. */
  applied_action: Action;
  /** The hand. */
  hand: HandObservation;
  /** Events of this tick. */
  events: Event[];
  /** Score if the run ended now, without the settling rule. */
  score: number;
  /** The task is complete: nothing more can be gained. */
  terminated: boolean;
  /** The run was cut short by a limit. */
  truncated: boolean;
  /** The arm that carries the hand, where the task has one. */
  arm?: ArmReading;
  /** Images of the requested cameras. */
  cameras?: CameraImage[];
  /** Id of the request; absent if the observation was streamed. */
  id?: number;
  /** In a realtime run: how long after the tick was due this was sent, s. */
  late_s?: number;
  /** The reason, when `terminated` or `truncated`. */
  reason?: string;
  /** The run has gone back: another host continues it, and this is the first observation. */
  resumed?: boolean;
  /** Inputs of the run; only in the reply to `reset`. */
  run?: Opened;
  /** Contents of the world; only in the reply to `reset`. */
  scene?: Scene;
  /** The full state, when the run's sensing is `truth`. */
  truth?: Truth;
}

/** Inputs of the run. */
export interface Opened {
  /** Name of the task. */
  task: string;
  /** Name of the hand. */
  hand: string;
  /** Pace of the run. */
  mode: Mode;
  /** `sensors` or `truth`. */
  sensing: Sensing;
  /** `none` or `real`. */
  noise: Noise;
  /** In practice: what `reset` takes to build this scene again. */
  seed: number | null;
  /** Length of a tick, s. */
  tick_s: number;
  /** Longest run, s of simulated time. */
  time_limit_s: number;
}

/** Data that can be sent in addition to the poses. */
export type Overlay = 'telemetry' | 'contacts' | 'verdicts';

/** A run of a pair. */
export interface PairedRun {
  /** Its id. */
  run_id: string;
  /** Its team. */
  team: string;
  /** As in `GET /v1/runs/{id}`. */
  status: string;
  /** Its score. */
  score: number | null;
  /** Time of its begin, ms since 1970 UTC. */
  started_unix_ms: number;
}

/** A tactile patch: a rectangle on a link, in the xy-plane of its frame, z outwards. */
export interface PatchDescription {
  /** Name. */
  name: string;
  /** Name of its link. */
  link: string;
  /** m */
  position: [number, number, number];
  /** Unit quaternion. */
  quat_xyzw: [number, number, number, number];
  /** Extents along x and y, m. */
  size: [number, number];
  /** Taxels along x and y, which divide it. */
  taxels: [number, number];
}

/** `perturb`: applies a wrench to a link of the hand, from the next tick on. Practice only. */
export interface Perturb {
  /** Name of a link of the hand. */
  link: string;
  /** World frame. The force acts at the origin of the link, and the torque is about it. */
  wrench: PushWrench;
  /** Duration, s of simulated time. */
  duration_s: number;
}

/** A shape fixed to a link. */
export interface PlacedShape {
  /** m */
  position: [number, number, number];
  /** Unit quaternion. */
  quat_xyzw: [number, number, number, number];
  /** The shape. */
  shape: Shape;
  /** Coulomb friction coefficient. */
  friction: number;
}

/** Places for worlds, as counts and a forecast. */
export interface Places {
  /** Number of worlds that can be open at once. */
  total: number;
  /** Number of open sessions whose clock has started and has time left, without those that wait for a place. */
  playing: number;
  /** Longest time until a place is free for the next team, s: 0 if one is free, null if nothing bounds it. */
  free_within_s: number | null;
}

/** A position and an orientation. */
export interface PoseDescription {
  /** m */
  position: [number, number, number];
  /** Unit quaternion. */
  quat_xyzw: [number, number, number, number];
}

/** `poses`: poses of all moving bodies. */
export interface Poses {
  /** The run. */
  run_id: string;
  /** Ticks since reset. */
  tick: number;
  /** s since reset. */
  sim_time_s: number;
  /** For every body of `scene.moving`: position x, y, z in m, orientation x, y, z, w. In single precision. */
  poses: [number, number, number, number, number, number, number][];
  /** Every touching contact, for viewers with the overlay `contacts`. */
  contacts?: Contact[];
  /** Internal state of the hand, for viewers with the overlay `telemetry`. */
  telemetry?: Telemetry;
}

/** A box, or an ellipsoid. */
export interface Primitive {
  pose: FoxglovePose;
  /** Extents of the box, or diameters of the ellipsoid, m. */
  size: Vector3;
  color: Color;
}

/** An error, RFC 9457. */
export interface Problem {
  /** Always `about:blank`: the codes have no pages of their own. */
  type: string;
  title: string;
  status: number;
  detail: string;
  code: Code;
  retry_after_s?: number;
}

/** An external wrench on a link. */
export interface PushMessage {
  /** Name of the link. */
  link: string;
  /** World frame. */
  wrench: Wrench;
  /** Duration, s. */
  duration_s: number;
}

/** Force and torque. */
export interface PushWrench {
  /** N */
  force: [number, number, number];
  /** N·m */
  torque?: [number, number, number];
}

/** A unit quaternion. */
export interface Quaternion {
  x: number;
  y: number;
  z: number;
  w: number;
}

/** `leaderboard`: the ranking. */
export interface Ranking {
  /** Best first. */
  rows: LeaderboardRow[];
}

/** Reason of the end of a run. */
export type Reason = 'stopped' | 'complete' | 'session_over' | 'disconnected' | 'time_limit' | 'world_fault' | 'voided';

/** An axis-aligned region that the rules refer to, such as the inside of `box_b`. */
export interface Region {
  /** Name, such as `box_b`. */
  name: string;
  /** Lower corner, m. */
  min: [number, number, number];
  /** Upper corner, m. */
  max: [number, number, number];
  /** Role in the rules: `start` or `goal`; absent for others. */
  role?: string;
}

/** The replay of a run: `GET /v1/runs/{id}/replay`. */
export interface ReplayInfo {
  /** SHA-256 of the file, 64 hexadecimal digits. */
  sha256: string;
  /** Size of the file. */
  bytes: number;
}

/** `reset`: opens a run at tick 0. */
export interface Reset {
  /** Name of a task, see `welcome.tasks`. */
  task: string;
  /** Name of a hand, see `welcome.hands`. */
  hand: string;
  /** Cameras whose images the observation of tick 0 has; see `step`. */
  cameras?: string[];
  /** Pace of the world. */
  mode?: Mode;
  /** The errors of the sensors; without it, those of `welcome.competition`, which a competition prescribes. */
  noise?: Noise;
  /** No options are defined; empty. */
  options?: Record<string, unknown>;
  /** Practice only: number of the scene, 0 to 2⁵³ − 1; without it, the server draws one. */
  seed?: number;
  /** Part of the state that the observations have. */
  sensing?: Sensing;
}

/** The revoked tokens. */
export interface RevokedTokens {
  /** Number of revoked tokens. */
  revoked: number;
  /** The team, if its tokens were revoked. */
  team?: string;
  /** The token, if one was revoked. */
  token_id?: string;
}

/** An action on a run. */
export interface RunActionRequest {
  run_id: string;
  /** The reason, for the audit; `void` and `unvoid` require it. */
  reason?: string;
}

/** The run after the action, and its session, which may have a refund. */
export interface RunActionResponse {
  run: RunRecord;
  session: Session | null;
}

/** The session's open run. */
export interface RunInfo {
  /** Identifies the run. */
  run_id: string;
  /** Its task. */
  task: string;
  /** Its hand. */
  hand: string;
  /** Pace of its world. */
  mode: Mode;
  /** The current tick, which the next `step` must name. */
  tick: number;
  /** False if the server closed it (time limit, end of the session): `stop` returns the result. */
  open: boolean;
}

/** Runs, newest first. */
export interface RunList {
  runs: RunRecord[];
  /** Whether there are more, which `limit` left out. */
  more: boolean;
}

/** A run, as in `GET /v1/runs/{id}`. */
export interface RunRecord {
  /** Its id. */
  run_id: string;
  /** Its team. */
  team: string;
  task: string;
  /** Hand. */
  hand: string;
  mode: string;
  sensing: string;
  /** `open`, `practice`, `provisional`, `verified`, `rejected`, `aborted` or `voided`. */
  status: string;
  reason: string | null;
  note: string | null;
  score: number | null;
  in_goal: number | null;
  outside: number | null;
  ticks: number | null;
  sim_time_s: number | null;
  missed_ticks: number;
  state_hash: string | null;
  /** In practice, the number with which `reset` builds the scene again. */
  seed: number | null;
  /** The seed; null while it is hidden. */
  seed_hex: string | null;
  started_unix_ms: number;
  ended_unix_ms: number | null;
  server_version: string;
  build_hash: string;
  /** Events of the referee. */
  events?: Event[];
  /** Number of the run among the team's runs of this task; official runs only. */
  k?: number;
  replay_sha256?: string;
  /** Its session; left out where the client may not know it. */
  session_id?: string;
  /** Other teams' runs with the same movements over a long stretch; for organizers only, left out if there are none. */
  similar?: SimilarRun[];
  verified_unix_ms?: number;
  /** The host that verifies it now; left out if none does, and where there is one server only. For organizers only. */
  verify_host?: string;
  verify_note?: string;
  /** Why the last try gave no verdict; for organizers only. */
  verify_problem?: string;
  /** Since when it waits, ms since 1970 UTC. */
  verify_since_unix_ms?: number;
  /** `waiting` for its verification, also for another one after a verdict, or `stuck`: three tries or more were without a verdict, or the run is of another engine. Left out otherwise. */
  verify_state?: string;
  /** Number of tries without a verdict, the present one included; only while it waits. For organizers only. */
  verify_tries?: number;
}

/** `result`: the outcome of a finished run. The server has stored it before it sends it. */
export interface RunResult {
  /** Identifies the run. */
  run_id: string;
  /** Its task. */
  task: string;
  /** SHA-256 of the whole task, 64 hexadecimal digits. */
  task_hash: string;
  /** Its hand. */
  hand: string;
  /** Pace of its world. */
  mode: Mode;
  /** `practice`; `training` for a run with training options; in a competition `provisional`; `aborted` if it ended at tick 0; `voided` after a fault of the server or by a decision of the organizer. */
  status: string;
  /** Points. */
  score: number;
  /** Objects in the goal; where objects are arranged, goals reached. */
  in_goal: number;
  /** Objects outside both boxes. */
  outside: number;
  /** Reason why the run ended. */
  reason: Reason;
  /** Number of ticks. */
  ticks: number;
  /** Simulated time, s. */
  sim_time_s: number;
  /** Realtime: ticks without a new action. */
  missed_ticks: number;
  /** Realtime: ticks that the server began more than half a tick after they were due. */
  late_ticks: number;
  /** Realtime: longest such delay, s. */
  late_max_s: number;
  /** Realtime: observations that the server dropped because the client did not read them in time. */
  dropped_obs: number;
  /** Hash of the final state, 16 hexadecimal digits. */
  state_hash: string;
  /** All events of the referee. */
  events: Event[];
  /** Remaining time, s; null for a session without a limit. */
  session_left_s: number | null;
  /** The fault of its world; absent if there was none. */
  fault?: Fault;
  /** The id of the request; absent if the server closed the run. */
  id?: number;
  /** Meaning of the fault and advice, for display; absent without a fault. */
  note?: string;
  /** Its replay; absent if the run was not recorded. */
  replay?: ReplayInfo;
}

/** `runs`: the runs that can be watched now. */
export interface Runs {
  /** Id of the request. */
  id: number;
  /** Open runs. */
  runs: WatchRun[];
}

/** The world at tick 0, in the reply to `reset`. */
export interface Scene {
  /** All bodies: free ones first, in the order of `truth.objects`. */
  bodies: SceneBody[];
  /** Regions that the rules refer to. */
  regions: Region[];
  /** Gravity, m/s². */
  gravity: [number, number, number];
  /** Goals of the task with their points and tolerances, in the order in which they are reached. */
  goals: GoalInfo[];
}

/** A body and its shapes, in the world frame at tick 0. */
export interface SceneBody {
  /** Index in the scene. */
  id: number;
  /** Unique name, such as `ball_3` or `box_a`. */
  name: string;
  /** False for furniture. */
  free: boolean;
  /** Mass, kg; 0 for furniture. */
  mass: number;
  /** Centre of mass in the body frame, m. */
  com: [number, number, number];
  /** Coulomb coefficient between two such surfaces; two bodies have the geometric mean of theirs. */
  friction: number;
  /** Convex parts in the body frame. */
  parts: ScenePart[];
  /** sRGB, 0 to 1. */
  color: [number, number, number];
  /** Infinite horizontal ground: its surface is the top of its only part, a box that is for drawing. */
  endless?: boolean;
  /** Origin, m; absent for free bodies in a run with sensing `sensors`. */
  position?: [number, number, number];
  /** Orientation, x, y, z, w; absent where the position is. */
  quat_xyzw?: [number, number, number, number];
}

/** A body: a link of the hand, an object or furniture. */
export interface SceneEntity {
  timestamp: FoxgloveTime;
  /** The frame that the entity is fixed in. */
  frame_id: string;
  /** Identifies the entity. */
  id: string;
  /** Zero: as long as the file. */
  lifetime: FoxgloveTime;
  /** Whether the entity follows its frame. */
  frame_locked: boolean;
  metadata: KeyValuePair[];
  cubes: Primitive[];
  spheres: Primitive[];
  cylinders: CylinderPrimitive[];
  triangles: TriangleListPrimitive[];
}

/** The removal of an entity; none is written. */
export interface SceneEntityDeletion {
  timestamp: FoxgloveTime;
  type: number;
  id: string;
}

/** A convex part of a body. */
export interface ScenePart {
  /** Origin in the body frame, m. */
  position: [number, number, number];
  /** Orientation, x, y, z, w. */
  quat_xyzw: [number, number, number, number];
  /** Shape, centred on its own frame. */
  shape: Shape;
}

/** The shapes of all bodies. */
export interface SceneUpdate {
  deletions: SceneEntityDeletion[];
  entities: SceneEntity[];
}

/** Whose scene run `k` of a task has, in a competition. */
export type Scenes = 'shared' | 'per_team';

/** The schedule. */
export interface Schedule {
  /** All slots, by begin and team. */
  slots: Slot[];
  /** Number of worlds that can be open at once. */
  places: number;
  /** Problems of the schedule, such as more teams at once than places. */
  warnings: string[];
}

/** A change of the schedule. Times are texts with their offset from UTC, such as `2027-05-04T09:00:00+02:00`. */
export interface ScheduleActionRequest {
  /** For `add` and `move`: the begin. */
  begins_at?: string;
  /** For `move`: moves all slots that have not begun by this time, s. */
  by_s?: number;
  /** For `import`: a CSV file with the columns `team`, `begins_at` and `ends_at`. It replaces the schedule. */
  csv?: string;
  /** For `add`, and for `move` if the length changes: the end. */
  ends_at?: string;
  /** For `move`: the begin of the slot that moves; needed if the team has several. */
  from?: string;
  /** The reason, for the audit. */
  reason?: string;
  /** The team; `clear`, and `move` with `by_s`, concern all teams without it. */
  team?: string;
}

/** The time slots of all teams, as counts. */
export interface ScheduleSummary {
  /** Number of slots. */
  slots: number;
  /** Number of slots that run now. */
  running: number;
  /** Begin of the next slot, ms since 1970 UTC. */
  next_unix_ms: number | null;
  /** End of the last slot, ms since 1970 UTC. */
  ends_unix_ms: number;
}

/** `score`: the run's score if it ended now. */
export interface Score {
  /** The run. */
  run_id: string;
  /** Ticks since reset. */
  tick: number;
  /** Points. */
  score: number;
}

/** Observations that a controller gets. */
export type Sensing = 'sensors' | 'truth';

/** Properties of the sensors of a hand, and its sensors besides those of the motors. The arm that carries it has the sensors of its wrist. */
export interface Sensors {
  /** Sensor of every motor. */
  motors: MotorSensor;
  /** Taxels of its tactile patches. */
  touch: Touch;
  /** Accelerometer; absent if the hand has none. */
  accelerometer?: Accelerometer;
  /** Cameras on the hand. */
  cameras?: Camera[];
  /** Encoders of joints; absent if the hand has none. */
  joints?: JointEncoders;
}

/** The program of the server. */
export interface ServerInfo {
  /** Version. */
  version: string;
  /** Commit it was built from. */
  build_hash: string;
}

/** A session with its current clock. */
export interface Session {
  /** Its id. */
  session_id: string;
  /** Its team. */
  team: string;
  /** `practice` or `official`. */
  mode: string;
  /** `open`, `ended` or `voided`. */
  status: string;
  /** Version of the client, as the client gives it. */
  client_version: string | null;
  /** Its length, s. */
  limit_s: number | null;
  /** Wall-clock time of its clock, without pauses, s. */
  clock_wall_s: number;
  /** Simulated time of its clock, s. */
  clock_simulated_s: number;
  /** Time given back, s. */
  refunded_s: number;
  /** Begin of the current pause, ms since 1970 UTC. */
  paused_unix_ms: number | null;
  /** Number of pauses. */
  pauses: number;
  /** Its begin, ms since 1970 UTC. */
  created_unix_ms: number;
  /** Its end, ms since 1970 UTC. */
  ended_unix_ms: number | null;
  /** Number of its runs. */
  runs: number;
  /** Time spent, the greater of both times, s. */
  elapsed_s: number;
  /** Time left, s; null without a limit. */
  left_s: number | null;
  /** Its place in its host's queue for a world, from 1, while it waits for one. */
  place_in_queue?: number;
}

/** An action on a session. */
export interface SessionActionRequest {
  session_id: string;
  /** The reason, for the audit; `void` and `grant` require it. */
  reason?: string;
  /** For `grant`: additional time, s; at most a day. A negative number takes granted time back. */
  seconds?: number;
}

/** The session after the action. */
export interface SessionActionResponse {
  session: Session;
}

/** Sessions, newest first. */
export interface Sessions {
  sessions: Session[];
}

/** A convex shape centred on its own frame. Lengths in m. The axis of cylinders and capsules is z. */
export type Shape =
  | { type: 'sphere'; radius: number }
  | { type: 'capsule'; radius: number; half_length: number }
  | { type: 'cylinder'; radius: number; half_length: number }
  | { type: 'box'; half_extents: [number, number, number]; rounding: number }
  | { type: 'hull'; points: [number, number, number][]; rounding: number };

/** A hand for the decision. */
export interface ShownHand {
  hand: HandRow;
  /** Its figures, with those of the built-in hands and the competition's limits. */
  figures: FigureRow[];
  /** Overlaps of the hand where it starts, as text. */
  in_the_way: string[];
  /** The full description, for the 3D view. */
  description: HandDescription;
}

/** Two runs with the same movements over a long stretch. */
export interface SimilarPair {
  /** Part of the shorter of both paths that is alike, 0 to 1. */
  share: number;
  /** Root mean square of the distance of both hands on that part, without a constant offset, mm. */
  distance_mm: number;
  /** The constant offset, mm. */
  offset_mm: number;
  /** How much later the second run is at the same place, s. */
  shift_s: number;
  /** Task of both. */
  task: string;
  /** Number of each among its team's runs of the task: both have the same scene. */
  k: number | null;
  /** The run that began first, and the other. */
  runs: [PairedRun, PairedRun];
}

/** Another team's run with the same movements over a long stretch. */
export interface SimilarRun {
  /** The other run. */
  run_id: string;
  /** Its team. */
  team: string;
  /** Its number among the team's runs of the task. */
  k: number | null;
  /** Part of the shorter of both paths that is alike, 0 to 1. */
  share: number;
  /** Root mean square of the distance of both hands on that part, without a constant offset, mm. */
  distance_mm: number;
  /** The constant offset, mm. */
  offset_mm: number;
  /** How much later the other run is at the same place, s. */
  shift_s: number;
}

/** Pairs of similar runs, the greatest share first. */
export interface SimilarRuns {
  pairs: SimilarPair[];
  /** Whether there are more, which `limit` left out. */
  more: boolean;
}

/** A time slot of a team. */
export interface Slot {
  team: string;
  /** Its begin, ms since 1970 UTC. */
  begins_unix_ms: number;
  /** Its end, ms since 1970 UTC. */
  ends_unix_ms: number;
  /** `later`, `now` or `over`. */
  state: string;
}

/** One field of an action or an observation. */
export interface SpecDescription {
  /** Path of the field in the message. */
  name: string;
  /** Length. */
  shape: [number];
  /** Unit. */
  unit: string;
  /** Smallest value of each entry; absent if unbounded. */
  minimum: (number | null)[];
  /** Largest value of each entry. */
  maximum: (number | null)[];
}

/** Every numeric field a controller writes or reads. */
export interface Specs {
  /** Fields of `step.action`. */
  action: Field[];
  /** Fields of `obs`. */
  observation: Field[];
}

/** A spring across several joints. */
export interface SpringDescription {
  /** Name. */
  name: string;
  /** Its row, one entry per coordinate. */
  moment_arms: number[];
  /** Stiffness. */
  stiffness: number;
  /** Damping. */
  damping: number;
  /** Length of the relaxed spring. */
  rest: number;
}

/** How a run begins. */
export interface StartDescription {
  /** σ of every motor. */
  sigma: number[];
  /** Every coordinate, rad or m. */
  joints: number[];
}

/** `step`: advances the world by `repeat` ticks under one action. */
export interface Step {
  /** The current tick: that of the last observation. */
  tick: number;
  /** Targets; an omitted field keeps its last target. */
  action: Action;
  /** Cameras whose images the observation has: `name` for depth, or `name.depth`, `name.rgb`, `name.bodies`. */
  cameras?: string[];
  /** Ticks to advance, 1 to `welcome.limits.repeat`. The step is shorter if the run ends. */
  repeat?: number;
}

/** Errors of a real stereo camera in depth. */
export interface Stereo {
  /** Images per second. */
  rate_hz: number;
  /** Time from the exposure until the image is available, s. */
  latency_s: number;
  /** Distance between the two imagers, m; the second is to the right. */
  baseline: number;
  /** Standard deviation of the disparity, pixels. */
  disparity_noise: number;
  /** Resolution of the disparity, pixels. */
  disparity_step: number;
  /** Angle between surface normal and view beyond which there is no depth, degrees. */
  grazing_deg: number;
  /** Part of the pixels that drop out at random. */
  dropout: number;
}

/** `stop`: lets the objects settle, counts them and closes the run. */
export type Stop = Record<string, never>;

/** The answer to an upload. */
export interface SubmittedHand {
  /** Its id. */
  hand_id: string;
  /** Its team. */
  team: string;
  /** Its name, as in `reset`. */
  name: string;
  /** SHA-256 of the archive, hexadecimal. */
  sha256: string;
  /** Size of the archive, bytes. */
  bytes: number;
  /** `pending`, `approved` or `rejected`. */
  status: string;
  /** The organizer's reason for the decision. */
  note: string | null;
  /** Warnings of the check. */
  warnings: string[];
  /** Time of the upload, ms since 1970 UTC. */
  created_unix_ms: number;
  /** Time of the organizer's decision, ms since 1970 UTC. */
  decided_unix_ms: number | null;
  /** Its figures, with those of the built-in hands and the limits. */
  figures: FigureRow[];
}

/** `subscribe`: the runs to show. Exactly one of `session_id`, `run_id`, `featured`, `leaderboard` is set. A second `subscribe` replaces the first. */
export interface Subscribe {
  /** `true`: the most interesting run: official runs before practice, then runs with an event in the last 10 s, then the one that moved last. When it ends, the next one is chosen. */
  featured?: boolean;
  /** `true`: no run, only the ranking and announcements. */
  leaderboard?: boolean;
  /** Data to send in addition to the poses. With this field, empty or not, `clock` is sent once a second. */
  overlays?: Overlay[];
  /** One run. */
  run_id?: string;
  /** The runs of a session, one after the other. */
  session_id?: string;
}

/** `subscribed`: the run that is shown from now on. */
export interface Subscribed {
  /** Id of the request. */
  id: number;
  /** The run that is shown now; null when none is open. The next one is shown when it opens. */
  run_id: string | null;
}

/** A team's best run of a task. */
export interface TaskBest {
  /** Points. */
  score: number;
  /** The earliest run with this score. */
  run_id: string;
  /** `practice`, `provisional` or `verified`. */
  status: string;
  /** End of the run, ms since 1970 UTC. */
  ended_unix_ms: number;
}

/** Constants of a task. */
export interface TaskInfo {
  /** Its name in `reset`. */
  name: string;
  /** Text for people. */
  description: string;
  /** Length of a tick, s. */
  tick_s: number;
  /** Time step of the integrator, s. */
  step_s: number;
  /** Longest run, s of simulated time. */
  time_limit_s: number;
  /** Its cameras. */
  cameras: CameraInfo[];
  /** SHA-256 of the whole task, 64 hexadecimal digits. */
  hash: string;
  /** Its goals with their points and tolerances, in the order in which they are reached. */
  goals: GoalInfo[];
  /** Joints of the arm that carries the hand, in the order of `base.joints`; empty where the hand flies freely. */
  arm?: ArmJointInfo[];
}

/** The tasks. */
export interface Tasks {
  tasks: TaskInfo[];
}

/** An action on a team. */
export interface TeamActionRequest {
  team: string;
  /** The holder of the new token, for people; for `add` and `rotate`. A new token without one has the label of the last. */
  label?: string;
  /** The reason, for the audit. */
  reason?: string;
}

/** Teams to add. */
export interface TeamCheckRequest {
  teams: NewTeam[];
}

/** The teams in the order of the request. */
export interface TeamCheckResponse {
  teams: CheckedTeam[];
}

/** A team. */
export interface TeamRow {
  /** Its name. */
  team: string;
  /** Time of its creation, ms since 1970 UTC. */
  created_unix_ms: number;
  /** Number of its tokens that are not revoked. */
  live_tokens: number;
  /** Number of its official sessions that are not voided. */
  sessions: number;
}

/** The teams, by name. */
export interface Teams {
  teams: TeamRow[];
}

/** Telemetry of a hand. */
export interface Telemetry {
  /** Every motor, in the hand's order. */
  motors: Motor[];
  /** Tension of every tendon, in the tendon's unit (hand.toml). */
  tension: number[];
  /** The hand's coordinates, rad. */
  q: number[];
  /** Equilibrium of the free hand at the present motor position, rad; empty if it is not defined. */
  predicted: number[];
  /** Load of each finger. */
  fingers: FingerWrench[];
  /** Force on every taxel without the errors of a sensor, N: along x and y of its patch, and into it. */
  touch: [number, number, number][];
  /** Readings without the errors of sensors: the channels that the scene's `readings` lists, one after the other. */
  readings: number[];
}

/** A tendon. */
export interface TendonDescription {
  /** Name. */
  name: string;
  /** Name of the motor that winds it; of several, the first; empty if there is none. */
  motor: string;
  /** Its row of R at rest, one entry per coordinate. */
  moment_arms: number[];
  /** Elements whose moment arm depends on the configuration. */
  elements: ElementDescription[];
  /** Whether it is a drive that pushes as well as pulls. */
  both_ways: boolean;
  /** K */
  stiffness: number;
  /** b */
  damping: number;
  /** f_max */
  force_limit: number;
  /** Whether a clutch lets go at f_max. */
  breakaway?: boolean;
  /** Guides on which it rubs, from the motor outwards. */
  guides?: GuideDescription[];
  /** Largest tension that it holds, if no load turns it back. */
  hold_limit?: number;
  /** Weight of every motor that winds it, if these are not one motor of weight 1. */
  motors?: WeightDescription[];
  /** Wound length without the motors' part. */
  rest?: number;
}

/** `time`: requests the session's clock. */
export type Time = Record<string, never>;

/** `time`: the session's clock. */
export interface TimeReport {
  /** The id of the request. */
  id: number;
  /** Remaining time, s; null for a session without a limit. */
  session_left_s: number | null;
  /** Length of the session, s; null for none. */
  session_s: number | null;
  /** The greater of `wall_s` and `simulated_s`, s. */
  elapsed_s: number;
  /** Wall-clock time since the first reset, without pauses, s. */
  wall_s: number;
  /** Simulated time of all runs, s. */
  simulated_s: number;
  /** Time that was refunded for faults of the server, s; it is not part of the other times. */
  refunded_s: number;
  /** Whether an organizer pauses the session. */
  paused: boolean;
  /** The session's open run, if any. */
  run: RunInfo | null;
  /** The server's clock, ms since 1970 UTC. */
  server_unix_ms: number;
}

/** An action on a token. */
export interface TokenActionRequest {
  token_id: string;
  /** The reason, for the audit. */
  reason?: string;
}

/** A token as stored. */
export interface TokenRow {
  /** Its public id. */
  token_id: string;
  /** `team`, `organizer` or `viewer`. */
  role: string;
  /** Its team, for the role `team`. */
  team: string | null;
  /** Its holder, for people. */
  label: string;
  /** Time of its creation, ms since 1970 UTC. */
  created_unix_ms: number;
  /** Time of its revocation, ms since 1970 UTC. */
  revoked_unix_ms: number | null;
}

/** The tokens, without their secrets. */
export interface Tokens {
  tokens: TokenRow[];
}

/** Properties of a taxel. */
export interface Touch {
  /** Distance by which the pressure below a contact point spreads to each side, m. */
  footprint: number;
  /** Largest distance of a touched point from the patch's plane, m: the bulge of a curved surface. */
  depth: number;
  /** Whether it measures forces along the surface. */
  shear: boolean;
  /** Resolution, N. */
  resolution: number;
  /** Largest force on a taxel, N. */
  saturation: number;
  /** Standard deviation of the noise, N. */
  noise: number;
  /** Readings per second. */
  rate_hz: number;
}

/** Triangles. */
export interface TriangleListPrimitive {
  pose: FoxglovePose;
  /** Corners, m. */
  points: Vector3[];
  color: Color;
  /** The colour of each corner; empty: `color` for all. */
  colors: Color[];
  /** Three indices into `points` for each triangle. */
  indices: number[];
}

/** The full state. */
export interface Truth {
  /** Every free object, in scene order. */
  objects: Objects;
  /** Joint coordinates, in the hand's coordinate order. */
  joints: Joints;
  /** Every touching contact. */
  contacts: Contacts;
  /** Equilibrium of the free hand at the present motor position, rad; empty if it is not defined. */
  predicted_equilibrium: number[];
}

/** A number that is known as a range. */
export interface UncertainDescription {
  /** Name. */
  name: string;
  /** The quantity. */
  of: HandQuantity;
  /** Range of a factor of the hand's own numbers. */
  factor?: [number, number];
  /** Links, joints, motors or tendons that have it; empty if these are all. */
  on?: string[];
  /** Range of the number itself. */
  value?: [number, number];
}

/** A vector, m. */
export interface Vector3 {
  x: number;
  y: number;
  z: number;
}

/** Status of an object under the rules. */
export interface Verdict {
  /** Index of the object, in scene order. */
  object: number;
  /** Whether the object gives points for its place. */
  counts: boolean;
  /** Place or stage of the object: section 4 of docs/tasks.md lists them. */
  place: string;
  /** The conditions that decide. */
  reasons: Measured[];
}

/** `verdicts`: why objects count or do not, at most twice a second when it has changed. */
export interface Verdicts {
  /** The run. */
  run_id: string;
  /** Ticks since reset. */
  tick: number;
  /** In scene order. */
  objects: Verdict[];
}

/** Runs that wait for their verification. */
export interface VerificationNow {
  /** Number of runs that wait, or are being verified. */
  waiting: number;
  /** Number of runs that are stuck: without a verdict after three tries or more, or of another engine. */
  stuck: number;
  /** Since when the oldest one waits, ms since 1970 UTC. */
  oldest_unix_ms?: number;
}

/** Triangles of a part. */
export interface VisualMesh {
  /** `mesh` */
  type: string;
  /** Single-precision numbers, little endian, in base64: x, y, z of the three corners of each triangle, m. */
  triangles: string;
}

/** A visual part of a link. */
export interface VisualPart {
  /** Name of the link. */
  link: string;
  /** Position in the link's frame, m. */
  position: [number, number, number];
  /** Unit quaternion. */
  quat_xyzw: [number, number, number, number];
  shape: Form;
}

/** All visual parts; empty for a hand whose visual shapes are its collision shapes. */
export interface Visuals {
  parts: VisualPart[];
}

/** `warning`: the session's time is running out. It comes when 300, 60 and 10 s are left. */
export interface Warning {
  /** The mark that was passed: 300, 60 or 10 s. */
  mark_s: number;
  /** Remaining time, s. */
  session_left_s: number;
}

/** A body and its shapes. */
export interface WatchBody {
  /** Identifies the body within the run. */
  id: number;
  /** Name for people. */
  name: string;
  /** Its kind. */
  kind: BodyKind;
  /** Position at tick 0, m. */
  position: [number, number, number];
  /** Orientation at tick 0: x, y, z, w. */
  quat_xyzw: [number, number, number, number];
  /** Convex parts in the body frame. */
  parts: ScenePart[];
  /** sRGB, 0 to 1. */
  color: [number, number, number];
}

/** `bye`: ends the connection. */
export type WatchBye = Record<string, never>;

/** A message to a spectator. */
export type WatchReply =
  | ({ op: 'subscribed' } & Subscribed)
  | ({ op: 'runs' } & Runs)
  | ({ op: 'scene' } & WatchScene)
  | ({ op: 'poses' } & Poses)
  | ({ op: 'score' } & Score)
  | ({ op: 'events' } & Events)
  | ({ op: 'ended' } & Ended)
  | ({ op: 'clock' } & Clock)
  | ({ op: 'verdicts' } & Verdicts)
  | ({ op: 'leaderboard' } & Ranking)
  | ({ op: 'announcement' } & Announcement)
  | ({ op: 'error' } & ErrorReply);

/** An open run, without what spectators must not know. */
export interface WatchRun {
  /** Identifies the run. */
  run_id: string;
  /** Identifies its session. */
  session_id: string;
  /** Team that plays. */
  team: string;
  /** Name of the task. */
  task: string;
  /** Name of the hand. */
  hand: string;
  /** Whether it counts in a competition. */
  official: boolean;
  /** Length of a tick, s. */
  tick_s: number;
  /** Longest run, s of simulated time. */
  time_limit_s: number;
}

/** `scene`: everything to draw. */
export interface WatchScene {
  /** The run that is shown. */
  run: WatchRun;
  /** Objects, furniture and the hand's links. */
  bodies: WatchBody[];
  /** Ids of the bodies that move, in the order of `poses.poses`. */
  moving: number[];
  /** Named regions of the task's rules. */
  regions: Region[];
  /** Names of the task's goals in their order; absent where objects are counted instead. */
  goals?: string[];
  /** The hand's full description, as in `GET /v1/hands/{name}`. Left out for an uploaded hand, unless the viewer is of its team or an organizer. */
  hand?: HandDescription;
  /** The channels of `telemetry.readings`, one after the other; with `hand` only. */
  readings?: ChannelInfo[];
}

/** Weight of a motor in a tendon's wound length. */
export interface WeightDescription {
  /** Name of the motor. */
  motor: string;
  /** Weight. */
  weight: number;
}

/** `welcome`: everything that holds for the whole session. */
export interface Welcome {
  /** The id of the request. */
  id: number;
  /** Identifies the session. */
  session_id: string;
  /** Secret with which a new connection resumes the session. */
  resume_token: string;
  /** Name of the team on the leaderboard. */
  team: string;
  /** Remaining time, s; null for a session without a limit. */
  session_left_s: number | null;
  /** The competition. */
  competition: Competition;
  /** The program. */
  server: ServerInfo;
  /** Limits of requests and connections. */
  limits: Limits;
  /** Tasks of the server. */
  tasks: TaskInfo[];
  /** Hands of the server. */
  hands: HandInfo[];
  /** Fields of actions and observations. */
  specs: Specs;
  /** The open run of a session that is resumed; otherwise null. */
  run: RunInfo | null;
  /** A remark on the team's name, for people; absent if there is none. */
  note?: string;
}

/** A box in the frame of an object. */
export interface Within {
  /** Name of the object. */
  object: string;
  /** Lowest corner in its frame, m. */
  min: [number, number, number];
  /** Highest corner, m. */
  max: [number, number, number];
}

/** The worlds of all hosts of this competition. */
export interface Worlds {
  /** Number that can compute at once. */
  max: number;
  /** Number of open worlds that are not idle. */
  busy: number;
  /** Lockstep worlds without a request for a while. */
  idle: number;
  /** Number of sessions that were refused a world and wait for one. */
  waiting: number;
}

/** Force and torque in the world frame, torque about the base origin. */
export interface Wrench {
  /** N */
  force: [number, number, number];
  /** N·m */
  torque: [number, number, number];
}
