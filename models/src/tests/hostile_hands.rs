//! Hands that are machines: each is refused with value, limit and location.

use std::path::Path;

use crate::measure::{Bound, Figure, HandLimits, SPECS};
use crate::read::{self, LoadOptions, Loaded};

/// A palm and a finger that slides out and bends; each number of a hand is in one of the two files.
pub(super) const URDF: &str = r#"<robot name="two">
  <link name="palm"><inertial><mass value="0.3"/>
    <inertia ixx="1e-4" ixy="0" ixz="0" iyy="1e-4" iyz="0" izz="1e-4"/></inertial>
    <collision><geometry><box size="0.08 0.08 0.04"/></geometry></collision></link>
  <link name="carriage"><inertial><mass value="0.05"/>
    <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial>
    <collision><geometry><sphere radius="0.015"/></geometry></collision></link>
  <link name="tip"><inertial><origin xyz="0 0 0.03"/><mass value="0.02"/>
    <inertia ixx="1e-5" ixy="0" ixz="0" iyy="1e-5" iyz="0" izz="1e-5"/></inertial>
    <collision><origin xyz="0 0 0.03"/><geometry><capsule radius="0.01" length="0.04"/></geometry></collision></link>
  <joint name="slide" type="prismatic"><parent link="palm"/><child link="carriage"/><origin xyz="0 0 0.04"/>
    <axis xyz="0 0 1"/><limit lower="0" upper="0.02" effort="1" velocity="1"/></joint>
  <joint name="bend" type="revolute"><parent link="carriage"/><child link="tip"/><origin xyz="0 0 0.01"/>
    <axis xyz="0 1 0"/><limit lower="0" upper="1" effort="1" velocity="1"/></joint>
  <transmission name="close"><type>transmission_interface/AdaptiveSynergyTransmission</type>
    <actuator name="pull"/><joint name="bend"><mechanicalReduction>1</mechanicalReduction>
    <mechanicalElasticity>0.5</mechanicalElasticity></joint></transmission>
</robot>"#;

pub(super) const SETTINGS: &str = "friction = 0.9\n\
    [motors.pull]\nscaling = 1.0\noffset = 0.05\nspeed_limit = 2.0\n\
    [tendons.close]\nstiffness = 300.0\ndamping = 0.1\nforce_limit = 2.0\n\
    [coordinates.bend]\ndamping = 0.03\n[coordinates.slide]\nstiffness = 200.0\ndamping = 5.0\n";

pub(super) fn read(urdf: &str, settings: &str) -> Loaded {
    let files = ((Path::new("x/hand.urdf"), urdf), Some((Path::new("x/hand.toml"), settings)));
    read::from_text(files.0, files.1, None, &LoadOptions::default()).unwrap()
}

fn refusals(urdf: &str, settings: &str) -> Vec<String> {
    let Loaded { hand, sources, .. } = read(urdf, settings);
    let excesses = HandLimits::default().excesses(&hand.figures(), &sources);
    excesses.iter().map(ToString::to_string).collect()
}

#[track_caller]
fn refused(from: &str, to: &str, expected: &str) {
    assert!(URDF.contains(from) || SETTINGS.contains(from), "{from}");
    let all = refusals(&URDF.replace(from, to), &SETTINGS.replace(from, to));
    assert!(
        all.iter().any(|line| line.starts_with(expected)),
        "{expected}\nis not among\n{}",
        all.join("\n")
    );
}

#[test]
fn a_plain_hand_is_within_all_limits() {
    assert_eq!(refusals(URDF, SETTINGS), Vec::<String>::new());
    let measured: Vec<&str> = read(URDF, SETTINGS).hand.figures().iter().map(|f| f.spec.name).collect();
    let all: Vec<&str> = SPECS.iter().map(|spec| spec.name).collect();
    assert_eq!(measured, all, "a hand that turns and slides has every figure, in their order");
}

