//! The Barrett hand: the ratio of a finger's joints in air, and the force of a fingertip.

use super::grips::rest_of;
use super::outcome::Effort;
use anyhow::{Context, Result};
use palmares_bench::cases::instrument::{own, weightless};
use palmares_bench::cases::{ends_of_steps, ramp};
use palmares_bench::measured::Measured;
use palmares_models::hand::Hand;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use palmares_sim::{Command, ContactForce, Model, Owner, State};

const HAND: &str = "barrett_bh282";
const FINGERS: [usize; 3] = [1, 2, 3];
/// The end of the outer link of fingers 1 and 2, in its frame, and the radius of its capsule, m: hand.urdf. Finger 3 faces them.
const TIP: Vec3 = Vec3::new(0.0, 0.0395, 0.045);
const TIP_RADIUS_M: f64 = 0.008;
/// The sensor: a fixed smooth ball in the tip's way, m.
const BALL_M: f64 = 0.01;
/// The motor closes fully, and the sensor is read, s.
const CLOSED_S: f64 = 3.0;
const READ_S: f64 = 4.0;

/// Motors' positions with one finger closed to σ and the others open.
fn alone(hand: &Hand, finger: usize, sigma: f64) -> Vec<f64> {
    let name = format!("finger_{finger}");
    hand.motors.iter().map(|motor| if motor.name == name { sigma } else { 0.0 }).collect()
}

/// Angle of the Barrett's outer joints over that of the inner ones, each finger closing in air alone.
pub(super) fn ratio(effort: &Effort) -> Result<Vec<Measured>> {
    let hand = Hand::builtin(HAND).context("the Barrett is built in")?;
    let joint =
        |q: &[f64], name: &str| Ok::<f64, anyhow::Error>(q[hand.coordinate(name).context("a joint")?]);
    let mut placements = Vec::new();
    for sigma in [0.2, 0.4, 0.6] {
        for finger in FINGERS {
            let q = rest_of(effort, &hand, &alone(&hand, finger, sigma))?;
            let inner = joint(&q, &format!("inner_joint_{finger}"))?;
            let outer = joint(&q, &format!("outer_joint_{finger}"))?;
            placements.push((format!("finger {finger}, σ = {sigma}"), Some(outer / inner)));
        }
    }
    Ok(vec![Measured {
        quantity: "outer joint / inner joint".to_owned(),
        unit: "1".to_owned(),
        hand: HAND.to_owned(),
        published: Some(1.0 / 3.0),
        placements,
    }])
}

/// Force of the tip of each finger, which closes alone on a fixed sensor, N.
pub(super) fn fingertip(effort: &Effort) -> Result<Vec<Measured>> {
    let hand = Hand::builtin(HAND).context("the Barrett is built in")?;
    let setup = &effort.setup;
    let mut placements = Vec::new();
    for sigma in [0.2, 0.4, 0.6] {
        for finger in FINGERS {
            let end = if finger == 3 { Vec3::new(TIP.x, -TIP.y, TIP.z) } else { TIP };
            let link = hand.link(&format!("outer_{finger}")).context("an outer link")?;
            let tip = |sigma: f64| -> Result<Vec3> {
                let q = rest_of(effort, &hand, &alone(&hand, finger, sigma))?;
                Ok(hand.base_from_links(&q)[link].transform_point(end))
            };
            let at = tip(sigma)?;
            let ahead = (tip(sigma + 0.01)? - at).normalize();
            let mut model = Model::new(weightless(setup.dt_s), Some(std::sync::Arc::clone(&hand)))?;
            let centre = at + ahead * (TIP_RADIUS_M + BALL_M);
            let ball = Shape::Sphere { radius: BALL_M };
            model.add_static("sensor", &ball, Pose::from_translation(centre), 0.0)?;
            let state = State::at_rest(&model, Pose::IDENTITY, &[]);
            let mut world = setup.start(model, state)?;
            let mut command = Command::stay(world.model(), Pose::IDENTITY);
            let from = command.sigma.clone();
            for t in ends_of_steps(READ_S, setup.dt_s) {
                let part = ramp(t / CLOSED_S).0;
                for (k, closed) in alone(&hand, finger, 1.0).into_iter().enumerate() {
                    command.sigma[k] = from[k] + part * (closed - from[k]);
                }
                world.step(&command)?;
            }
            let on_sensor = |contact: &ContactForce| match (contact.a, contact.b) {
                (Owner::Static, _) | (_, Owner::Static) => Some(contact.force),
                _ => None,
            };
            let force: Vec3 = own(&*world)?.contact_forces().iter().filter_map(on_sensor).sum();
            let held = (force.length() > 0.0).then_some(force.length());
            placements.push((format!("finger {finger}, met at σ = {sigma}"), held));
        }
    }
    Ok(vec![Measured {
        quantity: "force of the tip on a fixed sensor".to_owned(),
        unit: "N".to_owned(),
        hand: HAND.to_owned(),
        published: Some(15.0),
        placements,
    }])
}
