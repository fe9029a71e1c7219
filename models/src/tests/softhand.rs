//! The built-in SoftHand.

use std::path::Path;

use crate::hand::Hand;
use crate::read::{self, InertiaPolicy, LoadOptions, Loaded};
use crate::shape::Shape;
use crate::{Vec3, builtin};

pub(super) const URDF: &str = include_str!("../../hands/softhand/hand.urdf");
pub(super) const SETTINGS: &str = include_str!("../../hands/softhand/hand.toml");

pub(super) fn load_with(inertia: InertiaPolicy) -> Loaded {
    let options = LoadOptions { inertia, ..LoadOptions::default() };
    let (urdf, settings) = (Path::new("hand.urdf"), Path::new("hand.toml"));
    read::from_text((urdf, URDF), Some((settings, SETTINGS)), None, &options).unwrap()
}

pub(super) const COORDINATES: [&str; 19] = [
    "thumb_abd",
    "thumb_inner",
    "thumb_outer",
    "index_abd",
    "index_inner",
    "index_middle",
    "index_outer",
    "middle_abd",
    "middle_inner",
    "middle_middle",
    "middle_outer",
    "ring_abd",
    "ring_inner",
    "ring_middle",
    "ring_outer",
    "little_abd",
    "little_inner",
    "little_middle",
    "little_outer",
];

#[test]
fn every_builtin_hand_loads_without_warning() {
    assert!(builtin::builtin_hands().iter().any(|h| h.name == "softhand"));
    assert!(Hand::builtin("no such hand").is_none());
    let loaded = load_with(InertiaPolicy::FromFile);
    assert_eq!(loaded.warnings, vec![]);
}

#[test]
fn loads_from_its_folder_too() {
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/hands/softhand/hand.urdf"));
    let loaded = read::hand(file, &LoadOptions::default()).unwrap();
    assert_eq!(loaded.hand.describe(), Hand::builtin("softhand").unwrap().describe());
}

#[test]
fn nineteen_coordinates_twenty_links_one_tendon() {
    let hand = load_with(InertiaPolicy::FromFile).hand;
    let names: Vec<&str> = hand.coordinates.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, COORDINATES);
    assert_eq!(hand.links.len(), 20);
    assert!(hand.links.iter().map(|l| l.geoms.len()).sum::<usize>() <= 24);
    let rolling = hand.links.iter().filter(|l| l.joint.as_ref().is_some_and(|j| j.hinges.len() == 2)).count();
    assert_eq!(rolling, 14);

    let r: Vec<f64> = hand.tendons[0].moment_arms.iter().map(|&(_, r)| r).collect();
    let fingers = [-0.2, 0.001, 0.2, 0.4].iter().flat_map(|&abd| [abd, 1.0, 1.0, 1.0]);
    let expected: Vec<f64> = [1.3, 1.0, 1.0].into_iter().chain(fingers).collect();
    assert_eq!(r, expected);
    assert_eq!((hand.tendons[0].stiffness, hand.tendons[0].force_limit), (300.0, 0.44));
    assert_eq!((hand.motors.len(), hand.motors[0].scaling), (1, 12.5));

    for c in &hand.coordinates {
        let finger_inner = c.name.ends_with("_inner") && c.name != "thumb_inner";
        assert_eq!(c.stiffness, if finger_inner { 0.3 } else { 0.5 }, "{}", c.name);
        assert_eq!((c.damping, c.rest), (0.03, 0.0));
        let quarter_turn = std::f64::consts::FRAC_PI_4;
        if !c.name.ends_with("_abd") {
            assert!(c.lower == 0.0 && (c.upper - quarter_turn).abs() < 1e-9);
        }
    }
}

#[test]
fn masses_are_the_true_ones() {
    let hand = load_with(InertiaPolicy::FromFile).hand;
    for link in &hand.links {
        let expected = if link.parent.is_none() {
            0.205 + 0.167 + 0.228
        } else if link.name.ends_with("_knuckle") {
            0.009
        } else if link.name.ends_with("_distal") {
            0.010
        } else {
            0.005
        };
        assert!((link.inertia.mass - expected).abs() < 1e-12, "{} {}", link.name, link.inertia.mass);
    }
    let robot = urdf_rs::read_from_string(URDF).unwrap();
    let palm = robot.links.iter().find(|l| l.name == "palm").unwrap();
    assert_eq!(palm.inertial.mass.value, 0.228);
}

