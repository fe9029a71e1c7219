//! `hand.toml`'s tendons without a transmission, of several motors, springs across joints, pins.

use crate::hand::Hand;
use crate::read::{LoadOptions, from_text};
use std::path::Path;

const URDF: &str = "<robot name='coupled'>\
    <link name='palm'><inertial><mass value='0.3'/><inertia ixx='1e-4' ixy='0' ixz='0' iyy='1e-4' iyz='0' izz='1e-4'/></inertial></link>\
    <link name='one'><inertial><mass value='0.03'/><inertia ixx='1e-5' ixy='0' ixz='0' iyy='1e-5' iyz='0' izz='1e-5'/></inertial></link>\
    <link name='two'><inertial><mass value='0.03'/><inertia ixx='1e-5' ixy='0' ixz='0' iyy='1e-5' iyz='0' izz='1e-5'/></inertial></link>\
    <link name='tip'/>\
    <joint name='a' type='revolute'><parent link='palm'/><child link='one'/><axis xyz='0 0 1'/>\
    <limit lower='-1' upper='1' effort='1' velocity='1'/></joint>\
    <joint name='b' type='revolute'><parent link='palm'/><child link='two'/><origin xyz='0.04 0 0'/><axis xyz='0 0 1'/>\
    <limit lower='-1' upper='1' effort='1' velocity='1'/></joint>\
    <joint name='fixed' type='fixed'><parent link='two'/><child link='tip'/><origin xyz='0 0.03 0'/></joint></robot>";

const TENDON: &str = "stiffness = 100\nforce_limit = 2\n";

fn read(toml: &str) -> Result<Hand, String> {
    let settings = Some((Path::new("hand.toml"), toml));
    let loaded = from_text((Path::new("hand.urdf"), URDF), settings, None, &LoadOptions::default());
    loaded.map(|loaded| loaded.hand).map_err(|error| error.to_string())
}

fn refused(toml: &str, words: &str) {
    let error = read(toml).expect_err(toml);
    assert!(error.contains(words), "{error}");
}

#[test]
fn motors_that_only_the_settings_name_follow_in_the_order_of_their_tendons() {
    let motors =
        "[motors.left]\nscaling = 1\nspeed_limit = 1\n[motors.right]\nscaling = 2\nspeed_limit = 1\n";
    let hand = read(&format!(
        "{motors}[tendons.sum]\n{TENDON}motors = {{ right = 0.5, left = 0.5 }}\njoints = {{ b = 0.01, a = 0.02 }}\n\
         [tendons.last]\n{TENDON}motors.right = -1\njoints.a = 1\nrest = 0.3\n\
         [tendons.passive]\n{TENDON}polynomial.b.coefficients = [0.01, 0.002]\nrest = 0.001\n\
         [springs.belt]\njoints = {{ a = 1, b = -1 }}\nstiffness = 0.4\nrest = 0.1\n\
         [linkages.pin]\nlinks = ['one', 'tip']\npoints = [[0, 0.05, 0], [0, 0.01, 0]]\n"
    ))
    .expect("a sound hand");
    let names: Vec<&str> = hand.motors.iter().map(|motor| motor.name.as_str()).collect();
    assert_eq!(names, ["right", "left"], "`last` comes before `sum`");
    let tendon = |name: &str| hand.tendons.iter().find(|tendon| tendon.name == name).expect("there");
    assert_eq!(tendon("sum").motors, [(0, 0.5), (1, 0.5)]);
    assert_eq!(tendon("sum").moment_arms, [(0, 0.02), (1, 0.01)]);
    assert_eq!(tendon("passive").motors, []);
    let at_end = |k: usize| f64::from(u8::from(k == 0));
    assert!((tendon("last").wound(&hand.motors, at_end) - (0.3 - 2.0)).abs() < 1e-15);
    assert_eq!(tendon("passive").wound(&hand.motors, at_end), 0.001);
    assert_eq!(
        (hand.springs[0].arms.as_slice(), hand.springs[0].rest),
        ([(0, 1.0), (1, -1.0)].as_slice(), 0.1)
    );
    // The frame of a link that is merged into another.
    assert_eq!(hand.linkages[0].links, [1, 2]);
    assert!((hand.linkages[0].points[1].y - 0.04).abs() < 1e-15);
    assert_eq!(hand.no_collision, [[1, 2]]);
    // The open hand has its chain closed, where rigid bars allow it.
    let gap = hand.linkages[0].at(&hand, &hand.open()).gap.length();
    assert!(gap < hand.linkages[0].at(&hand, &[0.0, 0.0]).gap.length(), "{gap}");
}

