//! Figures of hands with known numbers.

use std::path::Path;

use crate::builtin::builtin_hands;
use crate::hand::Hand;
use crate::measure::{HandLimits, SPECS, Sources, number};

use super::hostile_hands::{SETTINGS, URDF, read};

fn value(hand: &Hand, name: &str) -> f64 {
    let figures = hand.figures();
    figures.iter().find(|f| f.spec.name == name).unwrap_or_else(|| panic!("no {name}")).value
}

#[track_caller]
fn near(found: f64, expected: f64) {
    assert!((found - expected).abs() < 1e-9 * (1.0 + expected.abs()), "{found}, not {expected}");
}

#[test]
fn a_small_hand_by_hand() {
    let hand = read(URDF, SETTINGS).hand;
    // From the palm's underside at −0.02 to the capsule's end, slid out by nothing: 0.04 + 0.01 + 0.03 + 0.02 + 0.01.
    near(value(&hand, "size_m"), 0.02 + 0.11);
    // Slid out by 20 mm.
    near(value(&hand, "reach_m"), 0.13);
    near(value(&hand, "link_size_m"), 0.08);
    near(value(&hand, "mass_kg"), 0.37);
    near(value(&hand, "link_mass_kg"), 0.3);
    near(value(&hand, "least_link_mass_kg"), 0.02);
    // Steiner: 20 g at 30 mm.
    near(value(&hand, "least_joint_inertia_kgm2"), 1e-5 + 0.02 * 0.03 * 0.03);
    near(value(&hand, "joint_range_rad"), 1.0);
    near(value(&hand, "joint_stroke_m"), 0.02);
    near(value(&hand, "joint_torque_nm"), 2.0);
    near(value(&hand, "slide_force_n"), 4.0);
    near(value(&hand, "motor_power_w"), 4.0);
    let pi = std::f64::consts::PI;
    let capsule = pi * 1e-4 * 0.04 + 4.0 / 3.0 * pi * 1e-6;
    let sphere = 4.0 / 3.0 * pi * 0.015 * 0.015 * 0.015;
    near(value(&hand, "volume_m3"), 0.08 * 0.08 * 0.04 + sphere + capsule);
}

#[test]
fn a_mimic_moves_by_its_ratio() {
    let urdf = URDF.replace(
        "<limit lower=\"0\" upper=\"0.02\" effort=\"1\" velocity=\"1\"/></joint>",
        "<limit lower=\"0\" upper=\"0.02\" effort=\"1\" velocity=\"1\"/><mimic joint=\"bend\" multiplier=\"0.01\"/></joint>",
    );
    assert_ne!(urdf, URDF);
    let settings = SETTINGS.replace("[coordinates.slide]\nstiffness = 200.0\ndamping = 5.0\n", "");
    let hand = read(&urdf, &settings).hand;
    assert_eq!(hand.coordinates.len(), 1);
    // The carriage's 70 g go 10 mm for each radian; the range is 1 rad, so the stroke is 10 mm.
    near(value(&hand, "joint_stroke_m"), 0.01);
    // The coordinate is the radian of the leader, whatever follows it.
    assert!(!hand.slides(0));
}

/// `cargo test -p palmares-models figures -- --nocapture` prints the table.
#[test]
fn hands_of_the_program_are_within_the_defaults() {
    let hands = builtin_hands();
    for (k, spec) in SPECS.iter().enumerate() {
        let cells: Vec<String> = hands
            .iter()
            .map(|hand| {
                let figures = hand.figures();
                let found = figures.iter().find(|f| f.spec.name == spec.name);
                found.map_or("-".to_owned(), |f| number(f.value))
            })
            .collect();
        println!(
            "{k:2} {:28} {:>8} {} limit {} {}",
            spec.name,
            spec.unit,
            cells.join(" | "),
            number(spec.default),
            spec.what
        );
    }
    for hand in hands {
        let excesses =
            HandLimits::default().excesses(&hand.figures(), &Sources::of_urdf(Path::new("hand.urdf")));
        assert_eq!(excesses, vec![], "{}", hand.name);
    }
}

#[test]
fn numbers_are_short() {
    for (x, text) in [
        (0.0, "0"),
        (1.0, "1"),
        (0.28 + 1e-17, "0.28"),
        (29.845_2, "29.845"),
        (16_193.283_4, "16193"),
        (1e5, "100000"),
        (1e9, "1e9"),
        (1e-300, "1e-300"),
        (1.189e-5, "1.189e-5"),
        (f64::INFINITY, "inf"),
    ] {
        assert_eq!(number(x), text);
    }
}

/// The guides show every limit with its default.
#[test]
fn the_guide_lists_every_limit() {
    let guide = include_str!("../../../docs/organizers.md");
    for spec in SPECS {
        let begins = format!("| `{}` | {} |", spec.name, number(spec.default));
        assert!(guide.lines().any(|line| line.starts_with(&begins)), "docs/organizers.md lacks {begins}");
    }
}

/// The four-bars of the 2F-85: as its README's closed form, couplers stay at their stops and tips turn back with the drivers.
#[test]
fn a_closed_hand_keeps_its_chains_closed() {
    let hand = Hand::builtin("robotiq_2f85").unwrap();
    let closed = hand.closed();
    for pin in &hand.linkages {
        let gap = pin.at(&hand, &closed).gap.length();
        assert!(gap < 1e-9, "pin {}: {gap} m", pin.name);
    }
    for side in ["left", "right"] {
        let at = |joint: &str| closed[hand.coordinate(&format!("{side}_{joint}_joint")).unwrap()];
        assert!((at("driver") - 0.8).abs() < 1e-4 && at("coupler").abs() < 1e-3, "{closed:?}");
        assert!((at("knuckle") - 0.8).abs() < 0.01 && (at("tip") + 0.77).abs() < 0.01, "{closed:?}");
    }
}
