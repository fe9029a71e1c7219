//! What went on in the hand: `palmares.Telemetry`, written as protobuf. For looking at; it takes no part in the chain.
//!
//! Where the world is stepped it is copied; predictions and friction are computed here, where nobody waits.

use crate::descriptors::{self, TIME, TIMESTAMP, field, file, list, message};
use palmares_tasks::run::{RunSample, TelemetryModel};
use prost::Message;
use prost_types::field_descriptor_proto::Type;
use prost_types::{FileDescriptorSet, Timestamp};
use std::sync::Arc;

/// It is written again after so many pictures, also when nothing has changed.
const AGAIN_AFTER: u64 = 300;
/// σ and rad in steps of 2⁻¹⁴, m in steps of 2⁻¹³: finer is not seen, and the rest of a number packs well.
const FINE: f64 = (1 << 14) as f64;
const PLACE: f64 = (1 << 13) as f64;
/// N, and the tendons' unit.
const FORCE: f64 = (1 << 8) as f64;
/// Readings of sensors, in steps of 2⁻¹⁰ of their unit.
const READING: f64 = (1 << 10) as f64;
/// Of friction use.
const PART: f64 = (1 << 8) as f64;
/// What is infinite is told as this.
const MOST: f64 = 1e6;

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

/// The `FileDescriptorSet` that readers of `palmares.Telemetry` need.
pub(crate) fn schema() -> Vec<u8> {
    let floats = |name: &str| list(name, Type::Float, None);
    let fields = vec![
        field("timestamp", Type::Message, Some(TIMESTAMP)),
        field("tick", Type::Uint64, None),
        field("score", Type::Double, None),
        floats("command"),
        floats("position"),
        floats("motor_tension"),
        floats("tension"),
        floats("q"),
        floats("predicted"),
        list("contact_a", Type::Uint32, None),
        list("contact_b", Type::Uint32, None),
        floats("contact_position"),
        floats("contact_force"),
        floats("contact_use"),
        floats("work"),
        floats("finger_force"),
        floats("finger_torque"),
        floats("touch"),
        floats("readings"),
    ];
    let telemetry = file("palmares/Telemetry.proto", "palmares", &[TIME], message("Telemetry", fields));
    FileDescriptorSet { file: vec![descriptors::time(), telemetry] }.encode_to_vec()
}

/// In such steps.
fn rounded(x: f64, steps: f64) -> f32 {
    // Adding zero makes -0 a 0.
    ((x.clamp(-MOST, MOST) * steps).round() / steps + 0.0) as f32
}

fn all<'a>(numbers: impl IntoIterator<Item = &'a f64>, steps: f64) -> Vec<f32> {
    numbers.into_iter().map(|x| rounded(*x, steps)).collect()
}

/// Writes what changes.
pub(crate) struct Telemeter {
    telemetry_model: Arc<TelemetryModel>,
    /// Without time and tick.
    last: TelemetryMessage,
    pictures: u64,
}

impl Telemeter {
    pub(crate) fn new(telemetry_model: Arc<TelemetryModel>) -> Self {
        Telemeter { telemetry_model, last: TelemetryMessage::default(), pictures: 0 }
    }

    /// What there is to write of a moment; none where it is as it was before.
    pub(crate) fn message(
        &mut self,
        time_ns: u64,
        tick: u64,
        score: f64,
        sample: &RunSample,
    ) -> Option<TelemetryMessage> {
        let (seen, contacts) =
            (self.telemetry_model.telemetry(sample), self.telemetry_model.contacts(sample));
        let motors = || seen.motors.iter();
        let message = TelemetryMessage {
            score,
            command: all(motors().map(|motor| &motor.command), FINE),
            position: all(motors().map(|motor| &motor.position), FINE),
            motor_tension: all(motors().map(|motor| &motor.tension), FORCE),
            tension: all(&seen.tension, FORCE),
            q: all(&seen.q, FINE),
            predicted: all(&seen.predicted, FINE),
            contact_a: contacts.iter().map(|contact| contact.a as u32).collect(),
            contact_b: contacts.iter().map(|contact| contact.b as u32).collect(),
            contact_position: all(contacts.iter().flat_map(|contact| &contact.position), PLACE),
            contact_force: all(contacts.iter().flat_map(|contact| &contact.force), FORCE),
            contact_use: all(contacts.iter().map(|contact| &contact.friction_use), PART),
            work: all(motors().map(|motor| &motor.motor_work_j), FORCE),
            finger_force: all(seen.fingers.iter().flat_map(|finger| &finger.force), FORCE),
            finger_torque: all(seen.fingers.iter().flat_map(|finger| &finger.torque), FINE),
            touch: all(seen.touch.iter().flatten(), FORCE),
            readings: all(&seen.readings, READING),
            ..TelemetryMessage::default()
        };
        let due = self.pictures.is_multiple_of(AGAIN_AFTER);
        self.pictures += 1;
        if message == self.last && !due {
            return None;
        }
        self.last.clone_from(&message);
        Some(TelemetryMessage { timestamp: descriptors::timestamp(time_ns), tick, ..message })
    }
}
