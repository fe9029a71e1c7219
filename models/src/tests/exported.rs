//! A hand as exporters write them, read from its folder: right values come from its generator's numbers.

use crate::hand::Hand;
use crate::measure::HandLimits;
use crate::read::{self, InertiaPolicy, LoadOptions, Loaded};
use crate::{Pose, Vec3};

use super::exported_hand::{ABSURD, DIGITS, Digit, LENGTHS, MASSES, MESHES, PALM, principal, write};

/// The hand with a part of its file replaced.
fn load_with(from: &str, to: &str, options: &LoadOptions) -> Loaded {
    let folder = tempfile::tempdir().unwrap();
    write(folder.path());
    let urdf = folder.path().join("exported.urdf");
    let text = std::fs::read_to_string(&urdf).unwrap();
    assert!(text.contains(from), "{from}");
    std::fs::write(&urdf, text.replace(from, to)).unwrap();
    read::hand(folder.path(), options).unwrap()
}

fn load(inertia: InertiaPolicy) -> Loaded {
    load_with("", "", &LoadOptions { inertia, ..LoadOptions::default() })
}

fn principal_of(hand: &Hand, link: &str) -> [f64; 3] {
    hand.links[hand.link(link).unwrap()].inertia.principal()
}

/// The names of a finger's coordinates.
fn coordinates(digit: &Digit) -> Vec<String> {
    std::iter::once(&"spread").chain(digit.rolls).map(|joint| format!("{}_{joint}", digit.name)).collect()
}

#[test]
fn coordinates_and_synergy_are_read_from_names_and_tags() {
    let Loaded { hand, warnings, .. } = load(InertiaPolicy::FromFile);
    let names: Vec<&str> = hand.coordinates.iter().map(|c| c.name.as_str()).collect();
    assert_eq!(names, DIGITS.iter().flat_map(coordinates).collect::<Vec<_>>());
    assert_eq!((names.len(), hand.links.len(), hand.links[0].name.as_str()), (19, 20, "stand"));
    let mut arms = Vec::new();
    for digit in &DIGITS {
        arms.push(digit.spread_arm);
        arms.extend(digit.rolls.iter().map(|_| 1.0));
    }
    assert_eq!((hand.tendons.len(), hand.motors.len(), hand.motors[0].name.as_str()), (1, 1, "pull"));
    assert_eq!(hand.tendons[0].moment_arms, arms.into_iter().enumerate().collect::<Vec<_>>());
    for c in &hand.coordinates {
        // 0.25 on each hinge; both hinges of a rolling joint turn by q.
        let [stiffness, rest, damping] =
            if c.name.ends_with("_spread") { [0.6, 0.0, 0.25] } else { [0.8, 0.05, 0.5] };
        assert_eq!([c.stiffness, c.rest, c.damping], [stiffness, rest, damping], "{}", c.name);
    }
    let mass: f64 = hand.links.iter().map(|link| link.inertia.mass).sum();
    // One palm, five bases, nine bones and five tips.
    assert!(
        (mass - (MASSES[0] + 5.0 * MASSES[1] + 9.0 * MASSES[2] + 5.0 * MASSES[3])).abs() < 1e-12,
        "{mass}"
    );

    let count = |part: &str| warnings.iter().filter(|w| w.message.contains(part)).count();
    assert_eq!(count("paired with"), 14);
    assert_eq!(count("its mass of 0.12 kg is dropped"), 14);
    assert_eq!(count("touches nothing; both are dropped"), 1);
    assert_eq!(count("times what its geometry has"), 20);
    assert!(warnings.iter().all(|w| w.file.ends_with("exported.urdf") && !w.element.is_empty()));
}

/// The pose of a finger's last link in the hand's base: in its plane the finger turns by q at each of a rolling joint's hinges.
fn tip(digit: &Digit, q: &[f64]) -> (Vec3, Vec3) {
    let (mut x, mut z, mut turn, mut ahead) = (0.0, 0.0, 0.0_f64, LENGTHS[0]);
    for q in &q[1..] {
        for length in [ahead, LENGTHS[1]] {
            (x, z) = (x + length * turn.cos(), z - length * turn.sin());
            turn += q;
        }
        ahead = LENGTHS[2];
    }
    let (sin, cos) = q[0].sin_cos();
    let spread = |x: f64, z: f64| match digit.name {
        "pollex" => Vec3::new(-x * sin, x * cos, z),
        _ => Vec3::new(-z, x * sin, x * cos),
    };
    let anchor = Vec3::from_array(PALM) + Vec3::from_array(digit.anchor);
    (anchor + spread(x, z), spread(turn.cos(), -turn.sin()))
}

