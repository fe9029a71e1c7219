//! The hands after published ones: their pages, and the numbers that their pages state.

use crate::builtin::{builtin_hands, grasped, sources};
use crate::hand::{CoordinateNumbers, Hand, MotorNumbers, TendonNumbers};
use std::collections::BTreeSet;
use std::path::Path;

/// Hands whose tests are in files of their own, and their variants.
const OTHERS: [&str; 5] = ["softhand", "softhand_skin", "softhand_strong", "reflex", "pinch"];

fn zoo() -> impl Iterator<Item = &'static Hand> {
    builtin_hands().iter().map(|hand| &**hand).filter(|hand| !OTHERS.contains(&hand.name.as_str()))
}

#[test]
fn every_hand_has_a_page_with_sources_licence_recipe_and_picture() {
    for hand in zoo() {
        let folder = Path::new(env!("CARGO_MANIFEST_DIR")).join("hands").join(&hand.name);
        let page = std::fs::read_to_string(folder.join("README.md")).unwrap();
        for part in
            ["\n## Sources\n", "\n**Licence.**", "guess", "\n## Free motion\n", "\n## Grasp\n", "](hand.svg)"]
        {
            assert!(page.contains(part), "{}: README.md has no {part:?}", hand.name);
        }
        assert!(folder.join("hand.svg").is_file(), "{}", hand.name);
        assert!(!sources(&hand.name).is_empty(), "{}", hand.name);
    }
}

#[test]
fn every_hand_has_a_measured_grasp() {
    for hand in builtin_hands() {
        let found = grasped(&hand.name).unwrap_or_else(|| panic!("grasps.toml has no {}", hand.name));
        let objects: BTreeSet<&String> = found.held.iter().chain(&found.not_held).collect();
        assert_eq!(objects.len(), 11, "{}: {found:?}", hand.name);
        assert!(found.mean > 0.0 && found.mean <= 10.0 && !found.held.is_empty(), "{}: {found:?}", hand.name);
    }
    assert!(sources("softhand").len() >= 3, "{:?}", sources("softhand"));
    assert!(sources("pinch").is_empty());
}

/// Name; coordinates; motors; mass, kg; number of tendons. From the tables of the pages.
const NUMBERS: &[(&str, usize, usize, f64, usize)] = &[
    ("yale_t42", 4, 2, 0.426, 2),
    ("yale_model_o", 7, 4, 0.74, 4),
    ("rbo2", 27, 7, 0.172, 7),
    ("allegro", 16, 16, 0.955, 16),
    ("leap", 16, 16, 0.746, 16),
    ("inspire_rh56", 6, 6, 0.530, 6),
    ("barrett_bh282", 7, 4, 0.980, 7),
    ("shadow", 24, 20, 3.794, 20),
    ("softhand2", 19, 2, 0.740, 2),
    ("robotiq_3f", 10, 4, 2.250, 4),
    ("robotiq_2f85", 8, 1, 0.900, 1),
    ("ihy", 7, 5, 1.250, 5),
];

#[test]
fn hands_have_the_numbers_of_their_pages() {
    assert_eq!(zoo().count(), NUMBERS.len());
    for (hand, (name, joints, motors, mass_kg, tendons)) in zoo().zip(NUMBERS) {
        let found = (hand.name.as_str(), hand.coordinates.len(), hand.motors.len(), hand.tendons.len());
        assert_eq!(found, (*name, *joints, *motors, *tendons));
        let mass: f64 = hand.links.iter().map(|link| link.inertia.mass).sum();
        assert!((mass - mass_kg).abs() < 5e-4, "{name}: {mass} kg");
        assert!(hand.links.iter().all(|link| link.inertia.implausible().is_none()), "{name}");
    }
}

#[test]
fn the_t42_has_one_tendon_a_finger_which_is_just_taut_at_the_start() {
    let hand = Hand::builtin("yale_t42").unwrap();
    assert_eq!(hand.tendons[0].moment_arms, [(0, 0.0105), (1, 0.0055)]);
    assert_eq!(hand.tendons[1].moment_arms, [(2, 0.0105), (3, 0.0055)]);
    let rest: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
    for (tendon, motor) in hand.tendons.iter().zip(&hand.motors) {
        assert!((-motor.scaling * motor.offset - tendon.length(&rest)).abs() < 1e-7, "{}", tendon.name);
    }
}

