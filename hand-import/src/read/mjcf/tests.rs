//! Small documents of our own.

use std::path::{Path, PathBuf};

use palmares_models::hand::SpringNumbers;
use palmares_models::{Pose, Rotation, Vec3};

use super::compile::compile;
use super::frames::Frames;
use super::length::{fit, length};
use super::model::Model;
use super::motions::Motions;
use crate::decision::{DecisionKind, Log};
use crate::draft::{Draft, Drive, Geometry, JointKind, TendonPath};
use crate::options::ImportOptions;
use crate::read::reading::Reading;
use crate::source::Source;

fn source(files: &[(&str, &str)]) -> Source {
    let entries = files.iter().map(|(name, text)| (PathBuf::from(name), text.as_bytes().to_vec())).collect();
    Source::memory(Path::new("test"), entries).expect("small")
}

fn model(content: &str) -> Model {
    let source = source(&[("hand.xml", content)]);
    let path = Path::new("hand.xml");
    let root = super::include::parse_with_includes(&source, path).expect("XML");
    let mut log = Log::new(path);
    let (model, _) = compile(&source, path, &root, &mut log);
    assert!(log.of(DecisionKind::Problem).next().is_none(), "{:?}", log.decisions);
    model
}

fn read(files: &[(&str, &str)]) -> (Draft, Log) {
    let source = source(files);
    let path = PathBuf::from("hand.xml");
    let options = ImportOptions::default();
    let mut reading = Reading::open(&source, &path, "MJCF", &options).expect("a text");
    let draft = super::read(&mut reading).expect("a hand");
    (draft, reading.log)
}

fn draft(content: &str) -> (Draft, Log) {
    read(&[("hand.xml", content)])
}

/// A document with a world.
fn document(head: &str, world: &str, tail: &str) -> String {
    format!("<mujoco model='test'>{head}<worldbody>{world}</worldbody>{tail}</mujoco>")
}

fn near(a: f64, b: f64) -> bool {
    (a - b).abs() < 1e-12
}

fn direction(model: &Model, body: &str, v: Vec3) -> Vec3 {
    model.bodies[model.body(body).expect("is there")].pose.rotation * v
}

#[test]
fn all_five_orientations_are_the_same_quarter_turn() {
    let world = "<body name='q' quat='0.7071067811865476 0 0 0.7071067811865476'/>\
        <body name='a' axisangle='0 0 2 90'/>\
        <body name='x' xyaxes='0 1 0 -1 0.5 0'/>\
        <body name='e' euler='0 0 90'/>";
    let model = model(&document("", world, ""));
    for body in ["q", "a", "x", "e"] {
        let off = direction(&model, body, Vec3::X) - Vec3::Y;
        assert!(off.length() < 1e-12, "{body}: {off:?}");
    }
    let z = self::model(&document("", "<body name='z' zaxis='0 3 0'/>", ""));
    assert!((direction(&z, "z", Vec3::Z) - Vec3::Y).length() < 1e-12);
}

#[test]
fn euler_sequences_turn_with_the_frame_or_about_fixed_axes() {
    let of = |sequence: &str| {
        let head = format!("<compiler angle='degree' eulerseq='{sequence}'/>");
        model(&document(&head, "<body name='b' euler='90 90 0'/>", ""))
    };
    // The second turn is about the frame's own y, or about the fixed one.
    assert!((direction(&of("xyz"), "b", Vec3::Z) - Vec3::X).length() < 1e-12);
    assert!((direction(&of("XYZ"), "b", Vec3::X) + Vec3::Z).length() < 1e-12);
}

#[test]
fn classes_inherit_and_childclass_reaches_down() {
    let head = "<compiler angle='radian'/><default><joint damping='1' axis='1 0 0'/>\
        <default class='finger'><joint damping='2' range='0 1'/><geom size='0.01 0.02' type='capsule'/>\
        <default class='tip'><joint damping='3'/></default></default></default>";
    let world = "<body name='palm'><geom size='0.1'/><body name='a' childclass='finger'>\
        <joint name='a'/><geom size='0.005'/><body name='b'><joint name='b' class='tip'/><geom mass='0.1'/></body></body></body>";
    let model = model(&document(head, world, ""));
    let joint = |name: &str| &model.joints[model.joint(name).expect("is there")];
    assert_eq!((joint("a").damping, joint("b").damping), (2.0, 3.0));
    assert_eq!((joint("a").range, joint("b").axis), (Some([0.0, 1.0]), Vec3::X));
    // A short list replaces the first numbers of the class.
    let mass = model.bodies[model.body("a").expect("is there")].inertia.mass;
    let (r, half) = (0.005f64, 0.02);
    let volume = std::f64::consts::PI * r * r * (2.0 * half + 4.0 / 3.0 * r);
    assert!(near(mass, 1000.0 * volume), "{mass}");
    assert_eq!(model.bodies[model.body("b").expect("is there")].inertia.mass, 0.1);
}

