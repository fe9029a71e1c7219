//! The base, by the encoders of the arm that carries the hand.

use crate::declaration::{Channel, Column, Range, Record};
use crate::moment::Moment;
use crate::noise::Noise;
use crate::quantise::quantised;
use crate::sensor::Sensor;
use palmares_models::hand::Hand;
use palmares_models::{Pose, Rotation, Vec3};

/// Standard deviation of the error of the base's position along each axis, m: a third of the largest error of an
/// industrial arm as it is delivered, 0.65 mm (Slamani, Nubiola and Bonev, Industrial Robot 39(1), 2012).
const BIAS_M: f64 = 2.2e-4;
/// The same about each axis, rad: a third of 2.8 mrad (ibid.).
const BIAS_RAD: f64 = 9.3e-4;
/// Resolution of the base's pose, m and rad; chosen.
const STEP: f64 = 1e-5;

/// The arm's encoders: the error of the base's pose is drawn once a run.
#[derive(Clone)]
pub(crate) struct Arm {
    shift: Vec3,
    turn: Rotation,
    tick_s: f64,
}

impl Sensor for Arm {
    const CHANNEL: Channel = Channel {
        name: "base",
        key: "base",
        columns: &[
            Column::named("position", 3, "m", "Origin of the body frame, m."),
            Column::named("quat_xyzw", 4, "", "Orientation, x, y, z, w.").range(Range::Within(-1.0, 1.0)),
            Column::named("linear", 3, "m/s", "Velocity of the origin, m/s."),
            Column::named("angular", 3, "rad/s", "rad/s"),
        ],
        record: Some(Record {
            name: "BodyState",
            doc: "Pose and velocity of a body in the world frame.",
            row_name: None,
        }),
        telemetry: Some("/tf"),
        doc: "Pose and velocity of the base in the world frame, by the arm's encoders",
        ..Channel::NUMBERS
    };
    /// The last pose that was read.
    type State = Option<Pose>;

    fn law(now: &Moment<'_>, _: Option<&Self::State>, row: &mut [f64]) {
        write(now.base, now.linear, now.angular, row);
    }

    fn new(_: &Hand, noise: Option<&Noise>, tick_s: f64) -> Option<(Self, Self::State)> {
        let mut drawn = noise?.sensor("arm").sample(0);
        let shift = Vec3::from_array(drawn.normal3()) * BIAS_M;
        let turn = Rotation::from_scaled_axis(Vec3::from_array(drawn.normal3()) * BIAS_RAD);
        Some((Arm { shift, turn, tick_s }, None))
    }

    fn tick(&self, now: &Moment<'_>, _: u64, last: &mut Self::State, row: &mut [f64]) {
        let place = (now.base.translation + self.shift).to_array().map(|x| quantised(x, STEP));
        let pose = Pose::from_parts(Vec3::from_array(place), (self.turn * now.base.rotation).normalize());
        let linear = last.map_or(Vec3::ZERO, |last| (pose.translation - last.translation) / self.tick_s);
        let angular = now.angular.to_array().map(|x| quantised(x, STEP / self.tick_s));
        *last = Some(pose);
        write(pose, linear, Vec3::from_array(angular), row);
    }
}

fn write(pose: Pose, linear: Vec3, angular: Vec3, row: &mut [f64]) {
    row[..3].copy_from_slice(&pose.translation.to_array());
    row[3..7].copy_from_slice(&pose.rotation.to_array());
    row[7..10].copy_from_slice(&linear.to_array());
    row[10..].copy_from_slice(&angular.to_array());
}
