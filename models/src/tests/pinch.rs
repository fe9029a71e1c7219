//! The pinch hand: its pulleys determine its transmission.

use crate::hand::Hand;

/// Radii of the pulleys on the joints, m.
const BASE_PULLEY: f64 = 0.012;
const TIP_PULLEY: f64 = 0.003;
const CURL_PULLEY: f64 = 0.006;

#[test]
fn moment_arms_are_the_radii_halved_at_every_floating_pulley() {
    let hand = Hand::builtin("pinch").unwrap();
    let names: Vec<&str> = hand.coordinates.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, ["left_base", "left_tip", "right_base", "right_tip"]);
    // Two floating pulleys are between the closing motor and a joint, one between the curling motor and a
    // tip.
    let (base, tip, curl) = (BASE_PULLEY / 4.0, TIP_PULLEY / 4.0, CURL_PULLEY / 2.0);
    assert_eq!(hand.tendons[0].moment_arms, [(0, base), (1, tip), (2, base), (3, tip)]);
    assert_eq!(hand.tendons[1].moment_arms, [(1, curl), (3, curl)]);
}

#[test]
fn both_tendons_are_just_taut_when_the_motors_are_at_rest() {
    let hand = Hand::builtin("pinch").unwrap();
    let rest: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
    for tendon in &hand.tendons {
        let motor = &hand.motors[tendon.motors[0].0];
        let wound = -motor.scaling * motor.offset;
        assert!((wound - tendon.length(&rest)).abs() < 1e-15, "{}", tendon.name);
    }
}

#[test]
fn the_two_fingers_are_mirror_images() {
    let hand = Hand::builtin("pinch").unwrap();
    let poses = hand.base_from_links(&[0.3, 0.1, 0.3, 0.1]);
    for part in ["proximal", "distal"] {
        let place = |side: &str| poses[hand.link(&format!("{side}_{part}")).unwrap()].translation;
        let (left, right) = (place("left"), place("right"));
        assert!(left.y > 0.0 && (left.y + right.y).abs() < 1e-15 && (left.z - right.z).abs() < 1e-15);
    }
    // Masses are stated, inertias follow from the shapes.
    assert!(hand.links.iter().all(|link| link.inertia.implausible().is_none()));
}
