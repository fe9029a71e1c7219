//! The built-in ReFlex, and tendons whose arms depend on the configuration.

use std::f64::consts::FRAC_PI_2;
use std::path::Path;
use std::sync::Arc;

use crate::hand::Hand;
use crate::hand::da_vinci::{DaVinci, DaVinciGeometry};
use crate::hand::path::TendonPath;
use crate::read::{self, LoadOptions, Loaded};
use crate::{Pose, Vec3};

const URDF: &str = include_str!("../../hands/reflex/hand.urdf");
const SETTINGS: &str = include_str!("../../hands/reflex/hand.toml");

fn reflex() -> Arc<Hand> {
    Hand::builtin("reflex").unwrap()
}

fn from(urdf: &str, settings: &str) -> Result<Loaded, String> {
    let (urdf_file, settings_file) = (Path::new("x/hand.urdf"), Path::new("x/hand.toml"));
    read::from_text((urdf_file, urdf), Some((settings_file, settings)), None, &LoadOptions::default())
        .map_err(|e| e.to_string())
}

const GEOMETRY: DaVinciGeometry =
    DaVinciGeometry { r0: 0.015, r1: 0.002, r2: 0.0, a1: 0.04, b1: 0.01, l1: 0.05, a2: 0.02, b2: 0.0 };

/// The arm as the 2016 challenge's emulator states it, without a length.
fn published_arm(g: &DaVinciGeometry, theta: f64) -> f64 {
    let r = g.r2 - g.r1;
    let a = g.l1 - g.a1 + g.a2 * theta.cos() - g.b2 * theta.sin();
    let b = -g.b1 + g.a2 * theta.sin() + g.b2 * theta.cos();
    let l = (a * a + b * b - r * r).sqrt();
    let arm = g.r1 + (g.b1 * (r * b - a * l) - (g.l1 - g.a1) * (a * r + b * l)) / (a * a + b * b);
    -arm / g.r0
}

/// Pulleys for which the second turns about the first, and others for which it does not.
fn geometries() -> [DaVinciGeometry; 3] {
    [
        GEOMETRY,
        DaVinciGeometry { a1: 0.01, r2: 0.004, b2: 0.003, ..GEOMETRY },
        DaVinciGeometry { a1: 0.055, b1: -0.004, r1: 0.0, r2: 0.006, b2: -0.01, ..GEOMETRY },
    ]
}

fn angles() -> impl Iterator<Item = f64> {
    (-700..=700).map(|k| f64::from(k) * 0.01)
}

#[test]
fn the_arm_is_the_published_one() {
    for geometry in geometries() {
        let mechanism = DaVinci::new(geometry).unwrap();
        for theta in angles() {
            let (ours, published) = (mechanism.length(theta).slope, published_arm(&geometry, theta));
            assert!((ours - published).abs() < 1e-12, "{geometry:?} {theta}: {ours} {published}");
        }
    }
    // A few values of the formula with the emulator's parameters.
    let mechanism = DaVinci::new(GEOMETRY).unwrap();
    for (theta, arm) in [
        (-1.0, -0.3065014836346305),
        (-0.5, -0.031568903956315335),
        (0.0, 0.23412623568158658),
        (1.0, 0.6656187791248274),
        (2.0, 0.754991455033788),
        (3.0, -1.0286824775298489),
    ] {
        assert!((mechanism.length(theta).slope - arm).abs() < 1e-14);
    }
}

#[test]
fn arms_are_the_gradient_of_the_length_and_smooth_over_more_than_a_turn() {
    for geometry in geometries() {
        let mechanism = DaVinci::new(geometry).unwrap();
        assert_eq!(mechanism.length(0.0).value, 0.0);
        let h = 1e-5;
        for theta in angles() {
            let (less, here, more) =
                (mechanism.length(theta - h), mechanism.length(theta), mechanism.length(theta + h));
            let slope = (more.value - less.value) / (2.0 * h);
            assert!((slope - here.slope).abs() < 1e-8, "{theta}: {slope} {}", here.slope);
            let curvature = (more.slope - less.slope) / (2.0 * h);
            let scale = 1.0 + here.curvature.abs();
            assert!(
                (curvature - here.curvature).abs() < 1e-7 * scale,
                "{theta}: {curvature} {}",
                here.curvature
            );
        }
    }
}

#[test]
fn the_hands_r_is_the_gradient_of_its_tendons_lengths() {
    let hand = reflex();
    for k in -25..=25 {
        let share = f64::from(k) / 25.0;
        let q: Vec<f64> = hand
            .coordinates
            .iter()
            .map(|c| 0.5 * (c.lower + c.upper) + 0.5 * share * (c.upper - c.lower))
            .collect();
        for (tendon, row) in hand.tendons.iter().zip(hand.moment_arms(&q)) {
            for (i, arm) in row.iter().enumerate() {
                let h = 1e-5;
                let at = |x: f64| {
                    let mut moved = q.clone();
                    moved[i] += x;
                    tendon.length(&moved)
                };
                let numeric = (at(h) - at(-h)) / (2.0 * h);
                assert!((numeric - arm).abs() < 1e-8, "{} {i}: {numeric} {arm}", tendon.name);
                assert!(*arm == 0.0 || tendon.coordinates().contains(&i));
            }
        }
    }
}