#[test]
fn machines_are_refused_with_number_bound_and_place() {
    refused(
        "friction = 0.9",
        "friction = 1e9",
        "x/hand.toml: friction: Coulomb coefficient of a surface is 1e9; valid: at most 2.5 (hand_limits.friction)",
    );
    refused(
        "0.08 0.08 0.04",
        "9 0.08 0.04",
        "x/hand.urdf: link 'palm': largest edge of a link's shapes is 9 m; valid: at most 0.3 m (hand_limits.link_size_m)",
    );
    refused(
        "<mass value=\"0.02\"/>",
        "<mass value=\"1e-300\"/>",
        "x/hand.urdf: link 'tip': mass of the lightest link is 1e-300 kg; valid: at least 1e-4 kg",
    );
    refused(
        "force_limit = 2.0",
        "force_limit = 1e9",
        "x/hand.urdf: joint 'bend': largest torque of tendons or spring on a turning joint is 1e9 N·m; valid: at most 30",
    );
    refused(
        "force_limit = 2.0",
        "force_limit = 200.0",
        "x/hand.urdf: joint 'bend': largest torque of tendons or spring on a turning joint is 200 N·m; valid: at most 30",
    );
    refused(
        "stiffness = 300.0",
        "stiffness = 1e9",
        "x/hand.toml: [tendons.close]: stiffness of a cable with its motor is 1e9",
    );
    refused(
        "<mechanicalElasticity>0.5<",
        "<mechanicalElasticity>1e9<",
        "x/hand.urdf: joint 'bend': stiffness of a turning joint's spring is 1e9 N·m/rad; valid: at most 5 N·m/rad",
    );
    refused(
        "<mechanicalReduction>1<",
        "<mechanicalReduction>1e9<",
        "x/hand.urdf: transmission 'close': largest moment arm, an entry of R is 1e9 s/q; valid: at most 4 s/q",
    );
    refused(
        "speed_limit = 2.0",
        "speed_limit = 1e9",
        "x/hand.toml: [motors.pull]: speed of a motor, as dσ/dt is 1e9 1/s; valid: at most 6 1/s",
    );
    refused(
        "scaling = 1.0",
        "scaling = 1e8",
        "x/hand.toml: [motors.pull]: length that a motor winds from σ = 0 to 1 is 1e8 s; valid: at most 40 s",
    );
    refused(
        "upper=\"0.02\"",
        "upper=\"0.5\"",
        "x/hand.urdf: joint 'slide': stroke of a sliding joint is 0.5 m",
    );
    refused("upper=\"1\"", "upper=\"400\"", "x/hand.urdf: joint 'bend': range of a turning joint is 400 rad");
}

/// A continuous joint has no range, so that no limit of a range can refuse it.
#[test]
fn a_continuous_joint_is_allowed() {
    let wheel = URDF.replace("type=\"revolute\"", "type=\"continuous\"");
    assert_eq!(refusals(&wheel, SETTINGS), Vec::<String>::new());
    let figures = read(&wheel, SETTINGS).hand.figures();
    assert!(figures.iter().all(|figure| figure.value.is_finite() && figure.spec.name != "joint_range_rad"));
}

/// 1.5 N·m at a pulley of 5 mm are 300 N: the limit is in N·m, whatever the unit of R is. An organizer's own limit of the force counts.
#[test]
fn the_force_of_a_cable_over_a_small_pulley_is_allowed() {
    let arm = URDF.replace("<mechanicalReduction>1<", "<mechanicalReduction>0.005<");
    let settings = SETTINGS
        .replace("force_limit = 2.0", "force_limit = 300.0")
        .replace("scaling = 1.0", "scaling = 0.01");
    assert_eq!(refusals(&arm, &settings), Vec::<String>::new());
    let limits: HandLimits = toml::from_str("tendon_force = 250").unwrap();
    let Loaded { hand, sources, .. } = read(&arm, &settings);
    let found = limits.excesses(&hand.figures(), &sources);
    assert_eq!(found.len(), 1);
    assert!(
        found[0].to_string().contains("[tendons.close]: largest tension or drive torque"),
        "{}",
        found[0]
    );
}

#[test]
fn a_hand_that_unfolds_is_as_large_as_it_can_get() {
    // Folded it is small; its joint lets it extend.
    let long = URDF.replace("<origin xyz=\"0 0 0.01\"/>\n    <axis", "<origin xyz=\"0 0 -0.7\"/>\n    <axis");
    assert_ne!(long, URDF);
    let all = refusals(&long, SETTINGS);
    assert!(all.iter().any(|line| line.contains("hand_limits.reach_m")), "{all:?}");
}

/// For each limit: a hand just inside passes, the same hand with the limit just inside its figure does not.
#[test]
fn each_limit_refuses_just_beyond_and_nothing_else() {
    let Loaded { hand, sources, .. } = read(URDF, SETTINGS);
    let figures = hand.figures();
    for Figure { spec, value, .. } in &figures {
        let beyond = |factor: f64| {
            let text = format!("{} = {:?}", spec.name, value * factor);
            let limits: HandLimits = toml::from_str(&text).unwrap();
            limits.check().unwrap();
            limits.excesses(&figures, &sources)
        };
        let (out, within) = match spec.bound {
            Bound::Most => (0.999, 1.001),
            Bound::Least => (1.001, 0.999),
        };
        let found: Vec<&str> = beyond(out).iter().map(|excess| excess.spec.name).collect();
        assert_eq!(found, [spec.name], "{value}");
        assert!(beyond(1.0).is_empty() && beyond(within).is_empty(), "{}", spec.name);
    }
}

#[test]
fn limits_are_numbers_that_can_be_kept() {
    let wrong = |text: &str| toml::from_str::<HandLimits>(text).unwrap().check().unwrap_err();
    assert_eq!(wrong("size_m = 0"), "hand_limits.size_m = 0: expected more than 0; inf for no limit");
    assert!(wrong("friction = nan").contains("hand_limits.friction = NaN"));
    assert!(wrong("least_link_mass_kg = inf").contains("at least 0, finite"));
    toml::from_str::<HandLimits>("size_m = inf\nleast_link_mass_kg = 0\nlinks = 200")
        .unwrap()
        .check()
        .unwrap();
    assert!(toml::from_str::<HandLimits>("siz_m = 1").unwrap_err().to_string().contains("`siz_m`"));
}