#[test]
fn an_include_brings_its_elements_and_a_circle_is_an_error() {
    let part = "<mujocoinclude><body name='b'><geom size='0.1'/></body></mujocoinclude>";
    let main = document("", "<include file='part.xml'/>", "");
    let (draft, _) = read(&[("hand.xml", &main), ("part.xml", part)]);
    assert_eq!(draft.links[0].name, "b");
    let circle = source(&[("hand.xml", "<mujoco><include file='hand.xml'/></mujoco>")]);
    let error = super::include::parse_with_includes(&circle, Path::new("hand.xml")).expect_err("a circle");
    assert!(error.to_string().contains("includes itself"), "{error}");
}

#[test]
fn joints_off_the_body_and_several_of_them_move_it_as_in_mujoco() {
    let head = "<compiler angle='radian'/>";
    let world = "<body name='palm'><geom size='0.02'/>\
        <body name='thumb' pos='0.1 0 0.02' euler='0 0 0.5'>\
        <joint name='t1' axis='0 0 1' pos='0.01 0 0' ref='0.2' range='-1 1'/>\
        <joint name='t2' axis='0 1 0' pos='-0.01 0 0.03' range='-1 1'/>\
        <joint name='t3' type='slide' axis='1 0 1' range='0 0.01'/>\
        <geom type='box' size='0.01 0.02 0.03' pos='0.03 0 0'/></body></body>";
    let text = document(head, world, "");
    let model = model(&text);
    let (draft, _) = draft(&text);
    let names: Vec<&str> = draft.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(names, ["palm", "thumb_t1", "thumb_t2", "thumb"]);
    let limits = draft.joints[0].limits.expect("has a range");
    assert!(near(limits[0], -1.2) && near(limits[1], 0.8), "they count from ref: {limits:?}");
    // Pose of the geom by the draft's chain and by the document.
    let x = [0.3, -0.4, 0.005];
    let mut pose = Pose::IDENTITY;
    for (joint, x) in draft.joints.iter().zip(x) {
        let axis = Vec3::from_array(joint.axis).normalize();
        let moved = match joint.kind {
            JointKind::Prismatic => Pose::from_translation(axis * x),
            _ => Pose::from_parts(Vec3::ZERO, super::compiler::about(axis, x)),
        };
        pose = pose * joint.origin.pose() * moved;
    }
    let thumb = draft.links.iter().find(|link| link.name == "thumb").expect("is there");
    let by_draft = pose * thumb.collisions[0].origin.pose();
    let body = model.body("thumb").expect("is there");
    let by_model = model.world_from_bodies(&x)[body] * Pose::from_translation(Vec3::new(0.03, 0.0, 0.0));
    assert!((by_draft.translation - by_model.translation).length() < 1e-12);
    assert!(by_draft.rotation.angle_between(by_model.rotation) < 1e-7);
}

#[test]
fn primitives_have_the_inertia_of_their_solid() {
    let world = "<body name='b'><geom type='box' size='0.1 0.2 0.3' density='500' pos='1 0 0'/>\
        <geom type='ellipsoid' size='0.1 0.2 0.3' mass='2' pos='-1 0 0'/></body>\
        <body name='c'><geom type='cylinder' fromto='0 0 0 0.4 0 0' size='0.1' mass='3'/></body>";
    let model = model(&document("", world, ""));
    let b = model.bodies[1].inertia;
    let mass = 500.0 * 0.2 * 0.4 * 0.6;
    assert!(near(b.mass, mass + 2.0) && near(b.com.x, (mass - 2.0) / (mass + 2.0)), "{b:?}");
    let own = mass * (0.04 + 0.09) / 3.0 + 2.0 * (0.04 + 0.09) / 5.0;
    assert!(near(b.about_com.x_axis.x, own), "{b:?}");
    let c = model.bodies[2].inertia;
    assert!(
        (c.com - Vec3::X * 0.2).length() < 1e-12 && near(c.about_com.x_axis.x, 0.5 * 3.0 * 0.01),
        "{c:?}"
    );
}

