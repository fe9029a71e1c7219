//! Warnings about a valid hand: numbers that its author hardly can have intended.

use std::path::Path;

use super::figures::{HandPart, number};
use crate::error::LoadWarning;
use crate::hand::{Hand, Link, Motor, Tendon};
use crate::shape::{Shape, inertia};

/// Stiffness below which a spring has no effect, N·m/rad.
pub const LOOSE: f64 = 1e-6;
/// Time constant of a coordinate and its spring above which it is slow, s.
const SLOW_S: f64 = 0.5;
/// Mass above which a hand on an arm is heavy, kg.
const HEAVY_KG: f64 = 5.0;
/// Size above which a link made of meshes is suspicious, m.
const LARGE_M: f64 = 0.3;
/// Plausible mass over volume of the collision shapes of a link, kg/m³: from foam around a wire to twice the
/// density of steel, because shapes are coarser than the part.
const DENSITY: std::ops::RangeInclusive<f64> = 20.0..=16_000.0;
/// Ratio of the masses of two links above which it is odd, and hard on the solver.
const MASS_RATIO: f64 = 1000.0;
/// Ratio of a motor's winding to the length that its joints can take up above which it is odd.
const WINDING: f64 = 5.0;
/// Ratio below which it is odd. Many motors wind less than their joints' whole range; a wrong unit is a factor of 50 or more.
const TOO_LITTLE: f64 = 1.0 / 30.0;

/// Warnings about the finished hand; warnings about its files are reported while reading.
pub fn oddities(hand: &Hand, file: &Path) -> Vec<LoadWarning> {
    let mut out = Vec::new();
    let mut warn = |element: String, message: String| {
        out.push(LoadWarning { file: file.to_owned(), element, message });
    };
    if hand.tendons.is_empty() {
        warn(
            "robot".into(),
            "has no AdaptiveSynergyTransmission, so no tendon and no motor: nothing moves it; \
             servo_joints = \"all\" in hand.toml gives each joint a servo"
                .into(),
        );
    }
    let closed: Vec<usize> = hand.linked_coordinates();
    let pulled = |i: usize| hand.tendons.iter().any(|t| t.coordinates().contains(&i)) || closed.contains(&i);
    let sprung = |i: usize| hand.springs.iter().any(|spring| spring.arms.iter().any(|arm| arm.0 == i));
    let driven = |i: usize| {
        hand.tendons.iter().any(|t| t.both_ways && t.coordinates().contains(&i))
            || sprung(i)
            || closed.contains(&i)
    };
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
    for (part, message) in lengths_and_masses(hand).into_iter().chain(windings(hand)) {
        warn(part.to_string(), message);
    }
    out
}

/// Sizes and masses of links that do not match.
fn lengths_and_masses(hand: &Hand) -> Vec<(HandPart, String)> {
    let mut out = Vec::new();
    for link in &hand.links {
        let part = || HandPart::Link(link.name.clone());
        let mesh = link.geoms.iter().any(|g| matches!(g.shape, Shape::Hull { .. }));
        let size = link.size().map_or(0.0, |size| size.max_element());
        if mesh && size > LARGE_M {
            let message = format!(
                "is {} m long; are its meshes in millimetres? scale=\"0.001 0.001 0.001\"",
                number(size)
            );
            out.push((part(), message));
        }
        let volume: f64 = link.geoms.iter().map(|g| inertia::volume(&g.shape)).sum();
        let density = link.inertia.mass / volume;
        if volume > 0.0 && !DENSITY.contains(&density) {
            let message = format!(
                "has {} kg/m³ over its collision shapes; water has 1000, steel 7850: is its mass or a size in another unit?",
                number(density)
            );
            out.push((part(), message));
        }
    }
    let by_mass = || hand.links.iter().filter(|link| link.inertia.mass > 0.0);
    let heavier = |a: &&Link, b: &&Link| a.inertia.mass.total_cmp(&b.inertia.mass);
    if let (Some(light), Some(heavy)) = (by_mass().min_by(heavier), by_mass().max_by(heavier)) {
        let ratio = heavy.inertia.mass / light.inertia.mass;
        if ratio > MASS_RATIO {
            let message = format!("weighs {} times less than '{}'", number(ratio.round()), heavy.name);
            out.push((HandPart::Link(light.name.clone()), message));
        }
    }
    out
}

