//! The Barrett hand: the ratio of a finger's joints in air.

use super::grips::rest_of;
use super::outcome::Effort;
use super::press::Finger;
use anyhow::{Context, Result};
use palmares_bench::measured::Measured;
use palmares_models::Vec3;

const HAND: &str = "barrett_bh282";

/// The end of an outer link, in its frame, and the radius of its capsule, m: hand.urdf. Finger 3 faces the others.
const fn finger(name: &'static str, motor: &'static str, link: &'static str, y: f64) -> Finger {
    let tip = Vec3::new(0.0, y, 0.045);
    Finger { hand: HAND, name, motor, open: &[0.0; 4], link, tip, radius_m: 0.008 }
}

/// The three fingers.
pub(super) const FINGERS: [Finger; 3] = [
    finger("finger 1", "finger_1", "outer_1", 0.0395),
    finger("finger 2", "finger_2", "outer_2", 0.0395),
    finger("finger 3", "finger_3", "outer_3", -0.0395),
];

/// Angle of the Barrett's outer joints over that of the inner ones, each finger closing in air alone.
pub(super) fn ratio(effort: &Effort) -> Result<Vec<Measured>> {
    let mut placements = Vec::new();
    for sigma in [0.2, 0.4, 0.6] {
        for (k, finger) in FINGERS.iter().enumerate() {
            let hand = finger.hand()?;
            let q = rest_of(effort, &hand, &finger.alone(&hand, sigma))?;
            let joint = |name: &str| {
                let name = format!("{name}_joint_{}", k + 1);
                Ok::<f64, anyhow::Error>(q[hand.coordinate(&name).context("a joint")?])
            };
            placements
                .push((format!("{}, σ = {sigma}", finger.name), Some(joint("outer")? / joint("inner")?)));
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