#[test]
fn a_mesh_of_the_document_has_mass_and_becomes_triangles() {
    let head = "<asset><mesh name='wedge' vertex='0 0 0 1 0 0 0 1 0 0 0 1' scale='0.3 0.3 0.3'/></asset>";
    let (draft, _) = draft(&document(head, "<body name='b'><geom type='mesh' mesh='wedge'/></body>", ""));
    let mass = draft.links[0].inertial.expect("has a mass").mass;
    assert!(near(mass, 1000.0 * 0.027 / 6.0), "{mass}");
    assert!(matches!(&draft.links[0].collisions[0].geometry, Geometry::Mesh(_)));
}

#[test]
fn a_fixed_tendon_with_a_position_actuator_is_a_drive() {
    let head = "<compiler angle='radian'/>";
    let world = "<body name='palm'><geom size='0.02'/><body name='a' pos='0 0 0.05'><joint name='a' axis='0 1 0' range='0 1.5'/>\
        <geom size='0.01'/><body name='b' pos='0 0 0.03'><joint name='b' axis='0 1 0' range='0 1.5' stiffness='0.1' springref='-0.2'/>\
        <geom size='0.01'/></body></body></body>";
    let tail = "<tendon><fixed name='t'><joint joint='a' coef='1'/><joint joint='b' coef='0.5'/></fixed></tendon>\
        <actuator><position name='m' tendon='t' kp='8' kv='0.5' gear='2' ctrlrange='0 4' forcerange='-3 3'/>\
        <motor name='n' joint='a' gear='2' ctrlrange='-1 1'/></actuator>";
    let (draft, _) = draft(&document(head, world, tail));
    let tendon = &draft.tendons[0];
    assert_eq!(
        tendon.joints,
        [("a".to_owned(), TendonPath::Arm(1.0)), ("b".to_owned(), TendonPath::Arm(0.5))]
    );
    // f = gear (kp (ctrl − gear s)): K = kp gear², s_ref = ctrl/gear.
    assert_eq!(
        (tendon.stated.stiffness, tendon.stated.damping, tendon.stated.force_limit),
        (Some(32.0), Some(2.0), Some(6.0))
    );
    assert_eq!(tendon.stated.both_ways, Some(true));
    let motor = draft.actuators.iter().find(|a| a.name == "m").expect("is there");
    assert_eq!(motor.range, Some([0.0, 2.0]));
    let torque = draft.actuators.iter().find(|a| a.name == "n").expect("is there");
    assert_eq!((torque.drive.clone(), torque.force_limit), (Drive::Joint("a".to_owned()), Some(2.0)));
    let b = draft.joints.iter().find(|joint| joint.name == "b").expect("is there");
    assert_eq!((b.stated.stiffness, b.stated.rest), (Some(0.1), Some(-0.2)));
}

#[test]
fn a_general_actuator_of_a_range_of_255_steps_is_a_servo_in_radians() {
    let head = "<compiler angle='radian'/><default><general biastype='affine'/></default>";
    let world = "<body name='palm'><geom size='0.02'/><body name='a'><joint name='a' range='0 0.8'/><geom size='0.01'/></body></body>";
    let tail = "<actuator><general name='m' joint='a' ctrlrange='0 255' gainprm='0.3137254901960784 0 0' biasprm='0 -100 -10' forcerange='-5 5'/></actuator>";
    let (draft, _) = draft(&document(head, world, tail));
    let motor = &draft.actuators[0];
    assert_eq!((motor.gain, motor.damping, motor.force_limit), (Some(100.0), Some(10.0), Some(5.0)));
    let range = motor.range.expect("has a range");
    assert!(range[0] == 0.0 && near(range[1], 0.8), "{range:?}");
}