#[test]
fn links_move_as_their_chains_lengths_say() {
    let hand = load(InertiaPolicy::FromFile).hand;
    for step in 0..4 {
        let q: Vec<f64> = (0..19).map(|i| 0.1 * f64::from(step) * (1.0 + 0.05 * f64::from(i))).collect();
        let poses = hand.base_from_links(&q);
        let mut first = 0;
        for digit in &DIGITS {
            let of_digit = &q[first..first + 1 + digit.rolls.len()];
            first += of_digit.len();
            let pose = poses[hand.link(&format!("{}_end_bone", digit.name)).unwrap()];
            let (place, along) = tip(digit, of_digit);
            assert!((pose.translation - place).length() < 1e-12, "{} {pose:?} {place}", digit.name);
            assert!((pose.transform_vector(Vec3::X) - along).length() < 1e-12, "{} {along}", digit.name);
        }
    }
}

#[test]
fn meshes_in_millimetres_have_their_size_in_metres() {
    let hand = load(InertiaPolicy::FromFile).hand;
    for (link, mesh) in [("stand", 0), ("pollex_base", 1), ("first_root_bone", 2), ("fourth_end_bone", 3)] {
        // The root has shapes of its own before that of the palm.
        let geom = hand.links[hand.link(link).unwrap()].geoms.last().unwrap();
        let (shape, up) = geom.shape.to_parry().unwrap();
        let from = Pose::from_translation(if mesh == 0 { Vec3::from_array(PALM) } else { Vec3::ZERO });
        let bounds = shape.compute_aabb(&(from.inverse() * geom.link_from_geom * up));
        let (_, low, high) = MESHES[mesh];
        for (found, corner) in [(bounds.mins, low), (bounds.maxs, high)] {
            let corner = Vec3::from_array(corner.map(|x| 1e-3 * f64::from(x)));
            assert!((found - corner).abs().max_element() < 1e-9, "{link}: {found} {corner}");
        }
    }
}

#[test]
fn absurd_inertias_are_kept_or_replaced_on_request() {
    let kept = load(InertiaPolicy::FromFile).hand;
    let Loaded { hand, warnings, .. } = load(InertiaPolicy::FromGeometry);
    assert!(!warnings.iter().any(|w| w.message.contains("inertia is")));
    for link in &hand.links {
        assert_eq!(link.inertia.implausible(), None, "{}", link.name);
    }
    for (link, mesh) in [("second_base", 1), ("third_mid_bone", 2), ("pollex_end_bone", 3)] {
        let mut cuboid = principal(mesh);
        cuboid.sort_by(f64::total_cmp);
        for axis in 0..3 {
            let stated = principal_of(&kept, link)[axis] / cuboid[axis];
            assert!((stated / ABSURD - 1.0).abs() < 1e-12, "{link} {axis}: {stated}");
            // The hull's edges are round, which leaves less mass far out.
            let derived = principal_of(&hand, link)[axis] / cuboid[axis];
            assert!((0.9..1.0).contains(&derived), "{link} {axis}: {derived}");
        }
        assert_eq!(hand.links[hand.link(link).unwrap()].inertia.mass, MASSES[mesh]);
    }
}

#[test]
fn a_settings_file_elsewhere_states_true_masses() {
    let folder = tempfile::tempdir().unwrap();
    let settings = folder.path().join("masses.toml");
    std::fs::write(&settings, "[links]\nfirst_end_bone = { mass = 0.007 }\n").unwrap();
    let hand = load_with("", "", &LoadOptions { settings: Some(settings), ..LoadOptions::default() }).hand;
    let derived = load(InertiaPolicy::FromGeometry).hand;
    assert_eq!(hand.links[hand.link("first_end_bone").unwrap()].inertia.mass, 0.007);
    // A mass of its own brings its inertia: half the mass of the file, half of what the shape has with that.
    for (ours, whole) in
        principal_of(&hand, "first_end_bone").iter().zip(principal_of(&derived, "first_end_bone"))
    {
        assert!((ours / whole - 0.5).abs() < 1e-12, "{ours} {whole}");
    }
}

#[test]
fn the_figures_are_within_the_defaults_unless_its_meshes_are_ten_times_as_large() {
    let beyond = |Loaded { hand, sources, .. }: Loaded| {
        let excesses = HandLimits::default().excesses(&hand.figures(), &sources);
        excesses.iter().map(ToString::to_string).collect::<Vec<_>>()
    };
    assert_eq!(beyond(load(InertiaPolicy::FromFile)), Vec::<String>::new());
    let large = beyond(load_with(" .001 .001 .001", ".01 .01 .01", &LoadOptions::default()));
    assert!(large.iter().any(|line| line.contains("link_size_m")), "{large:?}");
}
