//! Forms that published URDFs have, each with its right outcome.

use std::fs;
use std::path::Path;

use crate::error::{ModelError, Refused};
use crate::read::{self, LoadOptions, Loaded};

const BODY: &str = r#"<inertial><origin xyz="0 0 0.02"/><mass value="0.05"/>
    <inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 0.02"/><geometry><box size="0.02 0.02 0.04"/></geometry></collision>"#;
const JOINT: &str = r#"<origin xyz="0 0 0.05"/><axis xyz="1 0 0"/>
    <limit lower="0" upper="1.5" effort="1" velocity="1"/><dynamics damping="0.01"/>"#;
const TRANSMISSION: &str = r#"<transmission name="t"><type>transmission_interface/AdaptiveSynergyTransmission</type>
    <actuator name="m"/><joint name="a"><mechanicalElasticity>0.2</mechanicalElasticity></joint></transmission>"#;
const SETTINGS: &str =
    "[motors.m]\nscaling = 2.0\nspeed_limit = 2.0\n[tendons.t]\nstiffness = 300.0\nforce_limit = 2.0\n";

/// A palm and a finger of two links.
fn urdf() -> String {
    format!(
        r#"<robot name="r"><link name="palm">{BODY}</link><link name="la">{BODY}</link><link name="lb">{BODY}</link>
        <joint name="a" type="revolute"><parent link="palm"/><child link="la"/>{JOINT}</joint>
        <joint name="b" type="revolute"><parent link="la"/><child link="lb"/>{JOINT}</joint>{TRANSMISSION}</robot>"#
    )
}

/// The hand with a part replaced.
fn with(from: &str, to: &str) -> String {
    assert!(urdf().contains(from), "{from}");
    urdf().replacen(from, to, 1)
}

fn read(urdf: &str) -> Result<Loaded, ModelError> {
    let settings = Some((Path::new("x/hand.toml"), SETTINGS));
    read::from_text((Path::new("x/hand.urdf"), urdf), settings, None, &LoadOptions::default())
}

/// The warnings of a hand that loads.
#[track_caller]
fn warnings(urdf: &str) -> String {
    read(urdf).unwrap().warnings.iter().map(|w| format!("{w}\n")).collect()
}

#[track_caller]
fn fails(urdf: &str, parts: &[&str]) {
    let message = read(urdf).unwrap_err().to_string();
    for part in parts {
        assert!(message.contains(part), "'{part}' is not in: {message}");
    }
}

