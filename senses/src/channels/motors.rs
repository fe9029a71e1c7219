//! The motors: their encoders, and tension by their current.

use crate::declaration::{Channel, Column, MOTORS, Range, Record, Rows};
use crate::moment::Moment;
use crate::noise::{Noise, SensorNoise};
use crate::quantise::quantised;
use crate::sensor::Sensor;
use palmares_models::hand::Hand;
use palmares_models::hand::sensors::MotorSensor;

/// Columns of a motor's row.
const WIDTH: usize = 4;

/// The errors of a motor's sensors, drawn once a run.
#[derive(Clone)]
struct MotorErrors {
    bias: f64,
    gain: f64,
    /// Standard deviation of the tension, in its unit.
    deviation: f64,
    noise: SensorNoise,
}

/// The sensors of all motors.
#[derive(Clone)]
pub(crate) struct MotorSensors {
    sensor: MotorSensor,
    tick_s: f64,
    errors: Vec<MotorErrors>,
}

impl Sensor for MotorSensors {
    const CHANNEL: Channel = Channel {
        name: "motors",
        key: "actuators",
        rows: Rows::Each(&MOTORS),
        columns: &[
            Column::named("command", 1, "", "Commanded σ.").range(Range::Within(0.0, 1.0)),
            Column::named("position", 1, "", "σ the motor has reached."),
            Column::named("velocity", 1, "1/s", "dσ/dt, 1/s."),
            Column::named(
                "tension",
                1,
                "tendon",
                "Tension of its tendons, in the tendon's unit (hand.toml); negative where a drive pushes.",
            ),
        ],
        record: Some(Record {
            name: "ActuatorObservation",
            doc: "What a motor's sensors read.",
            row_name: Some("Name of the motor."),
        }),
        telemetry: Some("command, position, motor_tension"),
        doc: "Command, position, velocity and tension of every motor, by its encoder and its current",
        ..Channel::NUMBERS
    };
    /// Position of each motor at its last reading, σ.
    type State = Vec<Option<f64>>;

    fn law(now: &Moment<'_>, _: Option<&Self::State>, row: &mut [f64]) {
        for (k, (motor, row)) in now.motors.iter().zip(row.chunks_exact_mut(WIDTH)).enumerate() {
            row.copy_from_slice(&[motor.command, motor.position, motor.velocity, tension(now, k)]);
        }
    }

    fn new(hand: &Hand, noise: Option<&Noise>, tick_s: f64) -> Option<(Self, Self::State)> {
        let (sensor, noise) = (hand.sensors.motors, noise?);
        let errors = hand.motors.iter().enumerate().map(|(k, motor)| {
            let noise = noise.sensor(&format!("motor {}", motor.name));
            let mut drawn = noise.sample(0);
            let loads = hand.tendons.iter().map(|tendon| tendon.weight(k).abs() * tendon.force_limit);
            let strongest = loads.fold(0.0, f64::max);
            MotorErrors {
                bias: sensor.bias * drawn.normal(),
                gain: 1.0 + sensor.tension_gain * drawn.normal(),
                deviation: sensor.tension_noise * strongest,
                noise,
            }
        });
        let sensors = MotorSensors { sensor, tick_s, errors: errors.collect() };
        Some((sensors, vec![None; hand.motors.len()]))
    }

    fn tick(&self, now: &Moment<'_>, tick: u64, last: &mut Self::State, row: &mut [f64]) {
        let rows = row.chunks_exact_mut(WIDTH).zip(&self.errors).zip(last);
        for (k, (((row, errors), last), motor)) in rows.zip(now.motors).enumerate() {
            let position = quantised(motor.position + errors.bias, self.sensor.resolution);
            let velocity = last.map_or(0.0, |last| (position - last) / self.tick_s);
            *last = Some(position);
            let noise = errors.deviation * errors.noise.sample(tick + 1).normal();
            row.copy_from_slice(&[motor.command, position, velocity, tension(now, k) * errors.gain + noise]);
        }
    }

    fn fits(own: &Self::State, read: &Self::State) -> bool {
        own.len() == read.len()
    }
}

/// Tension of a motor's tendons together, each by its weight.
fn tension(now: &Moment<'_>, motor: usize) -> f64 {
    now.hand.motor_load(motor, now.tension)
}