#[test]
fn stated_pairs_never_touch() {
    let driven = format!(
        "[motors.left]\nscaling = 1\nspeed_limit = 1\n[tendons.t]\n{TENDON}motors.left = 1\njoints = {{ a = 1, b = 1 }}\n"
    );
    let hand =
        read(&format!("no_collision = [['tip', 'one'], ['two', 'tip']]\n{driven}")).expect("a sound hand");
    assert_eq!(hand.no_collision, [[1, 2]], "the tip is part of the second link");
    refused(&format!("no_collision = [['one', 'three']]\n{driven}"), "no_collision: names link 'three'");
}

#[test]
fn a_pin_that_cannot_close_is_reported() {
    let warnings = |y: f64| {
        let toml = format!("[linkages.pin]\nlinks = ['one', 'tip']\npoints = [[0, {y}, 0], [0, 0.01, 0]]\n");
        let settings = Some((Path::new("hand.toml"), toml.as_str()));
        let loaded = from_text((Path::new("hand.urdf"), URDF), settings, None, &LoadOptions::default());
        loaded.expect("a sound hand").warnings
    };
    let open = warnings(0.5);
    let found = open.iter().find(|warning| warning.element == "[linkages.pin]").expect("a warning");
    assert!(found.message.contains("no position of the joints joins them"), "{found:?}");
    assert!(warnings(0.04).iter().all(|warning| warning.element != "[linkages.pin]"));
}

#[test]
fn wrong_couplings_are_named() {
    let own = format!("[tendons.t]\n{TENDON}");
    refused(
        &format!("{own}motors.m = 1\njoints.a = 1\n"),
        "[tendons.t]: names motor 'm', which has no entry",
    );
    refused(&format!("{own}joints.c = 1\n"), "[tendons.t]: names joint 'c'");
    refused(&own, "[tendons.t]: has no <transmission> in the URDF, and pulls on no joint; valid: `joints`");
    refused("[motors.m]\nscaling = 1\nspeed_limit = 1\n", "[motors.m]: names nothing in the URDF");
    refused(&format!("{own}joints.a = 0\n"), "joints.a 0");
    let wound = format!("[motors.m]\nscaling = 1\nspeed_limit = 1\n{own}motors.m = 1\njoints.a = 1\n");
    refused(&format!("{wound}hold_limit = 1\n"), "hand.toml: [tendons.t]: has hold_limit 1; valid: at least");
    refused(
        &format!("{wound}breakaway = true\n"),
        "hand.toml: [tendons.t]: has breakaway, but no hold_limit",
    );
    refused(&format!("{own}joints.a = 1\nhold_limit = 3\n"), "has hold_limit 3, but no motor");
    let line = |stall: f64, more: &str| {
        let motor = format!("[motors.m]\nscaling = 1\nspeed_limit = 1\nstall_force = {stall}\n");
        format!("{motor}{own}motors.m = 1\njoints.a = 1\n{more}")
    };
    refused(&line(-1.0, ""), "[motors.m]: has stall_force -1; valid: stall_force of more than 0");
    let weak = "[tendons.t]: has force_limit 2; its motor 'm' stands still at 1.5; valid: a force_limit of at most 1.5";
    refused(&line(1.5, ""), weak);
    let shared = "[motors.m]: has stall_force or power_limit, and no tendon of its own";
    let other = format!("[tendons.u]\n{TENDON}motors.m = 1\njoints.b = 1\n");
    refused(&line(3.0, &other), shared);
    refused(&line(3.0, "hold_limit = 4\nbreakaway = true\n"), shared);
    refused(
        &format!("{own}table.a = {{ at = [0, 1], length = [0] }}\n"),
        "hand.toml: [tendons.t.table.a]: has 2 coordinates and 1 lengths; valid: at = [q, …] ascending, and as many",
    );
    refused(
        &format!("{own}polynomial.a.coefficients = []\n"),
        "hand.toml: [tendons.t.polynomial.a]: has 0 coefficients",
    );
    refused(
        &format!("{own}eyelets.a = {{ before = [0.01, 0], after = [0, 0.01] }}\n"),
        "they meet at some angle",
    );
    refused(
        &format!("{own}joints.a = 1\npolynomial.a.coefficients = [1]\n"),
        "[tendons.t]: has `joints.a`, and a path of its own over the same joint; valid: one of them",
    );
    refused(
        &format!("{own}polynomial.a.coefficients = [1]\ntable.a = {{ at = [0, 1], length = [0, 1] }}\n"),
        "[tendons.t.table.a]: is a second path over its joint, beside [tendons.t.polynomial.a]",
    );
    refused("[springs.s]\njoints = {}\nstiffness = 1\n", "[springs.s]: acts on no joint");
    refused("[springs.s]\njoints.a = 1\nstiffness = 0\n", "[springs.s]: has stiffness 0");
    refused("[springs.s]\njoints.q = 1\nstiffness = 1\n", "[springs.s]: names joint 'q'");
    let pin = |links: &str| format!("[linkages.p]\nlinks = {links}\npoints = [[0, 0, 0], [0, 0, 0]]\n");
    refused(&pin("['one', 'three']"), "[linkages.p]: names link 'three'");
    refused(&pin("['two', 'tip']"), "[linkages.p]: links 'two' and 'tip' are one body");
}