/// Motors that wind far more or far less than the range of their tendons' joints.
fn windings(hand: &Hand) -> Vec<(HandPart, String)> {
    let taken_up = |tendon: &Tendon| -> Option<f64> {
        let ends: Option<Vec<f64>> = (0..hand.coordinates.len())
            .map(|i| {
                let c = &hand.coordinates[i];
                let used = tendon.coordinates().contains(&i);
                let range = if used { c.upper - c.lower } else { 0.0 };
                let mut arm = 0.0;
                tendon.gradient(&hand.open(), |k, r| arm += if k == i { r } else { 0.0 });
                range.is_finite().then_some(range * f64::abs(arm))
            })
            .collect();
        ends.map(|each| each.iter().sum())
    };
    let odd = |(m, motor): (usize, &Motor)| {
        let own = |t: &&Tendon| t.weight(m) != 0.0;
        let each = hand.tendons.iter().filter(own).map(|t| Some(taken_up(t)? / t.weight(m).abs()));
        let each = each.collect::<Option<Vec<f64>>>()?;
        let (least, most) =
            each.iter().fold((f64::INFINITY, 0.0), |(a, b), x| (f64::min(a, *x), f64::max(b, *x)));
        let (wound, part) = (motor.scaling.abs(), HandPart::Motor(motor.name.clone()));
        // The range of a servo is stated in the unit of its joint.
        let servo =
            hand.tendons.iter().filter(own).all(|t| t.both_ways && matches!(t.moment_arms[..], [(_, 1.0)]));
        if most > 0.0 && (wound > most * WINDING || wound < least * TOO_LITTLE && !servo) {
            let (wound, most) = (number(wound), number(if wound > most { most } else { least }));
            return Some((
                part,
                format!(
                    "winds {wound} from σ = 0 to 1; its joints take up {most} between their limits: is scaling in the unit of R?"
                ),
            ));
        }
        None
    };
    hand.motors.iter().enumerate().filter_map(odd).collect()
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
        let all = oddities(&hand, Path::new("hand.urdf"));
        all.iter().map(|w| format!("{w}\n")).collect()
    }

    #[test]
    fn the_stock_hand_needs_none_and_each_oddity_is_named() {
        assert_eq!(advised(|_| ()), "");
        let reflex = Hand::builtin("reflex").expect("it is built in");
        assert!(oddities(&reflex, Path::new("hand.urdf")).is_empty());
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
        assert!(advised(|h| h.links[5].inertia.mass = 1e-6).contains("kg/m³"));
        assert!(advised(|h| h.links[5].inertia.mass = 1e-6).contains("times less than"));
        let wound = advised(|h| h.motors[0].scaling = 1e8);
        assert!(wound.contains("actuator 'motor': winds 1e8") && wound.contains("scaling"), "{wound}");
        assert!(advised(|h| h.motors[0].scaling = 1e-3).contains("is scaling in the unit of R?"));
        // A motor that closes the hand in part, and one that also helps another by a small weight.
        assert_eq!(advised(|h| h.motors[0].scaling *= 0.1), "");
        let helps = |h: &mut Hand| {
            let helped =
                Tendon { motors: vec![(0, 0.01)], name: "helped".to_owned(), ..h.tendons[0].clone() };
            h.tendons.push(helped);
        };
        assert_eq!(advised(helps), "");
        let tip = |x: f64, y: f64, z: f64| [12.0 * x, 0.1 * y, 0.1 * z];
        let points = vec![tip(0.0, 0.0, 0.0), tip(1.0, 0.0, 0.0), tip(0.0, 1.0, 0.0), tip(0.0, 0.0, 1.0)];
        let long = advised(|h| h.links[5].geoms[0].shape = Shape::Hull { points, rounding: 0.0 });
        assert!(long.contains("is 12 m long; are its meshes in millimetres?"), "{long}");
    }
}
