// Move balls from box A to box B with the SoftHand, in JavaScript, with nothing but a WebSocket.
//
//     node --experimental-websocket balls.mjs --seed 7 --runs 3
//
// Written from docs/protocol.md and docs/schema/control.json: the messages are JSON, one reply to each request. From
// Node 22 on, and in Deno and Bun, WebSocket is there without the flag.
//
// The strategy is that of client-py/src/palmares/examples/balls_softhand.py. It looks where the balls are (sensing
// "truth"), takes the one that leaves the hand most room, carries it over and looks again. A ball that lies too close
// to a wall is first raked to the middle of the box.

// --- what to tune; hand frame: fingers +z, palm normal +x, thumb +y; m, rad, s ---

const PITCH = 2.2405, ROLL = -0.3159; // Fingers tilted from straight up, palm turned about them.
const BALL_IN_HAND = [0.0527, 0.05, 0.2103]; // The ball's centre when the fingers close.
const PRESHAPE = 0.0977, CLOSED = 1.0; // Motor commands: slightly curled on the way, and the grasp.
const ADVANCE = 0.0165; // The approach ends this far behind the grasp; the palm then moves forward.
const LEAN = 0.155, CLEARANCE = 0.32; // The approach comes down along this tilt, from this far above.
const CREEP = 0.06, CREEP_S = 1.8; // The lift begins slowly: the fingers close under the ball, the motor follows.
const LIFT = 0.36, LIFTED = 0.15; // How far it is lifted; a ball that rose by LIFTED is in the hand.
const RAKE = { height: 0.02, inward: 0.07, sigma: 0.6, way: 0.12, retreat: 0.3 };
const YAWS = Array.from({ length: 24 }, (_, k) => (2 * Math.PI * k) / 24); // Directions tried for every ball.
const PICKS = 25, TRIES = 4; // Attempts in a run; at a ball that stays where it is.
const MARGIN = 0.005; // Room to leave between the hand and other balls.
const TIGHT = -0.1, CENTRAL = 0.12; // With less room than TIGHT, and farther out than CENTRAL, a ball is raked.

// The preshaped hand as capsules [start, end, radius].
const HAND = [
  [[0.0, 0.0, 0.045], [0.0, 0.0, 0.08], 0.042], // wrist
  [[-0.006, 0.027, 0.1], [-0.006, 0.027, 0.17], 0.019], // palm
  [[-0.006, 0.005, 0.1], [-0.006, 0.005, 0.185], 0.019],
  [[-0.006, -0.02, 0.1], [-0.006, -0.022, 0.17], 0.019],
  [[0.008, 0.037, 0.146], [0.014, 0.069, 0.16], 0.011], // thumb
  [[0.014, 0.069, 0.16], [0.021, 0.102, 0.181], 0.009],
  [[-0.001, 0.026, 0.184], [0.006, 0.031, 0.227], 0.009], // index
  [[0.006, 0.031, 0.227], [0.022, 0.034, 0.263], 0.009],
  [[-0.001, 0.007, 0.191], [0.006, 0.007, 0.234], 0.009], // middle
  [[0.006, 0.007, 0.234], [0.022, 0.007, 0.27], 0.009],
  [[-0.001, -0.013, 0.184], [0.006, -0.015, 0.227], 0.009], // ring
  [[0.006, -0.015, 0.227], [0.022, -0.018, 0.263], 0.009],
  [[-0.001, -0.032, 0.174], [0.006, -0.037, 0.217], 0.009], // little
  [[0.006, -0.037, 0.217], [0.022, -0.041, 0.253], 0.009],
];

// --- vectors, quaternions (x, y, z, w) and rotation matrices (rows) ---

const add = (a, b, factor = 1) => a.map((x, k) => x + factor * b[k]);
const dot = (a, b) => a.reduce((sum, x, k) => sum + x * b[k], 0);
const scaled = (a, factor) => a.map((x) => factor * x);
const norm = (a) => Math.sqrt(dot(a, a));
const clip = (x, low, high) => Math.min(Math.max(x, low), high);
const turned = (matrix, v) => matrix.map((row) => dot(row, v));
const column = (matrix, k) => matrix.map((row) => row[k]);

function product([ax, ay, az, aw], [bx, by, bz, bw]) {
  return [
    aw * bx + ax * bw + ay * bz - az * by,
    aw * by - ax * bz + ay * bw + az * bx,
    aw * bz + ax * by - ay * bx + az * bw,
    aw * bw - ax * bx - ay * by - az * bz,
  ];
}

const aboutY = (angle) => [0, Math.sin(angle / 2), 0, Math.cos(angle / 2)];
const aboutZ = (angle) => [0, 0, Math.sin(angle / 2), Math.cos(angle / 2)];