#[test]
fn lists_of_another_length_are_refused() {
    let own = format!("[tendons.t]\n{TENDON}");
    let eyelets = |before: &str| format!("{own}eyelets.a = {{ before = {before}, after = [0, 0.02] }}\n");
    read(&eyelets("[0.01, 0]")).expect("a pair of numbers");
    for (toml, length) in [
        (eyelets("[0.01, 0, 0.1]"), "3, expected a list of 2"),
        (eyelets("[0.01]"), "1, expected a list of 2"),
        (
            "[linkages.p]\nlinks = ['one', 'two']\npoints = [[0, 0, 0, 5], [0, 0, 0]]\n".to_owned(),
            "4, expected a list of 3",
        ),
        (
            "[linkages.p]\nlinks = ['one', 'two']\npoints = [[0, 0, 0], [0, 0, 0], [0, 0, 0]]\n".to_owned(),
            "3, expected a list of 2",
        ),
        (
            "[linkages.p]\nlinks = ['one', 'two', 'tip']\npoints = [[0, 0, 0], [0, 0, 0]]\n".to_owned(),
            "3, expected a list of 2",
        ),
        ("no_collision = [['one', 'two', 'tip']]\n".to_owned(), "3, expected a list of 2"),
        ("[base]\nposition = [0, 0, 0, 1]\n".to_owned(), "4, expected a list of 3"),
        ("[base]\nrpy = [0, 0]\n".to_owned(), "2, expected a list of 3"),
        ("[servos.a]\nrange = [0, 1, 2]\n".to_owned(), "3, expected a list of 2"),
    ] {
        refused(&toml, &format!("invalid length {length}"));
    }
}

#[test]
fn a_start_is_within_its_range() {
    let motor = format!(
        "[motors.m]\nscaling = 1\nspeed_limit = 1\n[tendons.t]\n{TENDON}motors.m = 1\njoints.a = 1\n"
    );
    refused(
        &format!("{motor}[start]\nsigma = 3\n"),
        "hand.toml: [start]: has sigma 3; valid: sigma from 0 to 1",
    );
    refused(
        &format!("{motor}[start]\nmotors.m = -2\n"),
        "[start]: has motors.m -2; valid: motors.m from 0 to 1",
    );
    refused(
        &format!("{motor}[start]\njoints.a = 9\n"),
        "[start]: has joints.a 9; valid: -1 to 1, the limits of the joint",
    );
    read(&format!("{motor}[start]\njoints.a = 1.0000000001\n")).expect("a start at the limit, rounded");
}