#[test]
fn the_fingers_of_the_model_o_are_alike_and_its_swivels_mirror_each_other() {
    let hand = Hand::builtin("yale_model_o").unwrap();
    for finger in &hand.tendons[..3] {
        assert_eq!(finger.moment_arms.iter().map(|(_, arm)| *arm).collect::<Vec<_>>(), [0.0095, 0.006]);
    }
    let mut q = vec![0.0; 7];
    let swivel = hand.coordinates.iter().position(|c| c.name == "swivel_joint_1").unwrap();
    q[swivel] = 0.7;
    let poses = hand.base_from_links(&q);
    let tip = |k: usize| poses[hand.link(&format!("distal_{k}")).unwrap()].translation;
    assert!(
        (tip(1).y + tip(2).y).abs() < 1e-12 && (tip(1).x - tip(2).x).abs() < 1e-12,
        "{} {}",
        tip(1),
        tip(2)
    );
}

#[test]
fn an_rbo2_finger_has_equal_hinges_which_one_channel_bends() {
    let hand = Hand::builtin("rbo2").unwrap();
    for channel in &hand.tendons {
        let (count, arm, stiffness) =
            if channel.name.starts_with("palm") { (1, 0.008, 0.5) } else { (5, 0.0022, 0.09) };
        assert_eq!(channel.moment_arms.len(), count, "{}", channel.name);
        for (c, r) in &channel.moment_arms {
            assert_eq!((*r, hand.coordinates[*c].stiffness), (arm, stiffness), "{}", channel.name);
        }
    }
}

/// A drive has R = 1, pulls and pushes, and takes its joint from the lower limit to the upper one.
#[test]
fn drives_take_their_joints_from_limit_to_limit() {
    for name in ["allegro", "leap", "inspire_rh56", "shadow"] {
        let hand = Hand::builtin(name).unwrap();
        for (tendon, motor) in hand.tendons.iter().zip(&hand.motors) {
            let [(c, r)] = tendon.moment_arms[..] else { continue };
            let joint = &hand.coordinates[c];
            assert!(tendon.both_ways && r == 1.0, "{name}: {}", tendon.name);
            let [open, closed] = [0.0, 1.0].map(|sigma| motor.scaling * (sigma - motor.offset));
            assert!((open - joint.lower).abs() < 2e-3, "{name}: {} {open} {}", joint.name, joint.lower);
            assert!((closed - joint.upper).abs() < 2e-3, "{name}: {} {closed} {}", joint.name, joint.upper);
        }
    }
}

/// The published ratios of the couplers, as the hinges of one coordinate.
#[test]
fn couplers_have_their_ratios() {
    let ratio = |name: &str, link: &str| {
        let hand = Hand::builtin(name).unwrap();
        let joint = hand.links[hand.link(link).unwrap()].joint.clone().unwrap();
        joint.hinges.iter().map(|hinge| hinge.ratio).collect::<Vec<_>>()
    };
    assert_eq!(ratio("inspire_rh56", "index_distal"), [1.06399]);
    assert_eq!(ratio("inspire_rh56", "thumb_middle"), [1.334]);
}

/// E of the pair lets the middle joint bend first.
#[test]
fn a_shadow_pair_shares_a_tendon_and_bends_in_the_middle_first() {
    let hand = Hand::builtin("shadow").unwrap();
    for finger in ["first", "middle", "ring", "little"] {
        let tendon = hand.tendons.iter().find(|tendon| tendon.name == format!("{finger}_0")).unwrap();
        let [(middle, 1.0), (outer, 1.0)] = tendon.moment_arms[..] else {
            panic!("{:?}", tendon.moment_arms)
        };
        assert_eq!(hand.coordinates[middle].name, format!("{finger}_2"));
        assert_eq!(hand.coordinates[outer].name, format!("{finger}_1"));
        assert_eq!(hand.coordinates[outer].stiffness, 20.0 * hand.coordinates[middle].stiffness);
    }
}