#[test]
fn pulleys_that_overlap_are_refused() {
    // Levers of 14.1 and 14 mm bring the pulleys to 0.1 mm of each other; their radii differ by 2 mm.
    assert!(DaVinci::new(DaVinciGeometry { a2: 0.014, ..GEOMETRY }).unwrap_err().contains("closer"));
    assert!(DaVinci::new(DaVinciGeometry { r0: 0.0, ..GEOMETRY }).unwrap_err().contains("r0"));
    assert!(DaVinci::new(DaVinciGeometry { l1: f64::NAN, ..GEOMETRY }).is_err());
    let settings = SETTINGS.replacen("a2 = 0.02", "a2 = 0.014", 1);
    let message = from(URDF, &settings).unwrap_err();
    assert!(message.contains("finger_1") && message.contains("distal_1"), "{message}");
}

#[test]
fn loads_without_warning_and_from_its_folder_too() {
    assert_eq!(from(URDF, SETTINGS).unwrap().warnings, vec![]);
    let file = Path::new(concat!(env!("CARGO_MANIFEST_DIR"), "/hands/reflex/hand.urdf"));
    let loaded = read::hand(file, &LoadOptions::default()).unwrap();
    assert_eq!(loaded.hand.describe(), reflex().describe());
}

#[test]
fn stated_inertias_are_those_of_the_shapes() {
    super::inertia::assert_stated(URDF, SETTINGS);
}

#[test]
fn seven_coordinates_nine_links_three_tendons_and_a_drive() {
    let hand = reflex();
    let names: Vec<&str> = hand.coordinates.iter().map(|c| c.name.as_str()).collect();
    let fingers =
        ["preshape_1", "proximal_1", "distal_1", "proximal_2", "distal_2", "proximal_3", "distal_3"];
    assert_eq!(names, fingers);
    assert_eq!((hand.links.len(), hand.motors.len(), hand.tendons.len()), (9, 4, 4));
    for finger in &hand.tendons[..3] {
        assert!(!finger.both_ways);
        let [element] = finger.elements.as_slice() else { panic!("{} has one element", finger.name) };
        let TendonPath::DaVinci(mechanism) = &element.path else { panic!("no mechanism") };
        assert_eq!(*mechanism.geometry(), GEOMETRY);
        assert_eq!(finger.coordinates(), vec![element.coordinate - 1, element.coordinate]);
    }
    let preshape = &hand.tendons[3];
    assert!(preshape.both_ways && preshape.elements.is_empty());
    assert_eq!(preshape.moment_arms, vec![(0, 1.0)]);
    for link in &hand.links {
        let expected = match link.name.split('_').next() {
            Some("base") => 0.5 + 0.1,
            Some("swivel") => 0.05,
            // A phalanx and its pad.
            _ => 0.03 + 0.005,
        };
        assert!((link.inertia.mass - expected).abs() < 1e-12, "{} {}", link.name, link.inertia.mass);
    }
    for proximal in hand.coordinates.iter().filter(|c| c.name.starts_with("proximal")) {
        assert_eq!(
            [proximal.lower, proximal.upper, proximal.rest],
            [-0.34, 2.83, -0.34],
            "{}",
            proximal.name
        );
    }
}

/// σ = 0 leaves the open hand's tendons just taut: s(q₀) = −0.34 rad.
#[test]
fn motors_at_rest_neither_pull_nor_sag() {
    let hand = reflex();
    let rest: Vec<f64> = hand.coordinates.iter().map(|c| c.rest).collect();
    for tendon in &hand.tendons {
        let motor = &hand.motors[tendon.motors[0].0];
        assert!((motor.scaling * -motor.offset - tendon.length(&rest)).abs() < 1e-15, "{}", tendon.name);
    }
}

#[test]
fn preshape_turns_both_fingers_symmetrically() {
    let hand = reflex();
    let (one, two) = (hand.link("distal_1").unwrap(), hand.link("distal_2").unwrap());
    for preshape in [0.0, 0.4, 1.0, FRAC_PI_2] {
        let poses = hand.base_from_links(&[preshape, 0.7, 0.4, 0.7, 0.4, 0.0, 0.0]);
        let (a, b) = (poses[one], poses[two]);
        let mirrored = Vec3::new(b.translation.x, -b.translation.y, b.translation.z);
        assert!((a.translation - mirrored).length() < 1e-12, "{preshape}: {a:?} {b:?}");
        // At a quarter turn they face each other.
        let out = a.translation - poses[hand.link("swivel_1").unwrap()].translation;
        assert!((libm::atan2(-out.y, out.x) - preshape).abs() < 1e-9, "{preshape} {out}");
    }
}