#[test]
fn one_run_names_all_problems() {
    // Numbers, names, and joints of the URDF.
    let toml = format!(
        "[motors.m]\nscaling = 0\nspeed_limit = 1\n[tendons.t]\nstiffness = -5\nforce_limit = 2\nmotors.no = 1\njoints.a = 1\n\
         [tendons.u]\n{TENDON}joints.x = 1\n[coordinates.b9]\nrest = 0\n[springs.s]\nstiffness = 1\njoints.y = 1\n\
         [linkages.l]\nlinks = ['here', 'there']\npoints = [[0, 0, 0], [0, 0, 0]]\n[base]\nlink = 'away'\n[start]\njoints.z = 1\n"
    );
    let of_settings = [
        "[motors.m]: has scaling 0",
        "[motors.m]: names nothing in the URDF",
        "[tendons.t]: has stiffness -5",
        "[tendons.t]: names motor 'no'",
        "[tendons.u]: names joint 'x'",
        "[coordinates.b9]",
        "[springs.s]: names joint 'y'",
        "[linkages.l]: names link 'here'",
        "[linkages.l]: names link 'there'",
        "[base]: names link 'away'",
        "[start]",
    ];
    let turned = URDF.replacen("lower='-1'", "lower='2'", 1).replacen("value='0.03'", "value='-0.03'", 1);
    let endless = URDF.replacen("value='0.03'", "value='nan'", 1);
    for (urdf, more) in [
        (URDF, vec![]),
        (turned.as_str(), vec!["joint 'a': has limits 2 to 1", "link 'one': has the negative mass"]),
        (endless.as_str(), vec!["link 'one': has a mass (kg) of NaN"]),
    ] {
        let settings = Some((Path::new("hand.toml"), toml.as_str()));
        let error = from_text((Path::new("hand.urdf"), urdf), settings, None, &LoadOptions::default())
            .expect_err("refused");
        let error = error.to_string();
        for words in of_settings.iter().chain(&more) {
            assert_eq!(error.matches(words).count(), 1, "{words}: {error}");
        }
        assert_eq!(error.lines().count(), of_settings.len() + more.len(), "{error}");
    }
}

#[test]
fn limits_that_leave_no_range_are_an_error_beside_others() {
    let servo = "servo_joints = ['a']\n[start]\njoints.b = 0.5\n";
    let urdf = URDF.replacen("lower='-1' upper='1'", "lower='0.5' upper='1'", 1);
    let urdf = urdf
        .replacen("<origin xyz='0.04 0 0'/>", "<origin xyz='0.04 0 0'/><mimic joint='a' multiplier='-1'/>", 1)
        .replacen("lower='-1' upper='1'", "lower='0' upper='1'", 1);
    let settings = Some((Path::new("hand.toml"), servo));
    let error = from_text((Path::new("hand.urdf"), &urdf), settings, None, &LoadOptions::default())
        .expect_err("refused");
    assert!(error.to_string().contains("joint 'b': mimics 'a'"), "{error}");
}

#[test]
fn every_coupling_counts_in_the_content_hash() {
    let plain = read("").expect("a sound hand").content_hash();
    let wound = format!(
        "[motors.m]\nscaling = 1\nspeed_limit = 1\n[tendons.t]\n{TENDON}joints.a = 1\nmotors.m = 1\n"
    );
    let mut hashes = vec![plain];
    for toml in [
        "[springs.s]\njoints.a = 1\nstiffness = 1\n".to_owned(),
        "[linkages.p]\nlinks = ['one', 'two']\npoints = [[0, 0, 0], [0, 0, 0]]\n".to_owned(),
        format!("[tendons.t]\n{TENDON}joints.a = 1\n"),
        format!("[tendons.t]\n{TENDON}joints.a = 1\nrest = 1\n"),
        wound.clone(),
        format!("{wound}hold_limit = 3\n"),
        format!("{wound}hold_limit = 3\nbreakaway = true\n"),
        format!("[tendons.t]\n{TENDON}polynomial.a.coefficients = [1]\n"),
        format!("[tendons.t]\n{TENDON}table.a = {{ at = [0, 1], length = [0, 1] }}\n"),
        format!("[tendons.t]\n{TENDON}eyelets.a = {{ before = [0.01, 0], after = [0, 0.02] }}\n"),
        format!("[tendons.t]\n{TENDON}joints.a = 1\nfriction = 0.1\nwrap_angle = 1\n"),
        format!("[tendons.t]\n{TENDON}joints.a = 1\nfriction = 0.1\nwrap_angle = 2\n"),
        format!("[coordinates]\na.friction = 0.01\n[tendons.t]\n{TENDON}joints.a = 1\n"),
    ] {
        hashes.push(read(&toml).expect("a sound hand").content_hash());
    }
    for (i, hash) in hashes.iter().enumerate() {
        assert!(!hashes[..i].contains(hash), "{i}");
    }
}

