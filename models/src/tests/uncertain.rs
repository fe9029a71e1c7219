//! `[uncertain]` of `hand.toml`, and hands drawn from it.

use crate::builtin::{builtin_hands, builtin_texts, builtin_variant};
use crate::hand::Hand;
use crate::hand::uncertain::{HandQuantity, Range};
use crate::read::{self, LoadOptions};
use std::path::Path;

/// A built-in hand with another table `[uncertain]`.
fn hand(name: &str, entries: &str) -> Result<Hand, String> {
    with_settings(name, &builtin_texts(name).unwrap().1, entries)
}

fn with_settings(name: &str, settings: &str, entries: &str) -> Result<Hand, String> {
    let (urdf, _) = builtin_texts(name).unwrap();
    let mut settings: toml::Table = settings.parse().unwrap();
    settings.insert("uncertain".into(), entries.parse::<toml::Table>().unwrap().into());
    let files = (Path::new("hand.urdf"), Path::new("hand.toml"));
    let text = settings.to_string();
    read::from_text((files.0, urdf), Some((files.1, &text)), None, &LoadOptions::default())
        .map(|loaded| loaded.hand)
        .map_err(|error| error.to_string())
}

#[test]
fn every_hand_after_a_real_one_says_what_is_uncertain_and_is_sound_at_all_ends() {
    for hand in builtin_hands() {
        assert_eq!(hand.uncertain.is_empty(), hand.name == "pinch", "{}", hand.name);
        for corner in 0..1_usize << hand.uncertain.len() {
            let end =
                |(k, entry): (usize, &crate::hand::Uncertain)| Some(entry.range.ends()[corner >> k & 1]);
            let numbers: Vec<Option<f64>> = hand.uncertain.iter().enumerate().map(end).collect();
            let drawn = hand.drawn(&numbers).unwrap();
            assert!(hand.uncertain.is_empty() || drawn.content_hash() != hand.content_hash());
        }
    }
}

#[test]
fn a_hand_is_the_same_with_other_ranges() {
    let (narrow, wide) = ("friction = { factor = [0.9, 1.1] }", "friction = { factor = [0.5, 2] }");
    let [none, narrow, wide] = ["", narrow, wide].map(|entries| hand("reflex", entries).unwrap());
    let builtin = Hand::builtin("reflex").unwrap();
    assert!([&none, &narrow, &wide].iter().all(|hand| hand.content_hash() == builtin.content_hash()));
    assert_ne!(narrow.uncertain_hash(), wide.uncertain_hash());
    assert_ne!(narrow.uncertain_hash(), none.uncertain_hash());
}

#[test]
fn factors_of_one_are_the_hand_itself() {
    for hand in builtin_hands() {
        let ones = vec![Some(1.0); hand.uncertain.len()];
        assert_eq!(hand.drawn(&ones).unwrap().content_hash(), hand.content_hash(), "{}", hand.name);
    }
}

