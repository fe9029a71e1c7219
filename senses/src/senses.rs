//! Everything that a hand and its arm feel, tick by tick.

use crate::accelerometer::{Accelerometer, Motion};
use crate::encoders::{Arm, BaseReading, Joints, MotorReading, Motors, encoded, quantised};
use crate::noise::{Noise, SensorNoise};
use crate::touch;
use crate::wrist::{Wrist, WristState};
use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};
use palmares_sim::World;
use serde::{Deserialize, Serialize};
use std::sync::Arc;

/// What is felt after a tick.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct SensorReadings {
    /// The base, by the arm's encoders.
    pub base: BaseReading,
    /// Every motor, in the hand's order.
    pub motors: Vec<MotorReading>,
    /// Joint encoders, in the order in which the hand declares them, rad.
    pub joints: Vec<f64>,
    /// Force (N) and torque (N·m) between arm and hand, world frame, torque about the base's origin.
    pub wrist: ([f64; 3], [f64; 3]),
    /// Force on every taxel, N: along x and y of its patch, and into the patch.
    pub touch: Vec<[f64; 3]>,
    /// Acceleration minus gravity in the frame of the accelerometer's link, m/s².
    pub acceleration: Option<[f64; 3]>,
}

/// The sensors of a run, ideal or with the noise of real ones.
#[derive(Clone)]
pub struct Senses {
    hand: Arc<Hand>,
    tick_s: f64,
    accelerometer: Option<Accelerometer>,
    acceleration: Option<[f64; 3]>,
    noisy: Option<Box<Noisy>>,
}

/// The state of sensors that have noise.
#[derive(Clone)]
struct Noisy {
    arm: Arm,
    motors: Motors,
    joints: Option<Joints>,
    wrist: Wrist,
    touch: SensorNoise,
    touched: Vec<[f64; 3]>,
    read: SensorReadings,
}

/// What of the sensors changes from tick to tick: sensors of the same run that recall it feel on as those it was taken of.
#[derive(Clone, Serialize, Deserialize)]
pub struct SensorState {
    moved: Motion,
    acceleration: Option<[f64; 3]>,
    noisy: Option<NoisyState>,
}

/// The same of those that have noise.
#[derive(Clone, Serialize, Deserialize)]
struct NoisyState {
    arm: Option<Pose>,
    motors: Vec<Option<f64>>,
    wrist: WristState,
    touched: Vec<[f64; 3]>,
    read: SensorReadings,
}

impl Senses {
    /// The sensors of a run whose world stands at tick 0; with noise if it is given.
    pub fn new(hand: Arc<Hand>, world: &World, tick_s: f64, noise: Option<&Noise>) -> Self {
        let accelerometer = Accelerometer::new(&hand, noise);
        let noisy = noise.map(|noise| {
            Box::new(Noisy {
                arm: Arm::new(noise),
                motors: Motors::new(&hand, noise),
                joints: Joints::new(&hand, noise),
                wrist: Wrist::new(noise, tick_s),
                touch: noise.sensor("touch"),
                touched: Vec::new(),
                read: ideal(&hand, world, None),
            })
        });
        let mut senses = Senses { hand, tick_s, accelerometer, acceleration: None, noisy };
        senses.tick(world, 0);
        senses
    }

    /// A tick has passed: `tick` of them since the run began.
    pub fn tick(&mut self, world: &World, tick: u64) {
        if self.accelerometer.is_none() && self.noisy.is_none() {
            return;
        }
        let links = links(&self.hand, world);
        let gravity = world.model().config().gravity;
        let felt = |sensor: &mut Accelerometer| sensor.tick(tick, self.tick_s, &links, gravity);
        self.acceleration = self.accelerometer.as_mut().map(felt);
        if let Some(noisy) = &mut self.noisy {
            noisy.tick(&self.hand, world, &links, tick, self.tick_s);
            noisy.read.acceleration = self.acceleration;
        }
    }

    /// What changes of them.
    pub fn state(&self) -> SensorState {
        let noisy = self.noisy.as_ref().map(|noisy| NoisyState {
            arm: noisy.arm.last,
            motors: noisy.motors.last(),
            wrist: noisy.wrist.state.clone(),
            touched: noisy.touched.clone(),
            read: noisy.read.clone(),
        });
        let moved = self.accelerometer.as_ref().and_then(|sensor| sensor.last);
        SensorState { moved, acceleration: self.acceleration, noisy }
    }

    /// Whether a memory can be of these sensors: with as much noise, and as many motors, joints and taxels.
    pub fn fits(&self, state: &SensorState) -> bool {
        let numbers = |read: &SensorReadings| (read.motors.len(), read.joints.len(), read.touch.len());
        match (&self.noisy, &state.noisy) {
            (None, None) => true,
            (Some(own), Some(other)) => {
                own.motors.last().len() == other.motors.len()
                    && own.touched.len() == other.touched.len()
                    && numbers(&own.read) == numbers(&other.read)
            }
            _ => false,
        }
    }

