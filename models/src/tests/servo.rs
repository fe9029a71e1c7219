//! Servo hands, base frame and start: what `hand.toml` adds to a URDF without tendons.

use std::f64::consts::{FRAC_PI_2, PI};
use std::path::Path;

use crate::error::ModelError;
use crate::measure::{HandLimits, Sources};
use crate::read::{self, LoadOptions, Loaded};
use crate::{Pose, Vec3};

const BODY: &str = r#"<inertial><origin xyz="0 0 0.02"/><mass value="0.05"/>
    <inertia ixx="1e-5" iyy="1e-5" izz="1e-5" ixy="0" ixz="0" iyz="0"/></inertial>
    <collision><origin xyz="0 0 0.02"/><geometry><box size="0.02 0.02 0.04"/></geometry></collision>"#;

/// A palm with a flange, a finger of two joints, a third that follows the second, and a thumb that slides.
fn urdf(more: &str) -> String {
    let link = |name: &str| format!(r#"<link name="{name}">{BODY}</link>"#);
    let joint = |name: &str, kind: &str, (from, to): (&str, &str), limit: &str| {
        format!(
            r#"<joint name="{name}" type="{kind}"><parent link="{from}"/><child link="{to}"/>
            <origin xyz="0 0 0.05"/><axis xyz="1 0 0"/>{limit}</joint>"#
        )
    };
    let range = |lower: f64, upper: f64| {
        format!(r#"<limit lower="{lower}" upper="{upper}" effort="2" velocity="3"/>"#)
    };
    format!(
        r#"<robot name="r">{}{}{}{}{}<link name="flange"/>
        <joint name="mount" type="fixed"><parent link="palm"/><child link="flange"/>
        <origin xyz="0 0 -0.1" rpy="0 1.5707963267948966 0"/></joint>{}{}{}{}{more}</robot>"#,
        link("palm"),
        link("la"),
        link("lb"),
        link("lc"),
        link("ld"),
        joint("a", "revolute", ("palm", "la"), &range(-0.5, 1.5)),
        joint("b", "revolute", ("la", "lb"), &range(0.0, 1.0)),
        joint("c", "revolute", ("lb", "lc"), &format!(r#"{}<mimic joint="b"/>"#, range(0.0, 1.0))),
        joint("d", "prismatic", ("palm", "ld"), &range(0.0, 0.04)),
    )
}

fn simple(name: &str, joint: &str, actuator: &str) -> String {
    format!(
        r#"<transmission name="{name}"><type>transmission_interface/SimpleTransmission</type>
        <joint name="{joint}"><hardwareInterface>EffortJointInterface</hardwareInterface></joint>
        <actuator name="{actuator}"><mechanicalReduction>50</mechanicalReduction></actuator></transmission>"#
    )
}

fn read(urdf: &str, settings: &str) -> Result<Loaded, ModelError> {
    let settings = Some((Path::new("x/hand.toml"), settings));
    read::from_text((Path::new("x/hand.urdf"), urdf), settings, None, &LoadOptions::default())
}

#[track_caller]
fn fails(settings: &str, parts: &[&str]) {
    let message = read(&urdf(""), settings).unwrap_err().to_string();
    for part in parts {
        assert!(message.contains(part), "'{part}' is not in: {message}");
    }
}

#[track_caller]
fn near(a: f64, b: f64) {
    assert!((a - b).abs() < 1e-12, "{a} is not {b}");
}

#[test]
fn a_simple_transmission_is_a_servo_over_the_range_of_its_joint() {
    let Loaded { hand, warnings, .. } = read(&urdf(&simple("s", "a", "m")), "").unwrap();
    let ([motor], [drive]) = (hand.motors.as_slice(), hand.tendons.as_slice()) else {
        panic!("{:?} {:?}", hand.motors, hand.tendons)
    };
    assert_eq!((motor.name.as_str(), drive.name.as_str()), ("m", "s"));
    // σ = 0 and 1 are the limits of the joint; <limit velocity> is 3 rad/s over 2 rad.
    near(motor.scaling * (0.0 - motor.offset), -0.5);
    near(motor.scaling * (1.0 - motor.offset), 1.5);
    near(motor.speed_limit, 1.5);
    assert!(drive.both_ways && drive.moment_arms == [(0, 1.0)]);
    assert_eq!((drive.force_limit, drive.stiffness, drive.damping), (2.0, 20.0, 0.2));
    // The joint begins at 0 rad.
    near(hand.start.sigma_of(0), 0.25);
    assert!(warnings.iter().all(|w| !w.message.contains("no spring") || !w.element.contains("'a'")));
    // Joints that cannot be servos.
    let none = ["none", "c", "mount"].map(|joint| simple(joint, joint, "m")).concat();
    let Loaded { hand, warnings, .. } = read(&urdf(&none), "").unwrap();
    assert!(hand.motors.is_empty());
    for joint in ["none", "c", "mount"] {
        let text = format!("transmission '{joint}': joint '{joint}' has no motion of its own");
        assert!(warnings.iter().any(|w| w.to_string().contains(&text)), "{warnings:?}");
    }
    assert!(warnings.iter().any(|w| w.message.contains("servo_joints = \"all\"")), "{warnings:?}");
}

#[test]
fn one_line_gives_each_joint_a_servo_and_followers_follow() {
    let hand = read(&urdf(""), "servo_joints = 'all'").unwrap().hand;
    let names: Vec<&str> = hand.motors.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["a", "b", "d"]);
    assert_eq!(hand.coordinates.len(), 3);
    // A sliding joint has its effort at 5 mm.
    assert_eq!((hand.tendons[2].stiffness, hand.motors[2].scaling), (400.0, 0.04));
    let limits = HandLimits { motor_speed_per_s: 100.0, ..HandLimits::default() };
    assert_eq!(limits.excesses(&hand.figures(), &Sources::of_urdf(Path::new("x"))), vec![]);
    let listed = read(&urdf(""), "servo_joints = ['b']").unwrap().hand;
    assert_eq!(listed.motors.len(), 1);
    assert_eq!(listed.motors[0].name, "b");
    // A joint with a tendon keeps it.
    let tendon = r#"<transmission name="t"><type>transmission_interface/AdaptiveSynergyTransmission</type>
        <actuator name="pull"/><joint name="a"/></transmission>"#;
    let both = read(&urdf(&format!("{tendon}{}", simple("s", "a", "m"))), "servo_joints = 'all'").unwrap();
    let names: Vec<&str> = both.hand.motors.iter().map(|m| m.name.as_str()).collect();
    assert_eq!(names, ["pull", "b", "d"]);
    assert!(both.warnings.iter().any(|w| w.message.contains("joint 'a' has a tendon already")));
}

#[test]
fn a_motor_of_a_servo_can_be_stated() {
    let motor = "[motors.m]\nscaling = 0.5\noffset = 0.2\nspeed_limit = 4.0\n";
    let hand = read(&urdf(&simple("s", "a", "m")), motor).unwrap().hand;
    let [motor] = hand.motors.as_slice() else { panic!("{:?}", hand.motors) };
    assert_eq!((motor.scaling, motor.offset, motor.speed_limit), (0.5, 0.2, 4.0));
    // Its drive is as before.
    assert_eq!((hand.tendons[0].stiffness, hand.tendons[0].force_limit), (20.0, 2.0));
    let named = "servo_joints = ['b']\n[motors.b]\nscaling = 0.5\nspeed_limit = 4.0\n";
    assert_eq!(read(&urdf(""), named).unwrap().hand.motors[0].speed_limit, 4.0);
    fails("servo_joints = ['b']\n[motors.a]\nscaling = 1.0\nspeed_limit = 1.0", &["[motors.a]", "one of: b"]);
}

#[test]
fn numbers_of_a_servo_can_be_stated() {
    let settings = "[every_servo]\neffort = 5.0\nstiffness = 8.0\n\
        [servos.a]\nrange = [0.0, -0.4]\nvelocity = 0.8\ndamping = 0.5\n[servos.b]\neffort = 1.0\n";
    let hand = read(&urdf(""), settings).unwrap().hand;
    assert_eq!(hand.motors.len(), 2);
    let (motor, drive) = (&hand.motors[0], &hand.tendons[0]);
    near(motor.scaling * (1.0 - motor.offset), -0.4);
    near(motor.speed_limit, 2.0);
    assert_eq!((drive.force_limit, drive.stiffness, drive.damping), (5.0, 8.0, 0.5));
    assert_eq!((hand.tendons[1].force_limit, hand.tendons[1].stiffness), (1.0, 8.0));
    let turning = urdf("").replacen("type=\"revolute\"", "type=\"continuous\"", 1);
    let hand = read(&turning, "servo_joints = ['a']").unwrap().hand;
    near(hand.motors[0].scaling, 2.0 * PI);
    near(hand.start.sigma_of(0), 0.5);
    fails("servo_joints = 'some'", &["x/hand.toml: servo_joints: is 'some'", "\"all\""]);
    fails("servo_joints = ['c']", &["[servo_joints.c]", "one of: a, b, d"]);
    fails("[servos.z]", &["[servos.z]", "one of: a, b, d"]);
    fails("[servos.a]\neffort = -1.0", &["[servos.a]: has effort -1"]);
    fails("[servos.a]\nrange = [1.0, 1.0]", &["[servos.a]: has range"]);
    let weak = urdf("").replace("effort=\"2\"", "effort=\"0\"");
    let message = read(&weak, "servo_joints = 'all'").unwrap_err().to_string();
    assert_eq!(message.matches("has no <limit effort> for its servo").count(), 3, "{message}");
    // A transmission that ROS needs says nothing about a servo.
    let loaded = read(&weak.replace("</robot>", &format!("{}</robot>", simple("s", "a", "m"))), "").unwrap();
    assert!(loaded.hand.motors.is_empty());
    assert!(loaded.warnings.iter().any(|w| w.element == "transmission 's'"), "{:?}", loaded.warnings);
}

#[test]
fn a_servo_far_from_zero_counts_from_its_first_end() {
    let far = urdf("").replace(r#"lower="0" upper="1" effort"#, r#"lower="1.2" upper="1.5" effort"#);
    let hand = read(&far, "servo_joints = ['b']\n[start]\njoints = { b = 1.35 }").unwrap().hand;
    let wound = |sigma: f64| hand.tendons[0].wound(&hand.motors, |_| sigma);
    near(wound(0.0), 1.2);
    near(wound(1.0), 1.5);
    near(hand.start.sigma_of(0), 0.5);
    let excesses = HandLimits::default().excesses(&hand.figures(), &Sources::of_urdf(Path::new("x")));
    assert!(excesses.iter().all(|excess| !excess.to_string().contains("motor_offset")), "{excesses:?}");
}

#[test]
fn a_run_begins_where_the_settings_say() {
    let begin = |start: &str| {
        let hand = read(&urdf(""), &format!("servo_joints = 'all'\n{start}")).unwrap().hand;
        ((0..3).map(|m| hand.start.sigma_of(m)).collect::<Vec<_>>(), hand.beginning())
    };
    let (sigma, q) = begin("");
    assert!((sigma[0] - 0.25).abs() < 1e-12 && sigma[1..] == [0.0, 0.0], "{sigma:?}");
    assert_eq!(q, [0.0, 0.0, 0.0]);
    let (sigma, q) = begin("[start]\njoints = { a = 0.5, d = 0.01 }\nmotors = { b = 0.75 }");
    near(sigma[0], 0.5);
    near(sigma[2], 0.25);
    assert_eq!((sigma[1], q.as_slice()), (0.75, &[0.5, 0.0, 0.01][..]));
    assert_eq!(begin("[start]\nsigma = 0.5").0, [0.5, 0.5, 0.5]);
    fails("[start]\njoints = { z = 1.0 }", &["[start] joints: names 'z'"]);
    fails("servo_joints = 'all'\n[start]\nmotors = { z = 1.0 }", &["[start] motors: names 'z'", "a, b, d"]);
    // It is part of what the hand does; nothing of it is in the hash of other hands.
    let hash = |start: &str| {
        let settings = format!("servo_joints = ['b']\n{start}");
        read(&urdf(""), &settings).unwrap().hand.content_hash()
    };
    assert_eq!(hash(""), hash("[start]\nsigma = 0.0"));
    assert_ne!(hash(""), hash("[start]\nsigma = 0.5"));
}

#[test]
fn the_base_frame_can_be_a_link_or_a_pose() {
    let place = |base: &str| {
        let hand = read(&urdf(""), &format!("servo_joints = 'all'\n{base}")).unwrap().hand;
        let lb = hand.link("lb").unwrap();
        (hand.base_from_links(&[0.0; 3])[lb], hand)
    };
    let (plain, hand) = place("");
    let at_origin = place("[base]\nposition = [0.0, 0.0, 0.0]").1;
    assert_eq!(hand.content_hash(), at_origin.content_hash());
    let turn = Pose::from_parts(Vec3::new(0.0, 0.0, -0.1), crate::rotation::from_rpy([0.0, FRAC_PI_2, 0.0]));
    let expected = turn.inverse() * plain;
    for base in [
        "[base]\nlink = 'flange'",
        "[base]\nposition = [0.0, 0.0, -0.1]\nrpy = [0.0, 1.5707963267948966, 0.0]",
        "[base]\nposition = [0.0, 0.0, -0.1]\nquat_xyzw = [0.0, 2.0, 0.0, 2.0]",
        "[base]\nlink = 'palm'\nposition = [0.0, 0.0, -0.1]\nrpy = [0.0, 1.5707963267948966, 0.0]",
    ] {
        let (found, hand) = place(base);
        assert!((found.translation - expected.translation).length() < 1e-12, "{base}: {found:?}");
        assert!((found.rotation * expected.rotation.inverse()).xyz().length() < 1e-12, "{base}: {found:?}");
        // Mass and shapes are at the same place of the hand.
        let com = turn.transform_point(hand.links[0].inertia.com);
        let root = turn * hand.link_from_own(0);
        assert!(
            root.translation.length() < 1e-12 && root.rotation.xyz().length() < 1e-12,
            "{base}: {root:?}"
        );
        assert_eq!(hand.link_from_own(1), Pose::IDENTITY);
        assert!((com - Vec3::new(0.0, 0.0, 0.02)).length() < 1e-12, "{com:?}");
    }
    fails("[base]\nlink = 'lb'", &["x/hand.toml: [base]: names link 'lb', which joint 'b' moves"]);
    fails("[base]\nlink = 'z'", &["[base]: names link 'z'"]);
    fails(
        "[base]\nrpy = [0.0, 0.0, 0.0]\nquat_xyzw = [0.0, 0.0, 0.0, 1.0]",
        &["[base]: has quat_xyzw and rpy"],
    );
    fails("[base]\nquat_xyzw = [0.0, 0.0, 0.0, 0.0]", &["[base]: has quat_xyzw without a direction"]);
    fails("[base]\nposition = [inf, 0.0, 0.0]", &["[base]: has position inf"]);
}