#[test]
fn elements_may_be_in_any_order_and_those_that_are_not_used_may_have_any_content() {
    let plain = read(&urdf()).unwrap().hand.content_hash();
    let visual = r#"<visual><geometry><box size="1 1 1"/></geometry><material><color/></material></visual>"#;
    let (inertial, collision) = BODY.split_once("</inertial>").unwrap();
    let second = collision.replace("0.02 0.02 0.04", "0.01 0.01 0.01");
    for order in [
        format!("{visual}{BODY}{visual}"),
        format!("{collision}{visual}{inertial}</inertial>{visual}<gazebo><a/></gazebo>"),
    ] {
        assert_eq!(read(&with(BODY, &order)).unwrap().hand.content_hash(), plain);
    }
    let split = with(BODY, &format!("{collision}{visual}{second}{inertial}</inertial>"));
    assert_eq!(read(&split).unwrap().hand.links[0].geoms.len(), 2);
    let more = with("<dynamics", r#"<safety_controller/><calibration rising="x"/><dynamics"#);
    assert_eq!(read(&more).unwrap().hand.content_hash(), plain);
}

#[test]
fn a_visual_without_a_readable_shape_is_left_out_with_a_warning() {
    let plain = read(&urdf()).unwrap().hand.content_hash();
    for (geometry, why) in [
        ("<geometry/>", "has no shape in its <geometry>"),
        ("", "has no shape in its <geometry>"),
        ("<geometry><plane/></geometry>", "has the shape <plane>, which is unknown"),
        (r#"<geometry><box size="large"/></geometry>"#, "left out"),
    ] {
        let text = with(BODY, &format!("{BODY}<visual>{geometry}</visual>"));
        let all = warnings(&text);
        assert!(all.contains("x/hand.urdf: link 'palm', visual 1: ") && all.contains(why), "{all}");
        assert_eq!(read(&text).unwrap().hand.content_hash(), plain);
        // The physics needs every collision shape.
        let text = with(BODY, &format!("{BODY}<collision>{geometry}</collision>"));
        fails(&text, &["link 'palm', collision 2: ", "<capsule>"]);
    }
}

#[test]
fn a_binary_stl_may_begin_as_a_text() {
    let corners = [[0.0_f32, 0.0, 0.0], [0.02, 0.0, 0.0], [0.0, 0.02, 0.0], [0.0, 0.0, 0.04]];
    let mut stl = b"solid exported by a CAD program".to_vec();
    stl.resize(80, b' ');
    stl.extend(4_u32.to_le_bytes());
    for skipped in 0..4 {
        stl.extend([0; 12]);
        let face = corners.iter().enumerate().filter(|(k, _)| *k != skipped).flat_map(|(_, p)| p);
        stl.extend(face.flat_map(|x| x.to_le_bytes()));
        stl.extend([0; 2]);
    }
    let folder = tempfile::tempdir().unwrap();
    let box_shape = r#"<box size="0.02 0.02 0.04"/>"#;
    fs::write(folder.path().join("hand.urdf"), with(box_shape, r#"<mesh filename="m.stl"/>"#)).unwrap();
    let load = |stl: &[u8]| {
        fs::write(folder.path().join("m.stl"), stl).unwrap();
        read::hand(folder.path(), &LoadOptions::default()).map(|loaded| loaded.hand.content_hash())
    };
    let hash = load(&stl).unwrap();
    let mut plain = stl.clone();
    plain[..5].fill(0);
    assert_eq!(load(&plain).unwrap(), hash);
    // A file of another size is neither.
    stl.truncate(stl.len() - 50);
    assert!(load(&stl).unwrap_err().to_string().contains("not valid STL"));
}

#[test]
fn a_centre_of_mass_outside_its_link_is_reported_with_its_distance() {
    assert!(!warnings(&urdf()).contains("centre of mass"));
    let all = warnings(&with(r#"<origin xyz="0 0 0.02"/><mass"#, r#"<origin xyz="0.3 0 0.02"/><mass"#));
    assert!(all.contains("link 'palm': its centre of mass is 0.29 m outside the box"), "{all}");
}

#[test]
fn an_actuator_that_is_not_used_and_its_gear_are_reported() {
    let second = with(r#"<actuator name="m"/>"#, r#"<actuator name="m"/><actuator name="m2"/>"#);
    let all = warnings(&second);
    assert!(all.contains("transmission 't': its second actuator 'm2' is not used"), "{all}");
    let gear = r#"<actuator name="m"><mechanicalReduction>50</mechanicalReduction></actuator>"#;
    let all = warnings(&with(r#"<actuator name="m"/>"#, gear));
    assert!(all.contains("transmission 't': <mechanicalReduction> 50 of actuator 'm' is not used"), "{all}");
    let one = gear.replace("50", "1");
    assert!(!warnings(&with(r#"<actuator name="m"/>"#, &one)).contains("not used"));
}

#[test]
fn two_springs_of_one_joint_are_an_error_with_both_places() {
    let second = |spring: &str| {
        let more = TRANSMISSION.replace("\"t\"", "\"u\"").replace("0.2", spring);
        with("</robot>", &format!("{more}</robot>"))
    };
    read(&second("0.2")).unwrap();
    fails(&second("0.9"), &["joint 'a': ", "0.2 in transmission 't' and 0.9 in transmission 'u'"]);
    // A transmission that states none leaves the joint's spring to the others.
    let first = second("0.9").replacen("<mechanicalElasticity>0.2</mechanicalElasticity>", "", 1);
    assert_eq!(read(&first).unwrap().hand.coordinates[0].stiffness, 0.9);
}

#[test]
fn limits_of_a_mimic_are_named_where_they_are() {
    let mimic = |limits: &str| {
        let joint = JOINT.replace(r#"lower="0" upper="1.5""#, limits);
        let b = r#"<child link="lb"/>"#;
        with(&format!("{b}{JOINT}"), &format!(r#"{b}{joint}<mimic joint="a" multiplier="-1"/>"#))
    };
    fails(
        &mimic(r#"lower="0" upper="1.5""#),
        &[
            "joint 'b': mimics 'a'; its limits 0 to 1.5",
            "from -1.5 to 0 only",
            "valid: limits within -1.5 to 0",
        ],
    );
    read(&mimic(r#"lower="-1.5" upper="0""#)).unwrap();
}

#[test]
fn other_formats_are_recognised_and_the_command_that_helps_is_named() {
    let folder = tempfile::tempdir().unwrap();
    let refused = |name: &str, text: &str| {
        let file = folder.path().join(name);
        fs::write(&file, text).unwrap();
        let error = read::hand(&file, &LoadOptions::default()).unwrap_err().to_string();
        assert!(error.contains(name), "{error}");
        error
    };
    let pointer = "version https://git-lfs.github.com/spec/v1\noid sha256:00\nsize 5\n";
    assert!(refused("lfs.urdf", pointer).contains("git lfs pull"));
    let import = "palmares hand import";
    for (name, text, problem) in [
        ("a.xml", "<?xml version='1.0'?><!-- <robot> -->\n<mujoco model='h'/>", "<mujoco>"),
        ("a.sdf", "<sdf version='1.6'/>", "<sdf>"),
        ("a.dae", "<COLLADA/>", "<COLLADA>"),
        ("a.rob", "### a hand\nTParent 1 0 0", "is no XML"),
        ("a.urdf.xacro", "<robot/>", "xacro"),
        ("a.urdf", "<robot xmlns:xacro='http://ros.org/wiki/xacro'><xacro:finger/></robot>", "xacro"),
    ] {
        let error = refused(name, text);
        assert!(error.contains(problem) && error.contains(import), "{error}");
    }
    // The name of the macros alone, as xacro leaves it, is none.
    let expanded = with("<robot ", "<robot xmlns:xacro='http://www.ros.org/wiki/xacro' ");
    read(&expanded).unwrap();
    let shape = r#"<box size="0.02 0.02 0.04"/>"#;
    assert!(refused("b.urdf", &with(shape, r#"<mesh filename="m.dae"/>"#)).contains("convert it"));
    fs::write(folder.path().join("m.stl"), pointer).unwrap();
    fs::write(folder.path().join("c.urdf"), with(shape, r#"<mesh filename="m.stl"/>"#)).unwrap();
    let error = read::hand(&folder.path().join("c.urdf"), &LoadOptions::default()).unwrap_err().to_string();
    assert!(error.contains("m.stl: link 'palm': is a pointer") && error.contains("git lfs pull"), "{error}");
}

/// Faults of both files at once, each of which alone refuses the hand.
#[test]
fn every_problem_is_reported_in_one_run() {
    let folder = tempfile::tempdir().unwrap();
    let write = |name: &str, text: &str| fs::write(folder.path().join(name), text).unwrap();
    let examine = || -> Refused { read::examine(folder.path(), &LoadOptions::default()).unwrap_err() };
    let expect = |parts: &[&str]| {
        let refused = examine();
        let all: Vec<String> = refused.errors.iter().map(ToString::to_string).collect();
        assert_eq!(all.len(), parts.len(), "{all:#?}");
        for (error, part) in all.iter().zip(parts) {
            assert!(error.contains(part), "'{part}' is not in {error}");
        }
        refused
    };
    // Elements that cannot be read.
    write("hand.toml", &SETTINGS.replace("scaling = 2.0", "scaling = 0.0").replace("300", "-1"));
    let text = with(r#"<box size="0.02 0.02 0.04"/>"#, r#"<box size="wide"/>"#)
        .replace(r#"<child link="lb"/><origin xyz="0 0 0.05"/>"#, r#"<child link="lb"/><origin xyz="far"/>"#)
        .replace("0.2</mech", "soft</mech")
        .replacen(r#"<mass value="0.05"/>"#, r#"<mass value="-1"/>"#, 2);
    write("hand.urdf", &text);
    expect(&[
        "transmission 't', joint 'a'",
        "link 'palm', collision 1",
        "joint 'b'",
        "link 'palm': has the negative mass",
        "link 'la': has the negative mass",
        "[motors.m]: has scaling 0",
        "[tendons.t]: has stiffness -1",
    ]);
    // Elements that do not fit each other, and the warnings beside them.
    write("hand.toml", &format!("{SETTINGS}[links.x]\nmass = 1.0\n[links.y]\nmass = 1.0\n"));
    let text = urdf()
        .replace(r#"<box size="0.02 0.02 0.04"/>"#, r#"<box size="0 0 0"/>"#)
        .replace(r#"<link name="lb">"#, r#"<link name="lb"><visual/>"#)
        .replace(r#"<joint name="b" type="revolute">"#, r#"<joint name="b" type="floating">"#);
    write("hand.urdf", &text);
    let refused = expect(&[
        "joint 'b': is of type Floating",
        "link 'palm': ",
        "link 'la': ",
        "link 'lb': ",
        "[links.x]",
        "[links.y]",
    ]);
    assert!(refused.warnings.iter().any(|w| w.element == "link 'lb', visual 1"), "{:?}", refused.warnings);
    // As one error it has a line for each.
    let error = refused.into_error();
    assert_eq!(error.to_string().lines().count(), 6);
    assert!(error.file().is_some_and(|file| file.ends_with("hand.urdf")));
}
