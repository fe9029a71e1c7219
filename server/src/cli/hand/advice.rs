//! What a valid hand's author should know all the same.

use super::predict::LOOSE;
use palmares_models::error::LoadWarning;
use palmares_models::hand::Hand;
use std::path::Path;

/// A coordinate that takes longer than this to follow its spring is called slow, s.
const SLOW_S: f64 = 0.5;
/// More than this is heavy for a hand on an arm, kg.
const HEAVY_KG: f64 = 5.0;

/// Oddities of the finished hand, as opposed to those of its files.
pub(super) fn advice(hand: &Hand, file: &Path) -> Vec<LoadWarning> {
    let mut out = Vec::new();
    let mut warn = |element: String, message: String| {
        out.push(LoadWarning { file: file.to_owned(), element, message });
    };
    if hand.tendons.is_empty() {
        warn(
            "robot".into(),
            "has no AdaptiveSynergyTransmission, so no tendon and no motor: nothing moves it".into(),
        );
    }
    let pulled = |i: usize| hand.tendons.iter().any(|t| t.coordinates().contains(&i));
    let driven = |i: usize| hand.tendons.iter().any(|t| t.both_ways && t.coordinates().contains(&i));
    let (mut slow, mut springless) = (Vec::new(), Vec::new());
    for (i, c) in hand.coordinates.iter().enumerate() {
        if c.stiffness < LOOSE && !driven(i) {
            springless.push(c.name.as_str());
        }
        if c.stiffness > 0.0 && c.damping / c.stiffness > SLOW_S {
            slow.push(c.name.as_str());
        }
        if !pulled(i) && !hand.tendons.is_empty() {
            warn(
                format!("joint '{}'", c.name),
                "no tendon pulls on it: only contacts and its spring move it".into(),
            );
        }
        if c.lower.is_finite() && c.upper.is_finite() && !(c.lower..=c.upper).contains(&c.rest) {
            warn(
                format!("joint '{}'", c.name),
                format!("its spring rests at {}, outside its limits {} to {}", c.rest, c.lower, c.upper),
            );
        }
    }
    if !springless.is_empty() {
        warn(
            joints(&springless),
            "no spring (mechanicalElasticity, or stiffness in hand.toml): nothing opens it again, and there is no \
             closed form"
                .into(),
        );
    }
    if !slow.is_empty() {
        warn(
            joints(&slow),
            format!("damping over stiffness is more than {SLOW_S} s: opens and closes slowly"),
        );
    }
    for link in hand.links.iter().skip(1).filter(|link| link.geoms.is_empty()) {
        warn(format!("link '{}'", link.name), "has no collision shape: it touches nothing".into());
    }
    let mass: f64 = hand.links.iter().map(|l| l.inertia.mass).sum();
    if mass > HEAVY_KG {
        warn("robot".into(), format!("weighs {mass:.3} kg; is a mass in grams?"));
    }
    out
}

fn joints(names: &[&str]) -> String {
    let shown = names.iter().take(3).map(|n| format!("'{n}'")).collect::<Vec<_>>().join(", ");
    match names.len() {
        1 => format!("joint {shown}"),
        n if n <= 3 => format!("joints {shown}"),
        n => format!("joints {shown} and {} more", n - 3),
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn advised(change: impl FnOnce(&mut Hand)) -> String {
        let mut hand = Hand::clone(&Hand::builtin("softhand").expect("it is built in"));
        change(&mut hand);
        let all = advice(&hand, Path::new("hand.urdf"));
        all.iter().map(|w| format!("{w}\n")).collect()
    }

    #[test]
    fn the_stock_hand_needs_none_and_each_oddity_is_named() {
        assert_eq!(advised(|_| ()), "");
        let reflex = Hand::builtin("reflex").expect("it is built in");
        assert!(advice(&reflex, Path::new("hand.urdf")).is_empty());
        assert!(advised(|h| h.tendons.clear()).contains("hand.urdf: robot: has no AdaptiveSynergy"));
        let one = advised(|h| {
            h.tendons[0].moment_arms.remove(2);
        });
        assert!(one.contains("joint 'thumb_outer': no tendon"), "{one}");
        let springless = advised(|h| h.coordinates[5].stiffness = 0.0);
        assert!(springless.contains("no closed form"), "{springless}");
        let slow = advised(|h| h.coordinates.iter_mut().for_each(|c| c.damping = 1.0));
        assert!(slow.contains("and 16 more: damping over stiffness"), "{slow}");
        assert!(advised(|h| h.coordinates[0].rest = -1.0).contains("outside its limits"));
        assert!(advised(|h| h.links[3].geoms.clear()).contains("touches nothing"));
        assert!(advised(|h| h.links[0].inertia.mass = 600.0).contains("grams?"));
    }
}