function matrixOf([x, y, z, w]) {
  return [
    [1 - 2 * (y * y + z * z), 2 * (x * y - z * w), 2 * (x * z + y * w)],
    [2 * (x * y + z * w), 1 - 2 * (x * x + z * z), 2 * (y * z - x * w)],
    [2 * (x * z - y * w), 2 * (y * z + x * w), 1 - 2 * (x * x + y * y)],
  ];
}

function slerp(a, b, fraction) {
  const cosine = dot(a, b);
  const to = cosine < 0 ? scaled(b, -1) : b;
  const half = Math.acos(Math.min(1, Math.abs(cosine)));
  if (half < 1e-6) return to;
  const mixed = add(scaled(a, Math.sin((1 - fraction) * half)), to, Math.sin(fraction * half));
  return scaled(mixed, 1 / norm(mixed));
}

// How the hand is turned when it takes a ball from the direction `yaw`.
function orientation(yaw) {
  const quat = product(product(aboutZ(yaw), aboutY(PITCH)), aboutZ(ROLL));
  return { quat, matrix: matrixOf(quat) };
}
const ORIENTATIONS = YAWS.map((yaw) => ({ yaw, ...orientation(yaw) }));

const downwards = (yaw) => [Math.cos(yaw) * Math.sin(LEAN), Math.sin(yaw) * Math.sin(LEAN), -Math.cos(LEAN)];

// --- the connection ---

class Refused extends Error {}
class RunOver extends Error {}

class Connection {
  // Requests are answered one by one, in order; what comes without our `id` was not asked for.
  static async open(url) {
    const connection = new Connection();
    connection.id = 0;
    connection.socket = new WebSocket(`${url.replace(/^http/, "ws")}/v1/control`, "palmares.v1.json");
    await new Promise((resolve, reject) => {
      connection.socket.onopen = resolve;
      connection.socket.onerror = () => reject(new Refused(`no server at ${url}`));
    });
    connection.socket.onmessage = ({ data }) => connection.take(JSON.parse(data));
    connection.socket.onclose = ({ code, reason }) =>
      connection.waiting?.reject(new Refused(`the connection was closed: ${code} ${reason}`));
    return connection;
  }

  take(message) {
    if (message.op === "error") this.waiting?.reject(new Refused(`${message.code}: ${message.message}`));
    else if (message.id === this.id) this.waiting?.resolve(message);
  }

  ask(op, fields) {
    this.id += 1;
    return new Promise((resolve, reject) => {
      this.waiting = { resolve, reject };
      this.socket.send(JSON.stringify({ op, id: this.id, ...fields }));
    });
  }
}

// --- motions: quintic smoothsteps, sent tick by tick, within the limits of the base ---

const SHARE = 0.95; // Of the limits, so that the servo has some left to correct errors.
const LIMITS = { speed: 2, turn: 3, acceleration: 4, turnAcceleration: 4 }; // docs/protocol.md, step
const smoothstep = (x) => x ** 3 * (10 - 15 * x + 6 * x ** 2);

// The quintic's greatest velocity is 15/8 of way per time, its greatest acceleration 10/√3 of way per time².
function duration(way, angle, atLeast) {
  const velocity = 15 / 8 / SHARE, acceleration = 10 / Math.sqrt(3) / SHARE;
  return Math.max(
    atLeast,
    (velocity * way) / LIMITS.speed,
    (velocity * angle) / LIMITS.turn,
    Math.sqrt((acceleration * way) / LIMITS.acceleration),
    Math.sqrt((acceleration * angle) / LIMITS.turnAcceleration),
  );
}

class Hand {
  constructor(connection, first) {
    this.connection = connection;
    this.obs = first;
    this.tick_s = first.run.tick_s;
    this.position = first.hand.base.position;
    this.quat = first.hand.base.quat_xyzw;
    this.sigma = first.hand.actuators[0].position;
  }

  get balls() {
    return this.obs.truth.objects.position;
  }

  async to(seconds, { position = this.position, quat = this.quat, sigma = this.sigma }) {
    const from = { position: this.position, quat: this.quat, sigma: this.sigma };
    const way = norm(add(position, from.position, -1));
    const angle = 2 * Math.acos(Math.min(1, Math.abs(dot(quat, from.quat))));
    const ticks = Math.max(1, Math.ceil(duration(way, angle, seconds) / this.tick_s));
    for (let tick = 1; tick <= ticks; tick++) {
      const x = smoothstep(tick / ticks);
      this.position = add(scaled(from.position, 1 - x), position, x);
      this.quat = slerp(from.quat, quat, x);
      this.sigma = (1 - x) * from.sigma + x * sigma;
      await this.step(1);
    }
  }