#[test]
fn a_cable_passes_its_guides_from_the_motor_outwards() {
    let rubbing = |more: &str| format!("[tendons.t]\n{TENDON}joints = {{ a = 1, b = 2 }}\n{more}");
    let hand = read(&rubbing(
        "routing = ['b', 'a']\nfriction = 0.1\nwrap_angle = { a = 0.5, b = 1.5 }\n[every_coordinate]\nfriction = 0.002\n",
    ))
    .expect("a sound hand");
    let guides: Vec<(usize, f64, f64)> =
        hand.tendons[0].guides.iter().map(|g| (g.coordinate, g.friction, g.wrap_angle)).collect();
    assert_eq!(guides, [(1, 0.1, 1.5), (0, 0.1, 0.5)]);
    assert_eq!(hand.coordinates[0].friction, 0.002);
    // The way alone, or no friction, leaves the hand as it is.
    let plain = read(&rubbing("")).expect("a sound hand").content_hash();
    for more in ["routing = ['b', 'a']\n", "routing = ['b', 'a']\nfriction = 0\nwrap_angle = 1\n"] {
        assert_eq!(read(&rubbing(more)).expect("a sound hand").content_hash(), plain, "{more}");
    }
    for (more, words) in [
        (
            "friction = 0.1\nwrap_angle = 1\n",
            "hand.toml: [tendons.t]: has friction or wrap_angle, but no routing; valid: routing = [joint, …]: each of a, b once",
        ),
        ("routing = ['a']\nfriction = 0.1\nwrap_angle = 1\n", "[tendons.t]: routing leaves out 'b'"),
        (
            "routing = ['a', 'b', 'a']\nfriction = 0.1\nwrap_angle = 1\n",
            "[tendons.t]: routing names 'a' twice",
        ),
        ("routing = ['a', 'c']\n", "[tendons.t]: routing names 'c', on which it does not pull; valid: a, b"),
        ("routing = ['a', 'b']\nfriction = { c = 0.1 }\nwrap_angle = 1\n", "friction names 'c', on which"),
        ("routing = ['a', 'b']\nfriction = 0.1\n", "has friction, but no wrap_angle"),
        ("routing = ['a', 'b']\nwrap_angle = 0.1\n", "has wrap_angle, but no friction"),
        (
            "routing = ['a', 'b']\nfriction = -0.1\nwrap_angle = 1\n",
            "[tendons.t]: has friction -0.1; valid: friction of at least 0",
        ),
        ("routing = ['a', 'b']\nfriction = 0.1\nwrap_angle = { a = -1 }\n", "has wrap_angle.a -1"),
        (
            "routing = ['a', 'b']\nfriction = 0.1\nwrap_angle = 90\n",
            "sums up to 18; valid: at most 5 along the cable; wrap_angle is in rad",
        ),
        ("routing = ['a', 'b']\nfriction = 'much'\n", "a number for all joints, or a table"),
        (
            "both_ways = true\nrouting = ['a', 'b']\nfriction = 0.1\nwrap_angle = 1\n",
            "has friction, and both_ways",
        ),
        (
            "[coordinates]\na.friction = -1\n",
            "[coordinates.a]: has friction -1; valid: friction of at least 0",
        ),
    ] {
        refused(&rubbing(more), words);
    }
}

#[test]
fn dry_friction_of_the_urdf_counts_with_that_of_followers() {
    let dynamics = |friction: &str| format!("<dynamics damping='0.1' friction='{friction}'/></joint>");
    let read = |own: &str| {
        let urdf = URDF.replacen("</joint>", &dynamics(own), 1).replace(
            "</joint><joint name='fixed'",
            &format!("<mimic joint='a' multiplier='-2'/>{}<joint name='fixed'", dynamics("0.03")),
        );
        let toml = format!("[tendons.t]\n{TENDON}joints.a = 1\n");
        let settings = Some((Path::new("hand.toml"), toml.as_str()));
        from_text((Path::new("hand.urdf"), &urdf), settings, None, &LoadOptions::default())
    };
    let loaded = read("0.02").expect("a sound hand");
    assert_eq!(loaded.hand.coordinates.len(), 1);
    assert!((loaded.hand.coordinates[0].friction - (0.02 + 2.0 * 0.03)).abs() < 1e-15);
    assert!(loaded.warnings.iter().all(|w| !w.message.contains("friction")), "{:?}", loaded.warnings);
    let error = read("-0.02").expect_err("refused").to_string();
    assert!(error.contains("joint 'a': has friction -0.02; valid: finite friction of at least 0"), "{error}");
}