/// A finger of two joints with a cable over two pulleys of radius 5 mm, then 4 mm.
const CABLE: &str = "<body name='palm'><geom size='0.02'/><site name='s0' pos='0.01 0.005 0'/>\
    <geom name='p1' type='cylinder' size='0.005 0.005' pos='0.05 0 0' contype='0' conaffinity='0' mass='0'/>\
    <site name='side1' pos='0.05 0.02 0'/>\
    <body name='a' pos='0.05 0 0'><joint name='a' axis='0 0 -1' range='0 1.2'/><geom size='0.005' pos='0.02 0 0'/>\
    <site name='s1' pos='0.015 0.005 0'/><site name='s2' pos='0.03 0.004 0'/>\
    <geom name='p2' type='cylinder' size='0.004 0.005' pos='0.04 0 0' contype='0' conaffinity='0' mass='0'/>\
    <site name='side2' pos='0.04 0.02 0'/>\
    <body name='b' pos='0.04 0 0'><joint name='b' axis='0 0 -1' range='0 1.2'/><geom size='0.005' pos='0.01 0 0'/>\
    <site name='s3' pos='0.012 0.004 0'/></body></body></body>";

#[test]
fn a_spatial_tendon_over_pulleys_has_their_radii_as_moment_arms() {
    let tail = "<tendon><spatial name='t' springlength='0'><site site='s0'/><geom geom='p1' sidesite='side1'/><site site='s1'/>\
        <site site='s2'/><geom geom='p2' sidesite='side2'/><site site='s3'/></spatial></tendon>\
        <actuator><position name='m' tendon='t' kp='1000' ctrlrange='0.05 0.11' forcerange='-50 0'/></actuator>";
    let text = document("<compiler angle='radian'/>", CABLE, tail);
    let model = model(&text);
    let at = |a: f64, b: f64| length(&model, &model.tendons[0], &[a, b]);
    // Bending away from the cable's side winds it around the pulleys.
    assert!((at(0.6, 0.0) - at(0.0, 0.0) - 0.6 * 0.005).abs() < 1e-9, "{}", at(0.6, 0.0) - at(0.0, 0.0));
    assert!((at(0.3, 1.0) - at(0.3, 0.0) - 0.004).abs() < 1e-9);
    let mut log = Log::new(Path::new("hand.xml"));
    let motions = Motions::of(&model, &Frames::choose(&model, &mut log));
    let fit = fit(&model, &motions, &model.tendons[0]);
    assert!(fit.is_linear() && fit.error < 1e-8, "{fit:?}");
    let (draft, _) = draft(&text);
    let tendon = &draft.tendons[0];
    assert_eq!(tendon.stated.both_ways, Some(false), "it only pulls");
    for ((joint, path), (name, arm)) in tendon.joints.iter().zip([("a", -0.005), ("b", -0.004)]) {
        let TendonPath::Arm(r) = path else { panic!("{path:?}") };
        assert!(joint == name && (r - arm).abs() < 1e-6, "s = L₀ − L: {joint} {r}");
    }
}

#[test]
fn a_pulley_block_halves_what_follows() {
    let tail = "<tendon><spatial name='t'><site site='s0'/><site site='s1'/><pulley divisor='2'/><site site='s2'/><site site='s3'/></spatial></tendon>";
    let model = model(&document("<compiler angle='radian'/>", CABLE, tail));
    let long = length(&model, &model.tendons[0], &[0.0, 0.0]);
    assert!(near(long, 0.055 + 0.5 * 0.022), "{long}");
}

#[test]
fn a_straight_cable_beside_a_joint_is_a_polynomial_with_its_error() {
    let tail = "<tendon><spatial name='t' stiffness='100' springlength='0.03'><site site='s2'/><site site='s3'/></spatial></tendon>";
    let (draft, log) = draft(&document("<compiler angle='radian'/>", CABLE, tail));
    let TendonPath::Polynomial(c) = &draft.tendons[0].joints[0].1 else { panic!("{:?}", draft.tendons) };
    // s = L₀ − L for L between eyelets 10.77 and 12.65 mm from the joint.
    let exact = |q: f64| {
        let (p, r) = (Vec3::new(-0.01, 0.004, 0.0), Vec3::new(0.012, 0.004, 0.0));
        (Rotation::from_xyzw(0.0, 0.0, -(0.5 * q).sin(), (0.5 * q).cos()) * r - p).length()
    };
    for q in [0.2, 0.7, 1.2] {
        let s = c.iter().rev().fold(0.0, |sum, c| sum * q + c);
        assert!((s - (exact(0.0) - exact(q))).abs() < 3e-5, "{q}: {s}");
    }
    assert!(draft.tendons[0].motors.is_empty() && draft.tendons[0].stated.both_ways == Some(true));
    assert!(log.decisions.iter().any(|d| d.text.contains("is off by at most")), "{:?}", log.decisions);
}