  async step(repeat) {
    const base = { position: this.position, quat_xyzw: this.quat };
    const action = { base, hand: [this.sigma] };
    this.obs = await this.connection.ask("step", { tick: this.obs.tick, repeat, action });
    if (this.obs.terminated || this.obs.truncated) throw new RunOver(this.obs.reason);
  }

  wait(seconds) {
    return this.step(Math.round(seconds / this.tick_s));
  }
}

// --- which ball, and from where ---

// Distance of a point from the axis of a capsule, less its radius.
function distance(start, end, radius, point) {
  const axis = add(end, start, -1), offset = add(point, start, -1);
  const along = clip(dot(offset, axis) / dot(axis, axis), 0, 1);
  return norm(add(offset, axis, -along)) - radius;
}

// How well the preshaped hand fits at a pose: 0 if it touches nothing, less if it does.
function room(matrix, position, others, ballRadius, box) {
  let score = 0;
  for (const [from, to, radius] of HAND) {
    const start = add(turned(matrix, from), position), end = add(turned(matrix, to), position);
    for (const ball of others) {
      score -= clip(MARGIN + ballRadius - distance(start, end, radius, ball), 0, 0.05);
    }
    if (Math.min(start[2], end[2]) - radius >= box.max[2]) continue; // Above the walls.
    for (const k of [0, 1]) {
      const beyond = Math.max(start[k], end[k]) + radius - box.max[k];
      const before = box.min[k] - Math.min(start[k], end[k]) + radius;
      for (const into of [beyond, before]) score -= 3 * Math.max(0, into) + (into > 0.004 ? 0.1 : 0);
    }
  }
  return score;
}

const baseFor = (ball, matrix) => add(ball, turned(matrix, BALL_IN_HAND), -1);

// The ball and the direction with most room. A ball that was tried where it lies counts less, and from about the
// same direction much less.
function choose(balls, inA, ballRadius, box, attempts) {
  let best = null;
  for (const ball of inA) {
    const at = balls[ball];
    const others = balls.filter((_, k) => k !== ball);
    const here = attempts.filter((tried) => tried.ball === ball && norm(add(tried.at, at, -1)) < 0.01);
    if (here.length >= TRIES) continue;
    for (const { yaw, quat, matrix } of ORIENTATIONS) {
      const before = add(baseFor(at, matrix), column(matrix, 0), -ADVANCE);
      const down = downwards(yaw);
      const poses = [0, 0.05, 0.12].map((back) => add(before, down, -back));
      const least = Math.min(...poses.map((pose) => room(matrix, pose, others, ballRadius, box)));
      const repeated = here.reduce((sum, tried) => sum + Math.max(0, Math.cos(yaw - tried.yaw)), 0);
      const score = least - 0.05 * here.length - 0.2 * repeated;
      if (best === null || score > best.score) {
        best = { ball, at, yaw, quat, matrix, room: least, tried: here.length, score };
      }
    }
  }
  return best;
}

// --- how a ball is taken, and how it is raked ---

async function pickAndCarry(hand, target, boxB) {
  const graspAt = baseFor(target.at, target.matrix);
  const before = add(graspAt, column(target.matrix, 0), -ADVANCE);
  const above = add(before, downwards(target.yaw), -CLEARANCE / Math.cos(LEAN));
  await hand.to(1.4, { position: above, quat: target.quat, sigma: PRESHAPE });
  await hand.to(0.8, { position: before });
  await hand.to(0.3, { position: graspAt });
  await hand.to(1.0, { sigma: CLOSED });
  await hand.wait(0.2);
  const heights = hand.balls.map((ball) => ball[2]);
  await hand.to(CREEP_S, { position: add(graspAt, [0, 0, CREEP]) });
  await hand.to(0.8, { position: add(graspAt, [0, 0, LIFT]) });
  if (hand.balls.some((ball, k) => ball[2] > heights[k] + LIFTED)) {
    // The ball, not the hand, should arrive near the middle of box B.
    const [x, y] = [0, 1].map((k) => (boxB.min[k] + boxB.max[k]) / 2 - target.at[k]);
    await hand.to(1.2, { position: add(hand.position, [x, 0.7 * y, 0]) });
    await hand.wait(0.2);
  }
  await hand.to(0.9, { sigma: 0 });
  await hand.wait(0.3);
}