#[test]
fn each_number_goes_where_it_belongs() {
    let all = r#"
        damping = { factor = [0.5, 2] }
        distal = { of = "moment_arms", joints = ["distal_1", "distal_3"], factor = [0.5, 2] }
        force_limit = { tendons = ["finger_2"], factor = [0.5, 2] }
        friction = { value = [0.2, 0.9] }
        speed_limit = { motors = ["preshape"], factor = [0.5, 2] }
        stiffness = { factor = [0.5, 2] }
        tendon_stiffness = { tendons = ["preshape"], factor = [0.5, 2] }
    "#;
    let own = hand("reflex", all).unwrap();
    let names: Vec<&str> = own.uncertain.iter().map(|entry| entry.name.as_str()).collect();
    assert_eq!(
        names,
        ["damping", "distal", "force_limit", "friction", "speed_limit", "stiffness", "tendon_stiffness"]
    );
    let drawn = own.drawn(&[1.1, 1.2, 1.3, 0.4, 1.4, 1.5, 1.6].map(Some)).unwrap();
    for (c, was) in drawn.coordinates.iter().zip(&own.coordinates) {
        assert_eq!((c.damping, c.stiffness), (1.1 * was.damping, 1.5 * was.stiffness), "{}", c.name);
        assert_eq!((c.rest, c.lower, c.upper), (was.rest, was.lower, was.upper));
    }
    let some = own.drawn(&[None, None, Some(1.3), None, None, None, None]).unwrap();
    assert_eq!(
        (some.tendons[1].force_limit, some.coordinates[1].damping),
        (1.3 * own.tendons[1].force_limit, own.coordinates[1].damping)
    );
    assert!(drawn.links.iter().flat_map(|link| &link.geoms).all(|geom| geom.friction == 0.4));
    let speeds: Vec<f64> = drawn.motors.iter().map(|motor| motor.speed_limit).collect();
    assert_eq!(speeds, [0.9375, 0.9375, 0.9375, 1.4 * 1.9]);
    let [first, second, third, preshape] = &drawn.tendons[..] else { panic!("four tendons") };
    let was = &own.tendons;
    assert_eq!((second.force_limit, first.force_limit), (1.3 * was[1].force_limit, was[0].force_limit));
    assert_eq!((preshape.stiffness, preshape.damping), (160.0, 1.6));
    let q: Vec<f64> = own.coordinates.iter().map(|c| c.rest + 0.7).collect();
    let arms = |hand: &Hand| hand.moment_arms(&q);
    let (new, old) = (arms(&drawn), arms(&own));
    for (k, finger) in [first, second, third].into_iter().enumerate() {
        for (c, coordinate) in own.coordinates.iter().enumerate() {
            let factor = if ["distal_1", "distal_3"].contains(&coordinate.name.as_str()) { 1.2 } else { 1.0 };
            assert!((new[k][c] - factor * old[k][c]).abs() < 1e-12, "{} at {}", finger.name, coordinate.name);
        }
    }
}

#[test]
fn a_stronger_drive_stalls_at_a_larger_load() {
    let own =
        hand("yale_t42", "grip = { of = \"force_limit\", tendons = [\"left_tendon\"], factor = [0.5, 2] }")
            .unwrap();
    let drawn = own.drawn(&[Some(1.5)]).unwrap();
    assert_eq!(own.motors[0].stall_force, Some(250.0));
    let stalls: Vec<_> = drawn.motors.iter().map(|motor| motor.stall_force).collect();
    assert_eq!(stalls, [Some(375.0), Some(250.0)]);
    assert_eq!((drawn.tendons[0].force_limit, drawn.tendons[1].force_limit), (120.0, 80.0));
}

#[test]
fn a_cable_rubs_within_its_range() {
    let (settings, _) = builtin_variant("softhand", "rubbing").unwrap();
    let rubbing = |entries: &str| with_settings("softhand", &settings, entries);
    let own = rubbing("tendon_friction = { value = [0.0, 0.2] }").unwrap();
    let coefficients =
        |hand: &Hand| hand.tendons[0].guides.iter().map(|guide| guide.friction).collect::<Vec<_>>();
    assert_eq!(coefficients(&own), [0.1; 19]);
    assert_eq!(coefficients(&own.drawn(&[Some(0.2)]).unwrap()), [0.2; 19]);
    assert_eq!(own.drawn(&[Some(0.0)]).unwrap().friction_places(), 0);
    let twice = rubbing("tendon_friction = { factor = [0.5, 2.0] }").unwrap();
    assert_eq!(coefficients(&twice.drawn(&[Some(2.0)]).unwrap()), [0.2; 19]);
    for (hand, expected) in [
        (rubbing("tendon_friction = { value = [-0.1, 0.2] }"), "has value [-0.1, 0.2]"),
        (
            rubbing("tendon_friction = { value = [0.0, 2.0] }"),
            "lets friction times wrap angle along a tendon sum up to 7.6",
        ),
        (
            hand("softhand", "tendon_friction = { factor = [0.5, 2.0] }"),
            "is of tendon_friction, and the hand has none",
        ),
    ] {
        let error = hand.expect_err(expected);
        assert!(error.contains(expected), "{error}");
    }
}