#[test]
fn pads_are_rough_and_housings_are_not() {
    let hand = reflex();
    for link in &hand.links {
        let frictions: Vec<f64> = link.geoms.iter().map(|g| g.friction).collect();
        let expected: &[f64] = if link.name.starts_with("swivel") { &[0.5] } else { &[0.5, 1.5] };
        assert_eq!(frictions, expected, "{}", link.name);
    }
}

/// 9 patches a finger and 11 on the palm, each flat on the surface of its link and facing outwards.
#[test]
fn tactile_patches_lie_on_the_pads() {
    let hand = reflex();
    let on =
        |name: &str| hand.tactile.iter().filter(|p| p.name.starts_with(name)).map(|p| p.len()).sum::<usize>();
    for finger in 1..=3 {
        assert_eq!(on(&format!("finger_{finger}_")), 9);
    }
    assert_eq!((on("palm"), on("")), (11, 38));
    for patch in &hand.tactile {
        let distance = |point: Vec3| {
            let geoms = hand.links[patch.link].geoms.iter();
            let distances = geoms.map(|g| {
                let (shape, up) = g.shape.to_parry().unwrap();
                shape.distance_to_point(&(g.link_from_geom * up), point, false)
            });
            distances.fold(f64::INFINITY, f64::min)
        };
        let out = patch.link_from_patch.rotation * Vec3::Z;
        for taxel in 0..patch.len() {
            let center = patch.link_from_patch.transform_point(patch.taxel_center(taxel));
            assert!(distance(center).abs() < 1e-4, "{}: {}", patch.name, distance(center));
            assert!((distance(center + out * 1e-3) - 1e-3).abs() < 1e-4, "{}", patch.name);
        }
    }
    let described = hand.describe();
    assert_eq!(described.tactile.len(), 12);
    assert_eq!(described.tactile[0].link, "proximal_1");
    assert_eq!((described.tactile[0].size, described.tactile[0].taxels), ([0.0395625, 0.014], [5, 1]));
    let places: Vec<f64> = (0..5).map(|taxel| 0.034725 + hand.tactile[0].taxel_center(taxel).x).collect();
    let published = [0.0189, 0.02681, 0.03473, 0.04264, 0.05055];
    assert!(places.iter().zip(published).all(|(x, y)| (x - y).abs() < 2e-5), "{places:?}");
}

#[test]
fn patches_on_nothing_or_askew_are_refused() {
    let other = SETTINGS.replacen("link = \"palm\"", "link = \"plam\"", 1);
    let message = from(URDF, &other).unwrap_err();
    assert!(message.contains("hand.toml") && message.contains("plam"), "{message}");
    let askew = SETTINGS.replacen("along = [1, 0, 0]", "along = [1, 0, 1]", 1);
    assert!(from(URDF, &askew).unwrap_err().contains("right angles"));
    let mut hand = Hand::clone(&reflex());
    hand.tactile[1].name = hand.tactile[0].name.clone();
    assert!(hand.validate().unwrap_err().to_string().contains("appears twice"));
    hand = Hand::clone(&reflex());
    hand.tactile[0].link = 99;
    assert!(hand.validate().unwrap_err().to_string().contains("link 99"));
    hand = Hand::clone(&reflex());
    hand.tactile[0].link_from_patch = Pose::translation(f64::NAN, 0.0, 0.0);
    assert!(hand.validate().is_err());
}

#[test]
fn closes_inwards() {
    let hand = reflex();
    let open = hand.base_from_links(&[0.0; 7]);
    let bent = hand.base_from_links(&[0.0, 1.2, 0.5, 1.2, 0.5, 1.2, 0.5]);
    for (name, sign) in [("distal_1", 1.0), ("distal_2", 1.0), ("distal_3", -1.0)] {
        let i = hand.link(name).unwrap();
        assert!(sign * bent[i].translation.x < sign * open[i].translation.x - 0.03, "{name}");
        assert!(bent[i].translation.z > open[i].translation.z + 0.03, "{name}");
        // The pad's front, +z of the link, turns towards the middle.
        assert!(sign * (bent[i].rotation * Vec3::Z).x < -0.9, "{name}");
    }
}

#[test]
fn describes_what_its_arms_depend_on() {
    let text = serde_json::to_string_pretty(&reflex().describe()).unwrap();
    for part in ["\"da_vinci\"", "\"r0\"", "\"both_ways\": true", "\"finger_1_distal\"", "\"palm_front\""] {
        assert!(text.contains(part), "{part}");
    }
}