// Draw the ball towards the middle of its box; `outward` is the unit vector away from there.
async function rake(hand, target, outward) {
  const reach = ({ matrix }) => dot(turned(matrix, BALL_IN_HAND), outward);
  const { yaw, quat, matrix } = ORIENTATIONS.reduce((a, b) => (reach(b) > reach(a) ? b : a));
  const behind = add(baseFor(target.at, matrix), outward, -RAKE.inward);
  const downAt = add(behind, [0, 0, RAKE.height]);
  const drawnTo = add(downAt, outward, -RAKE.way);
  const above = add(downAt, downwards(yaw), -CLEARANCE / Math.cos(LEAN));
  await hand.to(1.2, { position: above, quat, sigma: PRESHAPE });
  await hand.to(0.8, { position: downAt });
  await hand.to(0.9, { sigma: RAKE.sigma });
  await hand.to(0.8, { position: drawnTo });
  await hand.to(1.2, { position: add(drawnTo, [0, 0, RAKE.retreat]) });
  await hand.to(0.9, { sigma: 0 });
  await hand.wait(0.3);
}

// --- a run ---

const within = (region, point) => point.every((x, k) => region.min[k] <= x && x <= region.max[k]);

async function play(connection, seed, picks) {
  const wanted = { task: "balls", hand: "softhand", sensing: "truth", ...(seed === null ? {} : { seed }) };
  const first = await connection.ask("reset", wanted);
  const region = (role) => first.scene.regions.find((found) => found.role === role);
  const boxA = region("start"), boxB = region("goal");
  const middle = [0, 1].map((k) => (boxA.min[k] + boxA.max[k]) / 2);
  const ballRadius = first.scene.bodies.find((body) => body.free).parts[0].shape.radius;
  const hand = new Hand(connection, first);
  const attempts = [];
  try {
    await hand.to(1, { position: [...middle, 0.9], quat: ORIENTATIONS[0].quat });
    while (attempts.length < picks) {
      const balls = hand.balls;
      const inA = balls.map((_, k) => k).filter((k) => within(boxA, balls[k]));
      const target = choose(balls, inA, ballRadius, boxA, attempts);
      if (target === null) break;
      attempts.push(target);
      const away = [target.at[0] - middle[0], target.at[1] - middle[1], 0];
      if ((target.room < TIGHT || target.tried > 0) && norm(away) > CENTRAL) {
        await rake(hand, target, scaled(away, 1 / norm(away)));
      } else {
        await pickAndCarry(hand, target, boxB);
      }
      const inB = hand.balls.filter((ball) => within(boxB, ball)).length;
      console.error(`pick ${attempts.length}: ${inB} in box B, ${hand.obs.sim_time_s.toFixed(1)} s simulated`);
    }
    await hand.wait(0.5);
  } catch (error) {
    if (!(error instanceof RunOver)) throw error; // Complete, or out of time: the result says which.
  }
  const { op, id, ...result } = await connection.ask("stop", {});
  return { seed: first.run.seed, picks: attempts.length, ...result };
}

// --- the command line ---

const HELP = `node --experimental-websocket balls.mjs [options]

Moves balls from box A to box B with the SoftHand, and prints the result of each run as JSON.

  --url URL     address of the server (default http://127.0.0.1:8080)
  --team NAME   name on a practice server's leaderboard (default example-js)
  --seed N      scene of the first run; later runs count up from it (default: the server draws it)
  --runs N      number of runs (default 1)
  --picks N     most attempts in a run (default ${PICKS})
  --help, -h    this text`;

function whole(name, text) {
  if (!/^[0-9]{1,15}$/.test(text)) throw new Refused(`--${name} ${text}: wanted a whole number; --help lists the options`);
  return Number(text);
}

async function main() {
  const { parseArgs } = await import("node:util");
  const options = {
    help: { type: "boolean", short: "h" },
    url: { type: "string", default: "http://127.0.0.1:8080" },
    team: { type: "string", default: "example-js" },
    seed: { type: "string" },
    runs: { type: "string", default: "1" },
    picks: { type: "string", default: String(PICKS) },
  };
  let values;
  try {
    ({ values } = parseArgs({ options }));
  } catch (error) {
    throw new Refused(`${error.message.split(". ")[0]}; --help lists the options`);
  }
  if (values.help) {
    console.log(HELP);
    return;
  }
  const runs = whole("runs", values.runs), picks = whole("picks", values.picks);
  const first = values.seed === undefined ? null : whole("seed", values.seed);
  if (typeof WebSocket === "undefined") {
    throw new Refused("this Node has WebSocket behind a flag: node --experimental-websocket balls.mjs");
  }
  const connection = await Connection.open(values.url);
  try {
    await connection.ask("hello", { client: { name: values.team, version: "1.0" } });
    for (let k = 0; k < runs; k++) {
      console.log(JSON.stringify(await play(connection, first === null ? null : first + k, picks)));
    }
  } finally {
    connection.socket.close(); // An open socket would keep the program alive.
  }
}

main().catch((error) => {
  if (!(error instanceof Refused)) throw error;
  console.error(error.message);
  process.exitCode = 1;
});
