//! Telemetry of the hand: `palmares.Telemetry`, in protobuf. It is for viewers and not part of the hash chain.
//!
//! The thread of the world only copies a sample; predictions and friction are computed on the thread of the writer.

use crate::descriptors::{described, timestamp};
use palmares_tasks::run::{RunSample, TelemetryModel};
use prost::Message;
use prost_types::Timestamp;
use std::sync::Arc;

/// Period, in frames, after which unchanged telemetry is written again.
const REPEAT_PERIOD: u64 = 300;
/// Steps of σ and angles (2⁻¹⁴), and of lengths (2⁻¹³ m): finer ones are invisible, and rounded numbers compress well.
const ANGLE_STEPS: f64 = (1 << 14) as f64;
const LENGTH_STEPS: f64 = (1 << 13) as f64;
/// Steps of forces (N) and of tensions (the tendon's unit).
const FORCE_STEPS: f64 = (1 << 8) as f64;
/// Steps of the friction use.
const FRICTION_STEPS: f64 = (1 << 8) as f64;
/// Steps of sensor readings: 2⁻¹⁰ of their unit.
const READING_STEPS: f64 = (1 << 10) as f64;
/// Largest value: written for an infinite one.
const MAX_VALUE: f64 = 1e6;

described! {
    "palmares", "Telemetry":
    /// `palmares.Telemetry`
    #[derive(Clone, PartialEq, Message)]
    pub(crate) struct TelemetryMessage {
        #[prost(message, required, tag = "1")]
        timestamp: Timestamp,
        #[prost(uint64, required, tag = "2")]
        pub(crate) tick: u64,
        #[prost(double, required, tag = "3")]
        pub(crate) score: f64,
        #[prost(float, repeated, tag = "4")]
        pub(crate) command: Vec<f32>,
        #[prost(float, repeated, tag = "5")]
        pub(crate) position: Vec<f32>,
        #[prost(float, repeated, tag = "6")]
        pub(crate) motor_tension: Vec<f32>,
        #[prost(float, repeated, tag = "7")]
        pub(crate) tension: Vec<f32>,
        #[prost(float, repeated, tag = "8")]
        pub(crate) q: Vec<f32>,
        #[prost(float, repeated, tag = "9")]
        pub(crate) predicted: Vec<f32>,
        #[prost(uint32, repeated, tag = "10")]
        pub(crate) contact_a: Vec<u32>,
        #[prost(uint32, repeated, tag = "11")]
        pub(crate) contact_b: Vec<u32>,
        #[prost(float, repeated, tag = "12")]
        pub(crate) contact_position: Vec<f32>,
        #[prost(float, repeated, tag = "13")]
        pub(crate) contact_force: Vec<f32>,
        #[prost(float, repeated, tag = "14")]
        pub(crate) contact_use: Vec<f32>,
        #[prost(float, repeated, tag = "15")]
        pub(crate) work: Vec<f32>,
        #[prost(float, repeated, tag = "16")]
        pub(crate) finger_force: Vec<f32>,
        #[prost(float, repeated, tag = "17")]
        pub(crate) finger_torque: Vec<f32>,
        #[prost(float, repeated, tag = "18")]
        pub(crate) touch: Vec<f32>,
        #[prost(float, repeated, tag = "19")]
        pub(crate) readings: Vec<f32>,
    }
}

/// The nearest multiple of `1 / steps`.
fn rounded(x: f64, steps: f64) -> f32 {
    // Adding zero makes -0 a 0.
    ((x.clamp(-MAX_VALUE, MAX_VALUE) * steps).round() / steps + 0.0) as f32
}

fn all<'a>(numbers: impl IntoIterator<Item = &'a f64>, steps: f64) -> Vec<f32> {
    numbers.into_iter().map(|x| rounded(*x, steps)).collect()
}

/// Makes telemetry messages, and skips those that repeat the last one.
pub(crate) struct TelemetryFilter {
    telemetry_model: Arc<TelemetryModel>,
    /// The last message without time and tick.
    last: TelemetryMessage,
    frames: u64,
}

impl TelemetryFilter {
    pub(crate) fn new(telemetry_model: Arc<TelemetryModel>) -> Self {
        TelemetryFilter { telemetry_model, last: TelemetryMessage::default(), frames: 0 }
    }

    /// The message of a frame, or `None` if it repeats the last one.
    pub(crate) fn message(
        &mut self,
        time_ns: u64,
        tick: u64,
        score: f64,
        sample: &RunSample,
    ) -> Option<TelemetryMessage> {
        let (telemetry, contacts) =
            (self.telemetry_model.telemetry(sample), self.telemetry_model.contacts(sample));
        let motors = || telemetry.motors.iter();
        let message = TelemetryMessage {
            score,
            command: all(motors().map(|motor| &motor.command), ANGLE_STEPS),
            position: all(motors().map(|motor| &motor.position), ANGLE_STEPS),
            motor_tension: all(motors().map(|motor| &motor.tension), FORCE_STEPS),
            tension: all(&telemetry.tension, FORCE_STEPS),
            q: all(&telemetry.q, ANGLE_STEPS),
            predicted: all(&telemetry.predicted, ANGLE_STEPS),
            contact_a: contacts.iter().map(|contact| contact.a as u32).collect(),
            contact_b: contacts.iter().map(|contact| contact.b as u32).collect(),
            contact_position: all(contacts.iter().flat_map(|contact| &contact.position), LENGTH_STEPS),
            contact_force: all(contacts.iter().flat_map(|contact| &contact.force), FORCE_STEPS),
            contact_use: all(contacts.iter().map(|contact| &contact.friction_use), FRICTION_STEPS),
            work: all(motors().map(|motor| &motor.motor_work_j), FORCE_STEPS),
            finger_force: all(telemetry.fingers.iter().flat_map(|finger| &finger.force), FORCE_STEPS),
            finger_torque: all(telemetry.fingers.iter().flat_map(|finger| &finger.torque), ANGLE_STEPS),
            touch: all(telemetry.touch.iter().flatten(), FORCE_STEPS),
            readings: all(&telemetry.readings, READING_STEPS),
            ..TelemetryMessage::default()
        };
        let due = self.frames.is_multiple_of(REPEAT_PERIOD);
        self.frames += 1;
        if message == self.last && !due {
            return None;
        }
        self.last.clone_from(&message);
        Some(TelemetryMessage { timestamp: timestamp(time_ns), tick, ..message })
    }
}
