//! The SoftHand's measurements, with the standard motor and the stronger one.

use super::outcome::Effort;
use anyhow::Result;
use palmares_bench::cases::calibration::{Closed, FRICTION, close_in_air, held_torque, split_force};
use palmares_bench::measured::Measured;
use palmares_bench::recorder::Recorder;
use palmares_models::hand::Hand;
use palmares_sim::statics::equilibrium::ClosedForm;
use std::sync::Arc;

/// Frictions of the object beside the case's own 0.8, for the full page: a pair with the glove's 1.16 then has 0.68 to 1.16.
const FRICTIONS: [f64; 3] = [0.4, 0.6, 1.16];

/// The hand of this name, if it is built in.
fn hand(name: &str) -> Option<Arc<Hand>> {
    Hand::builtin(name)
}

/// The quantity with another friction of the object.
fn with_friction(measured: Measured, friction: f64) -> Measured {
    Measured { quantity: format!("{}, object's friction {friction}", measured.quantity), ..measured }
}

pub(super) fn split(effort: &Effort, name: &str) -> Result<Vec<Measured>> {
    let Some(hand) = hand(name) else { return Ok(Vec::new()) };
    let mut recorder = Recorder::default();
    let mut all = Vec::from(split_force(&effort.setup, &mut recorder, &hand, FRICTION)?);
    if !effort.few {
        for friction in FRICTIONS {
            let [measured, _] = split_force(&effort.setup, &mut recorder, &hand, friction)?;
            all.push(with_friction(measured, friction));
        }
    }
    Ok(all)
}

pub(super) fn disc(effort: &Effort, name: &str) -> Result<Vec<Measured>> {
    let Some(hand) = hand(name) else { return Ok(Vec::new()) };
    let mut recorder = Recorder::default();
    let mut all = vec![held_torque(&effort.setup, &mut recorder, &hand, FRICTION)?];
    if !effort.few {
        for friction in FRICTIONS {
            let measured = held_torque(&effort.setup, &mut recorder, &hand, friction)?;
            all.push(with_friction(measured, friction));
        }
    }
    Ok(all)
}

/// A number of the hand "softhand" alone.
fn one(quantity: &str, unit: &str, published: Option<f64>, values: &[(&str, f64)]) -> Measured {
    Measured {
        quantity: quantity.to_owned(),
        unit: unit.to_owned(),
        hand: "softhand".to_owned(),
        published,
        placements: values.iter().map(|(name, value)| ((*name).to_owned(), Some(*value))).collect(),
    }
}

fn closed(effort: &Effort) -> Result<Option<Closed>> {
    let Some(hand) = hand("softhand") else { return Ok(None) };
    Ok(Some(close_in_air(&effort.setup, &mut Recorder::default(), &hand)?))
}

pub(super) fn time(effort: &Effort) -> Result<Vec<Measured>> {
    let Some(closed) = closed(effort)? else { return Ok(Vec::new()) };
    let part = [("to 95 %", closed.to_95_s), ("to 99 %", closed.to_99_s)];
    Ok(vec![one("time from the command", "s", Some(1.1), &part)])
}

pub(super) fn power(effort: &Effort) -> Result<Vec<Measured>> {
    let Some(closed) = closed(effort)? else { return Ok(Vec::new()) };
    let mean = one("mean power until 99 % of the fist", "W", Some(6.0), &[("in air", closed.mean_w)]);
    let largest = one("largest power over 20 ms", "W", None, &[("in air", closed.largest_w)]);
    Ok(vec![mean, largest])
}

/// Largest joint error of the free hand at rest against equations 4 and 5 of Rocchi and Hauser, over σ.
pub(super) fn free_equilibrium(effort: &Effort) -> Result<Vec<Measured>> {
    let Some(hand) = hand("softhand") else { return Ok(Vec::new()) };
    let form = ClosedForm::new(&hand)?;
    let mut values = Vec::new();
    for sigma in [0.2, 0.4] {
        let expected = form.solve(&[hand.motors[0].wound(sigma)], &vec![0.0; form.rest.len()]).0;
        let rest = super::grips::rest_of(effort, &hand, &vec![sigma; hand.motors.len()])?;
        let error = rest.iter().zip(&expected).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
        values.push((format!("σ = {sigma}"), Some(error)));
    }
    Ok(vec![Measured { placements: values, ..one("largest joint error", "rad", Some(0.0), &[]) }])
}
