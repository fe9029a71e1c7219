//! The force of a fingertip: one finger closes alone on a fixed smooth sensor.

use super::grips::rest_of;
use super::outcome::Effort;
use anyhow::{Context, Result};
use palmares_bench::cases::instrument::{own, weightless};
use palmares_bench::cases::{ends_of_steps, ramp};
use palmares_bench::measured::{Measured, Spread};
use palmares_models::hand::Hand;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use palmares_sim::{Command, ContactForce, Model, Owner, State};
use std::sync::Arc;

/// The sensor: a fixed smooth ball in the tip's way, m.
const BALL_M: f64 = 0.01;
/// The motor closes fully, and the sensor is read, s.
const CLOSED_S: f64 = 3.0;
const READ_S: f64 = 4.0;
/// Commands σ at which the tip meets the sensor.
const MET: [f64; 3] = [0.2, 0.4, 0.6];
/// Parts of the largest force that the motor may use in a run against the command.
const PARTS: usize = 10;

/// A finger, its motor, and the point that meets the sensor.
pub(super) struct Finger {
    pub(super) hand: &'static str,
    pub(super) name: &'static str,
    pub(super) motor: &'static str,
    /// Commands of all motors with the hand open; the finger's own goes on to 1.
    pub(super) open: &'static [f64],
    pub(super) link: &'static str,
    /// In the link's frame, m: the centre of a round tip of this radius, or a point of a flat one with radius 0.
    pub(super) tip: Vec3,
    pub(super) radius_m: f64,
}

impl Finger {
    /// The built-in hand.
    pub(super) fn hand(&self) -> Result<Arc<Hand>> {
        Hand::builtin(self.hand).with_context(|| format!("{} is built in", self.hand))
    }

    /// Commands of all motors with this finger closed to σ.
    pub(super) fn alone(&self, hand: &Hand, sigma: f64) -> Vec<f64> {
        let command = |(motor, open): (&palmares_models::hand::Motor, &f64)| {
            if motor.name == self.motor { sigma } else { *open }
        };
        hand.motors.iter().zip(self.open).map(command).collect()
    }
}

/// Force on the sensor, which the tip meets at σ = `met`, with this part of the motor's largest force, N.
fn force(effort: &Effort, hand: &Arc<Hand>, finger: &Finger, met: f64, part: f64) -> Result<Option<f64>> {
    let link = hand.link(finger.link).with_context(|| format!("a link {}", finger.link))?;
    let tip = |sigma: f64| -> Result<Vec3> {
        let q = rest_of(effort, hand, &finger.alone(hand, sigma))?;
        Ok(hand.base_from_links(&q)[link].transform_point(finger.tip))
    };
    let at = tip(met)?;
    let ahead = (tip(met + 0.01)? - at).normalize();
    let mut model = Model::new(weightless(effort.setup.dt_s), Some(Arc::clone(hand)))?;
    let ball = Shape::Sphere { radius: BALL_M };
    model.add_static(
        "sensor",
        &ball,
        Pose::from_translation(at + ahead * (finger.radius_m + BALL_M)),
        0.0,
    )?;
    let state = State::at_rest(&model, Pose::IDENTITY, &[]);
    let mut world = effort.setup.start(model, state)?;
    let mut command = Command::stay(world.model(), Pose::IDENTITY);
    command.effort = vec![part; hand.motors.len()];
    let (from, to) = (command.sigma.clone(), finger.alone(hand, 1.0));
    for t in ends_of_steps(READ_S, effort.setup.dt_s) {
        let closed = ramp(t / CLOSED_S).0;
        for (sigma, (from, to)) in command.sigma.iter_mut().zip(from.iter().zip(&to)) {
            *sigma = from + closed * (to - from);
        }
        world.step(&command)?;
    }
    let on_sensor = |contact: &ContactForce| match (contact.a, contact.b) {
        (Owner::Static, _) | (_, Owner::Static) => Some(contact.force),
        _ => None,
    };
    let sum: Vec3 = own(&*world)?.contact_forces().iter().filter_map(on_sensor).sum();
    Ok((sum.length() > 0.0).then_some(sum.length()))
}