    /// Feels on from there.
    pub fn restore(&mut self, state: &SensorState) {
        self.acceleration = state.acceleration;
        if let Some(sensor) = &mut self.accelerometer {
            sensor.last = state.moved;
        }
        if let (Some(noisy), Some(state)) = (&mut self.noisy, &state.noisy) {
            noisy.arm.last = state.arm;
            noisy.motors.set_last(&state.motors);
            noisy.wrist.state.clone_from(&state.wrist);
            noisy.touched.clone_from(&state.touched);
            noisy.read.clone_from(&state.read);
        }
    }

    /// What is felt now.
    pub fn read(&self, world: &World) -> SensorReadings {
        match &self.noisy {
            Some(noisy) => noisy.read.clone(),
            None => ideal(&self.hand, world, self.acceleration),
        }
    }
}

impl Noisy {
    fn tick(&mut self, hand: &Hand, world: &World, links: &[Pose], tick: u64, tick_s: f64) {
        let state = world.state();
        let angular = Vec3::new(state.v[3], state.v[4], state.v[5]);
        self.read.base = self.arm.tick(tick_s, state.base, angular);
        self.read.motors = self.motors.tick(tick, tick_s, &state.motors, &tensions(hand, world));
        if let Some(joints) = &self.joints {
            self.read.joints = joints.read(tick, &state.q);
        }
        let ([fx, fy, fz], [tx, ty, tz]) = wrench(hand, world, links);
        self.wrist.tick(tick, [fx, fy, fz, tx, ty, tz]);
        self.read.wrist = self.wrist.read();
        let touch = &hand.sensors.touch;
        // The newest reading that began before this tick's end.
        let per_tick = touch.rate_hz * tick_s;
        let sample = |tick: u64| (tick as f64 * per_tick + 1e-9).floor() as u64;
        if tick == 0 || sample(tick) != sample(tick - 1) {
            let mut drawn = self.touch.sample(sample(tick));
            let [most, step] = [touch.saturation, touch.resolution];
            self.touched = touch::forces(hand, links, world.contact_forces());
            for taxel in &mut self.touched {
                let noise = drawn.normal3();
                for axis in 0..3 {
                    let felt = taxel[axis] + touch.noise * noise[axis];
                    let felt = if axis < 2 && !touch.shear { 0.0 } else { felt };
                    taxel[axis] = quantised(felt.clamp(if axis < 2 { -most } else { 0.0 }, most), step);
                }
            }
        }
        self.read.touch.clone_from(&self.touched);
    }
}

fn links(hand: &Hand, world: &World) -> Vec<Pose> {
    let state = world.state();
    hand.base_from_links(&state.q).into_iter().map(|base_from_link| state.base * base_from_link).collect()
}

/// Tension of each motor's tendons together.
fn tensions(hand: &Hand, world: &World) -> Vec<f64> {
    let mut tensions = vec![0.0; hand.motors.len()];
    for (tendon, tension) in hand.tendons.iter().zip(&world.state().tension) {
        tensions[tendon.motor] += tension;
    }
    tensions
}

/// Force and torque between arm and hand, world frame, torque about the base's origin: what the servo exerts, and the
/// hand's own weight where the simulation carries it (Rocchi and Hauser 2016, eq. 6).
fn wrench(hand: &Hand, world: &World, links: &[Pose]) -> ([f64; 3], [f64; 3]) {
    let (force, torque) = world.servo_wrench();
    let (mut force, mut torque) = (Vec3::from_array(force), Vec3::from_array(torque));
    if hand.gravity_compensation {
        let (gravity, base) = (world.model().config().gravity, world.state().base.translation);
        for (link, pose) in hand.links.iter().zip(links) {
            let carried = gravity * -link.inertia.mass;
            force += carried;
            torque += (pose.transform_point(link.inertia.com) - base).cross(carried);
        }
    }
    (force.to_array(), torque.to_array())
}

/// What sensors without any error read.
fn ideal(hand: &Hand, world: &World, acceleration: Option<[f64; 3]>) -> SensorReadings {
    let state = world.state();
    let v = |k: usize| Vec3::new(state.v[k], state.v[k + 1], state.v[k + 2]);
    let motors = state.motors.iter().zip(tensions(hand, world)).map(|(motor, tension)| MotorReading {
        position: motor.position,
        velocity: motor.velocity,
        tension,
    });
    let links = links(hand, world);
    SensorReadings {
        base: BaseReading { pose: state.base, linear: v(0), angular: v(3) },
        motors: motors.collect(),
        joints: encoded(hand).into_iter().map(|coordinate| state.q[coordinate]).collect(),
        wrist: wrench(hand, world, &links),
        touch: touch::forces(hand, &links, world.contact_forces()),
        acceleration,
    }
}