/// The sum of the SoftHand 2's motors closes as the SoftHand's one does; their difference moves thumb and little finger
/// in opposite directions.
#[test]
fn the_softhand_2_has_two_synergies_over_two_motors() {
    let (hand, one) = (Hand::builtin("softhand2").unwrap(), Hand::builtin("softhand").unwrap());
    assert_eq!(format!("{:?}", hand.coordinates), format!("{:?}", one.coordinates));
    let named = |name: &str| hand.tendons.iter().find(|tendon| tendon.name == name).unwrap();
    let (close, slide) = (named("close"), named("slide"));
    assert_eq!(close.moment_arms, one.tendons[0].moment_arms);
    assert_eq!(close.motors.iter().map(|(_, weight)| *weight).collect::<Vec<_>>(), [0.5, 0.5]);
    let weights: Vec<f64> = slide.motors.iter().map(|(_, weight)| *weight).collect();
    assert_eq!((weights[0], weights[0] + weights[1]), (0.33, 0.0));
    let arm = |joint: &str| {
        let c = hand.coordinates.iter().position(|c| c.name == joint).unwrap();
        slide.moment_arms.iter().find(|(coordinate, _)| *coordinate == c).map(|(_, arm)| *arm)
    };
    assert_eq!(arm("thumb_inner"), Some(1.0));
    assert_eq!(arm("middle_inner"), None);
    assert_eq!(arm("little_inner"), Some(-1.0));
}

#[test]
fn the_bars_of_the_3f_keep_its_tips_parallel_and_the_chains_of_the_2f85_close() {
    let hand = Hand::builtin("robotiq_3f").unwrap();
    assert_eq!(hand.springs.len(), 3);
    for bars in &hand.springs {
        assert_eq!(bars.arms.iter().map(|(_, r)| *r).collect::<Vec<_>>(), [1.0, 1.0]);
    }
    let hand = Hand::builtin("robotiq_2f85").unwrap();
    assert_eq!(hand.linkages.len(), 2);
    for pin in &hand.linkages {
        assert!(pin.at(&hand, &[0.0; 8]).gap.length() < 1e-9, "{}", pin.name);
    }
}

/// θ of a motor in rad: the inner joint is at θ/125, the sum of both at θ/93.75; a clutch and worms.
#[test]
fn a_barrett_finger_has_the_published_gears_and_a_clutch() {
    let hand = Hand::builtin("barrett_bh282").unwrap();
    for k in 1..=3 {
        let named = |name: String| hand.tendons.iter().find(|tendon| tendon.name == name).unwrap();
        let (inner, outer) = (named(format!("inner_{k}")), named(format!("outer_{k}")));
        assert!(inner.breakaway && inner.hold_limit.is_some() && !outer.breakaway);
        let [(motor, 1.0)] = inner.motors[..] else { panic!("{:?}", inner.motors) };
        let [(same, weight)] = outer.motors[..] else { panic!("{:?}", outer.motors) };
        assert!(same == motor && (weight - 125.0 / 93.75).abs() < 1e-12, "{weight}");
        assert_eq!((inner.moment_arms.len(), outer.moment_arms.len()), (1, 2));
    }
}

#[test]
fn the_guide_shows_a_whole_hand_toml_of_at_most_30_lines() {
    let guide = include_str!("../../../docs/hands.md");
    let settings = include_str!("../../hands/yale_t42/hand.toml");
    assert!(settings.lines().count() <= 30);
    assert!(guide.contains(settings));
}

/// The guide has a row for each number, in the table of its part, with its unit.
#[test]
fn the_guide_has_each_number_with_its_unit() {
    let guide = include_str!("../../../docs/hands.md");
    for (table, rows) in [
        ("[motors.NAME]", MotorNumbers::ROWS),
        ("[tendons.NAME]", TendonNumbers::ROWS),
        ("[coordinates.JOINT]", CoordinateNumbers::ROWS),
    ] {
        let mut lines = guide.lines().skip_while(|line| !(line.starts_with("| `[") && line.contains(table)));
        lines.next();
        let section: Vec<&str> = lines.take_while(|line| !line.starts_with("| `[")).collect();
        for number in rows {
            let row = format!("| `{}` | {} |", number.name, number.unit).replace("|  |", "| |");
            assert!(
                section.iter().any(|line| line.starts_with(&row)),
                "{table}: {row} is not in docs/hands.md"
            );
        }
    }
}