/// s and R change together, and the open hand's tendon stays as taut as it was.
#[test]
fn lengths_follow_their_arms_and_the_open_hand_stays_taut() {
    for hand in builtin_hands().iter().filter(|hand| !hand.uncertain.is_empty()) {
        let numbers: Vec<_> = hand.uncertain.iter().map(|entry| Some(entry.range.at(0.9))).collect();
        let drawn = hand.drawn(&numbers).unwrap();
        let mut rest: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
        hand.close_chains(&mut rest);
        let h = 1e-6;
        for (k, (tendon, was)) in drawn.tendons.iter().zip(&hand.tendons).enumerate() {
            let slack = |t: &crate::hand::Tendon| t.wound(&hand.motors, |_| 0.0) - t.length(&rest);
            assert!((slack(tendon) - slack(was)).abs() < 1e-12, "{}: {}", hand.name, tendon.name);
            for c in tendon.coordinates() {
                let at = |by: f64| {
                    let mut q = rest.clone();
                    q[c] += 0.3 + by;
                    q
                };
                let slope = (tendon.length(&at(h)) - tendon.length(&at(-h))) / (2.0 * h);
                let arm = drawn.moment_arms(&at(0.0))[k][c];
                assert!((slope - arm).abs() < 1e-6 * (1.0 + arm.abs()), "{}: {slope} {arm}", hand.name);
            }
        }
    }
}

#[test]
fn parts_of_a_range() {
    let factor = Range::Factor([0.5, 2.0]);
    assert_eq!((factor.at(0.0), factor.at(1.0)), (0.5, 2.0));
    assert!((factor.at(0.5) - 1.0).abs() < 1e-15);
    assert_eq!(Range::Value([0.5, 2.0]).at(0.5), 1.25);
}

#[test]
fn numbers_outside_of_their_ranges_are_refused() {
    let hand = hand("reflex", "friction = { factor = [0.9, 1.1] }").unwrap();
    for (numbers, expected) in [
        (&[][..], "0 numbers for 1"),
        (&[Some(1.2)], "friction 1.2 is not from 0.9 to 1.1"),
        (&[Some(f64::NAN)], "NaN"),
    ] {
        let error = hand.drawn(numbers).expect_err(expected).to_string();
        assert!(error.contains(expected), "{error}");
    }
}

#[test]
fn entries_that_are_none_are_refused() {
    let known = HandQuantity::ALL.iter().map(|of| of.name()).collect::<Vec<_>>().join(", ");
    for (entries, expected) in [
        ("friction = { factor = [1.1, 1.2] }", "[uncertain] friction: has factor [1.1, 1.2]"),
        ("friction = { factor = [0.9, 11] }", "high from 1 to 10"),
        ("friction = { factor = [nan, 2] }", "has factor [NaN, 2]"),
        ("friction = { factor = [1, 1] }", "has factor [1, 1]"),
        ("friction = { factor = [1, 2], value = [1, 2] }", "has not one range"),
        ("friction = { }", "has not one range"),
        ("friction = { factor = [1, 2, 3] }", "a list of 2"),
        ("friction = { value = [-0.1, 0.5] }", "has value [-0.1, 0.5]"),
        ("force_limit = { value = [0, 1] }", "has value [0, 1]"),
        ("moment_arms = { value = [1, 2] }", "arms differ from joint to joint"),
        (
            "slip = { factor = [0.9, 1.1] }",
            &*format!("[uncertain] slip: does not say of what; valid: `of` with one of: {known}"),
        ),
        ("pose = { of = \"friction\", factor = [0.9, 1.1] }", "has a name that is not valid"),
        ("A = { of = \"friction\", factor = [0.9, 1.1] }", "has a name that is not valid"),
        (
            "friction = { joints = [\"distal_1\"], factor = [0.9, 1.1] }",
            "has `joints`, and friction is of links",
        ),
        ("friction = { links = [\"nail\"], factor = [0.9, 1.1] }", "names 'nail'"),
        ("friction = { links = [], factor = [0.9, 1.1] }", "has an empty list of links"),
        (
            "stiffness = { joints = [\"preshape_1\"], factor = [0.9, 1.1] }",
            "names 'preshape_1', which has no stiffness",
        ),
        (
            "stiffness = { factor = [0.9, 1.1] }\ntips = { of = \"stiffness\", joints = [\"distal_1\"], factor = [0.9, 1.1] }",
            "[uncertain] tips: has the stiffness that 'stiffness' has",
        ),
    ] {
        let error = hand("reflex", entries).expect_err(entries);
        assert!(error.contains(expected), "{entries}: {error}");
    }
}