#[test]
fn stated_inertias_are_those_of_the_shapes() {
    super::inertia::assert_stated(URDF, SETTINGS);
}

/// The published anchors, in the palm frame, which is at (0.002, 0.00695, 0.0905) in the base frame.
#[test]
fn at_rest_links_stand_where_published() {
    let hand = load_with(InertiaPolicy::FromFile).hand;
    let poses = hand.base_from_links(&[0.0; 19]);
    let palm = Vec3::new(0.002, 0.00695, 0.0905);
    let anchors = [
        ("thumb", [0.00567, 0.029616, 0.055314]),
        ("index", [-0.0033, 0.0195, 0.0936994]),
        ("middle", [-0.0033, 0.0, 0.100699]),
        ("ring", [-0.0033, -0.0195, 0.0936994]),
        ("little", [-0.0033, -0.039, 0.0836994]),
    ];
    for (finger, anchor) in anchors {
        let knuckle = poses[hand.link(&format!("{finger}_knuckle")).unwrap()].translation;
        assert!((knuckle - palm - Vec3::from_array(anchor)).length() < 1e-6, "{finger} {knuckle}");
    }
    // The middle finger is straight along +z: three times 9 mm + 13 mm.
    let tip = poses[hand.link("middle_distal").unwrap()];
    let expected = palm + Vec3::new(-0.0033, 0.0, 0.100699 + 3.0 * 0.022);
    assert!((tip.translation - expected).length() < 1e-9, "{tip:?}");
}

/// T(θ) = Rot(θ/2) · Trans(2r) · Rot(θ/2): closing bends by twice the coordinate, towards the palm's +x.
#[test]
fn a_rolling_joint_bends_by_twice_its_coordinate() {
    let hand = load_with(InertiaPolicy::FromFile).hand;
    let mut q = [0.0; 19];
    let half = 0.5;
    q[hand.coordinate("middle_inner").unwrap()] = half;
    let poses = hand.base_from_links(&q);
    let knuckle = poses[hand.link("middle_knuckle").unwrap()];
    let proximal = poses[hand.link("middle_proximal").unwrap()];
    let relative = knuckle.inv_mul(&proximal);
    let (s, c) = libm::sincos(half);
    let expected = Vec3::new(0.009 + 0.013 * c, 0.0, 0.013 * s);
    assert!((relative.translation - expected).length() < 1e-12, "{relative:?}");
    let along = relative.transform_vector(Vec3::X);
    assert!((along - Vec3::new((2.0 * half).cos(), 0.0, (2.0 * half).sin())).length() < 1e-12, "{along}");
    assert!(proximal.transform_vector(Vec3::X).x > 0.8);
}

#[test]
fn links_that_touch_at_rest_never_collide() {
    let hand = load_with(InertiaPolicy::FromFile).hand;
    let names: Vec<[&str; 2]> =
        hand.no_collision.iter().map(|p| p.map(|i| hand.links[i].name.as_str())).collect();
    println!("{names:?}");
    for pair in &names {
        assert!(!pair.iter().all(|n| n.ends_with("_distal")), "{pair:?} must be able to meet");
    }
    assert_eq!(names.len(), hand.pairs_closer_than(1e-3, &[0.0; 19]).len());
}

#[test]
fn describes_itself_as_json() {
    let text = serde_json::to_string_pretty(&Hand::builtin("softhand").unwrap().describe()).unwrap();
    for part in ["\"softhand\"", "index_distal", "moment_arms", "action.hand", "\"capsule\"", "quat_xyzw"] {
        assert!(text.contains(part), "{part}");
    }
    let schema = schemars::schema_for!(crate::hand::describe::HandDescription);
    assert!(schema.get("properties").is_some());
}

#[test]
fn shapes_survive_json() {
    let hand = Hand::builtin("softhand").unwrap();
    for geom in hand.links.iter().flat_map(|l| &l.geoms) {
        let text = serde_json::to_string(&geom.shape).unwrap();
        assert_eq!(serde_json::from_str::<Shape>(&text).unwrap(), geom.shape);
    }
}