/// Force of each finger's tip with the full command, N.
pub(super) fn full(effort: &Effort, fingers: &[Finger], published: f64) -> Result<Vec<Measured>> {
    let mut placements = Vec::new();
    for met in MET {
        for finger in fingers {
            let value = force(effort, &finger.hand()?, finger, met, 1.0)?;
            placements.push((format!("{}, met at σ = {met}", finger.name), value));
        }
    }
    let hand = fingers.first().context("a finger")?.hand;
    Ok(vec![Measured {
        quantity: "force of the tip on a fixed sensor".to_owned(),
        unit: "N".to_owned(),
        hand: hand.to_owned(),
        published: Some(published),
        placements,
    }])
}

/// The force with the full command in the middle place, N, for a hand with other numbers.
pub(super) fn middle(effort: &Effort, hand: &Arc<Hand>, finger: &Finger) -> Result<Option<f64>> {
    force(effort, hand, finger, MET[1], 1.0)
}

/// A straight line through forces over commands: N a unit of the command, N, and the part of the variance that it explains.
#[derive(Clone, Copy, Debug)]
pub(super) struct Line {
    pub(super) slope: f64,
    pub(super) offset: f64,
    pub(super) explained: f64,
}

impl Line {
    /// By least squares.
    fn of(points: &[(f64, f64)]) -> Option<Line> {
        let mean = |of: fn(&(f64, f64)) -> f64| Some(Spread::of(points.iter().map(of))?.mean);
        let (x, y) = (mean(|p| p.0)?, mean(|p| p.1)?);
        let sum = |of: &dyn Fn(&(f64, f64)) -> f64| points.iter().map(of).sum::<f64>();
        let (xx, xy) = (sum(&|p| (p.0 - x).powi(2)), sum(&|p| (p.0 - x) * (p.1 - y)));
        let slope = xy / xx;
        let offset = y - slope * x;
        let (rest, all) = (sum(&|p| (p.1 - offset - slope * p.0).powi(2)), sum(&|p| (p.1 - y).powi(2)));
        (xx > 0.0 && all > 0.0).then_some(Line { slope, offset, explained: 1.0 - rest / all })
    }
}

/// Force of a finger's tip with the full command, and the line of force over the command `r` from 0 to 1000, the part of the largest
/// force; `theirs` is the published line.
pub(super) fn against_command(effort: &Effort, finger: &Finger, theirs: Line) -> Result<Vec<Measured>> {
    let hand = finger.hand()?;
    let mut all = full(effort, std::slice::from_ref(finger), 1e3 * theirs.slope + theirs.offset)?;
    let mut points = Vec::new();
    let parts = if effort.few { 2 } else { PARTS };
    for k in 1..=parts {
        let part = k as f64 / parts as f64;
        points.extend(force(effort, &hand, finger, MET[1], part)?.map(|force| (1e3 * part, force)));
    }
    let ours = Line::of(&points);
    let one = |quantity: &str, unit: &str, published: f64, of: fn(Line) -> f64| Measured {
        quantity: quantity.to_owned(),
        unit: unit.to_owned(),
        hand: finger.hand.to_owned(),
        published: Some(published),
        placements: vec![(format!("{parts} commands, met at σ = {}", MET[1]), ours.map(of))],
    };
    all.push(one("slope of the force over the command of 0 to 1000", "N", theirs.slope, |line| line.slope));
    all.push(one("force of the line at no command", "N", theirs.offset, |line| line.offset));
    all.push(one("R² of the line", "1", theirs.explained, |line| line.explained));
    Ok(all)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_line_through_points_on_it_explains_all_and_one_through_others_less() {
        let line = Line::of(&[(0.0, 1.0), (1.0, 3.0), (2.0, 5.0)]).expect("points");
        assert!((line.slope - 2.0).abs() < 1e-12 && (line.offset - 1.0).abs() < 1e-12, "{line:?}");
        assert!((line.explained - 1.0).abs() < 1e-12, "{line:?}");
        let bent = Line::of(&[(0.0, 1.0), (1.0, 4.0), (2.0, 5.0)]).expect("points");
        assert!((bent.explained - (1.0 - 2.0 / 3.0 / (26.0 / 3.0))).abs() < 1e-12, "{bent:?}");
        assert!(Line::of(&[(1.0, 2.0)]).is_none());
    }
}