#[test]
fn passive_tendons_become_springs_across_joints_and_slack_cables() {
    let head = "<compiler angle='radian'/>";
    let tail = "<tendon><fixed name='s' stiffness='2' damping='0.1' springlength='0.3'><joint joint='a' coef='1'/><joint joint='b' coef='-1'/></fixed>\
        <fixed name='l' range='0 1'><joint joint='a' coef='1'/><joint joint='b' coef='-1'/></fixed></tendon>";
    let (draft, _) = draft(&document(head, CABLE, tail));
    let spring = &draft.springs[0];
    assert_eq!(spring.numbers, SpringNumbers { stiffness: 2.0, damping: 0.1, rest: 0.3 });
    assert_eq!(spring.joints, [("a".to_owned(), 1.0), ("b".to_owned(), -1.0)]);
    // a − b is between −1.2 and 1.2: both ends of the range matter.
    let names: Vec<&str> = draft.tendons.iter().map(|tendon| tendon.name.as_str()).collect();
    assert_eq!(names, ["l_longest", "l_shortest"]);
    assert_eq!((draft.tendons[0].stated.rest, draft.tendons[1].stated.rest), (Some(-1.0), Some(0.0)));
}

#[test]
fn equalities_become_couplings_loops_and_fixed_joints() {
    let head = "<compiler angle='radian'/>";
    let world = "<body name='palm'><geom size='0.02'/>\
        <body name='a' pos='0 0 0.1'><joint name='a' axis='1 0 0' range='-1 1'/><geom size='0.01'/></body>\
        <body name='b' pos='0 0.1 0'><joint name='b' axis='1 0 0' range='-1 1' pos='0 0 0.01'/><geom size='0.01'/></body>\
        <body name='c' pos='0.1 0 0'><joint name='c' axis='1 0 0' range='-1 1'/><geom size='0.01'/></body></body>";
    let tail = "<equality><joint joint1='a' joint2='b' polycoef='0.1 -2 0.5 0 0'/><joint joint1='c' polycoef='0.25'/>\
        <connect name='pin' body1='a' body2='b' anchor='0 0.05 0'/></equality>";
    let (draft, _) = draft(&document(head, world, tail));
    assert_eq!(draft.couplings[0].coefficients, [0.1, -2.0, 0.5]);
    assert_eq!(
        draft.joints.iter().find(|joint| joint.name == "c").map(|joint| joint.kind),
        Some(JointKind::Fixed)
    );
    let pin = &draft.loops[0];
    // The point (0, 0.05, 0.1) of the palm in both links' frames; b's is at its joint.
    assert_eq!(pin.points[0], [0.0, 0.05, 0.0]);
    let off = Vec3::from_array(pin.points[1]) - Vec3::new(0.0, -0.05, 0.09);
    assert!(off.length() < 1e-12, "{pin:?}");
}

#[test]
fn objects_of_the_scene_are_no_part_of_the_hand() {
    let world = "<geom type='plane' size='1 1 1'/><body name='ball'><freejoint/><geom size='0.03'/></body>\
        <body name='palm' pos='0 0 1'><geom size='0.02'/><body name='a'><joint name='a' range='0 1'/><geom size='0.01'/></body></body>";
    let (draft, log) = draft(&document("", world, ""));
    let names: Vec<&str> = draft.links.iter().map(|link| link.name.as_str()).collect();
    assert_eq!(names, ["palm", "a"]);
    assert!(log.of(DecisionKind::Dropped).any(|d| d.element == "body 'ball'"), "{:?}", log.decisions);
}

#[test]
fn every_fault_of_a_document_is_said_in_one_run() {
    let world = "<body name='palm'><geom type='mesh' mesh='none'/><geom size='x'/>\
        <body name='a' quat='0 0 0 0'><joint name='a' axis='0 0 0'/><geom size='0.01' class='nowhere'/></body></body>";
    let tail = "<tendon><fixed name='t'><joint joint='gone' coef='1'/></fixed></tendon><actuator><position name='m' joint='gone'/></actuator>";
    let (_, log) = draft(&document("", world, tail));
    let problems: Vec<&str> = log.of(DecisionKind::Problem).map(|d| d.text.as_str()).collect();
    for wanted in [
        "mesh 'none'",
        "size is 'x'",
        "quat is",
        "axis has no direction",
        "class 'nowhere'",
        "joint 'gone'",
        "joint or tendon",
    ] {
        assert!(problems.iter().any(|text| text.contains(wanted)), "{wanted}: {problems:?}");
    }
}
