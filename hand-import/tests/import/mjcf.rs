//! MJCF as a hand that loads: joints that follow, servos, starts, copies. Numbers are those of MuJoCo 4.0 or closed.

use palmares_hand_import::export::{ExportTarget, export};
use palmares_models::measure::{HandLimits, Sources};

use super::*;

/// A palm with two fingers of one joint each, `a` and `b`, and further sections.
fn document(joints: [&str; 2], tail: &str) -> String {
    let finger = |name: &str, y: f64, joint: &str| {
        format!(
            "<body name='{name}_link' pos='0 {y} 0.05'><joint name='{name}' axis='1 0 0' damping='0.01' {joint}/>\
             <geom type='box' size='0.01 0.01 0.02' pos='0 0 0.03' mass='0.03'/></body>"
        )
    };
    format!(
        "<mujoco model='claw'><compiler angle='radian'/><worldbody><body name='palm'>\
         <geom type='box' size='0.03 0.05 0.02' mass='0.3'/>{}{}</body></worldbody>{tail}</mujoco>",
        finger("a", 0.03, joints[0]),
        finger("b", -0.03, joints[1])
    )
}

fn read(text: &str) -> (Imported, Hand) {
    let imported = Source::new(&[("hand.xml", text)]).import("hand.xml");
    no_problems(&imported);
    let hand = loaded(&imported);
    let limits = HandLimits::default().excesses(&hand.figures(), &Sources::of_urdf(Path::new("hand")));
    assert!(limits.is_empty(), "{limits:?}");
    (imported, hand)
}

/// Wound length of the only tendon at σ.
fn wound(hand: &Hand, sigma: f64) -> f64 {
    hand.tendons[0].wound(&hand.motors, |_| sigma)
}

/// b = 0.1 − 2 a.
const FOLLOWS: &str = "<equality><joint joint1='b' joint2='a' polycoef='0.1 -2 0 0 0'/></equality>";

#[test]
fn a_tendon_over_a_joint_that_follows_acts_on_its_leader() {
    // s = 0.5 a − 0.25 b = a − 0.025: one joint, so that it is a servo.
    let tail = format!(
        "{FOLLOWS}<tendon><fixed name='split'><joint joint='a' coef='0.5'/><joint joint='b' coef='-0.25'/></fixed></tendon>\
         <actuator><position name='m' tendon='split' kp='10' kv='0.3' ctrlrange='-0.1 0.4' forcerange='-2 2'/></actuator>"
    );
    let (imported, hand) = read(&document(["range='-0.2 0.5'", "range='-0.9 0.5'"], &tail));
    has(&imported, DecisionKind::Taken, "split", "follows 'a'");
    assert_eq!((hand.coordinates.len(), hand.tendons.len()), (1, 1));
    let tendon = &hand.tendons[0];
    assert_eq!(tendon.moment_arms, [(0, 1.0)]);
    assert_eq!((tendon.stiffness, tendon.damping, tendon.force_limit), (10.0, 0.3, 2.0));
    near(wound(&hand, 0.0), -0.1 + 0.025);
    near(wound(&hand, 1.0), 0.4 + 0.025);
    assert_eq!(hand.motors[0].name, "m");
}

#[test]
fn a_spatial_tendon_over_a_joint_that_follows_is_a_function_of_its_leader() {
    // Eyelets at the joint's height: L² = (y + d sin b)² + (z + d cos b)² with b = 0.5 a.
    let text = document(["range='0 1'", "range='0 0.5'"], "").replace(
        "<body name='b_link' pos='0 -0.03 0.05'>",
        "<site name='p' pos='0 -0.05 0.03'/><body name='b_link' pos='0 -0.03 0.05'><site name='q' pos='0 -0.015 0.03'/>",
    );
    let tail = "<equality><joint joint1='b' joint2='a' polycoef='0 0.5 0 0 0'/></equality>\
        <tendon><spatial name='t' stiffness='100' springlength='0.02'><site site='p'/><site site='q'/></spatial></tendon></mujoco>";
    let (_, hand) = read(&text.replace("</mujoco>", tail));
    let tendon = &hand.tendons[0];
    let length = |a: f64| {
        let (sin, cos) = (0.5 * a).sin_cos();
        // About x: y' = y cos − z sin, z' = y sin + z cos.
        let q = (-0.03 - 0.015 * cos - 0.03 * sin, 0.05 - 0.015 * sin + 0.03 * cos);
        (q.0 + 0.05).hypot(q.1 - 0.03)
    };
    for a in [0.1, 0.4, 0.9] {
        // The tension K (L − 0.02) is that of K (s_ref − s).
        let pull = wound(&hand, 0.0) - tendon.length(&[a]);
        assert!((pull - (length(a) - 0.02)).abs() < 1e-5, "{a}: {pull} and {}", length(a) - 0.02);
    }
}

#[test]
fn springs_of_a_joint_that_follows_are_those_of_its_leader() {
    let tail = format!(
        "{FOLLOWS}<tendon><fixed name='belt' stiffness='2' springlength='0.3'><joint joint='a' coef='1'/><joint joint='b' coef='0.25'/></fixed></tendon>"
    );
    let joints = ["range='-0.2 0.5' stiffness='0.4'", "range='-0.9 0.5' stiffness='0.2' springref='0.5'"];
    let (_, hand) = read(&document(joints, &tail));
    let a = &hand.coordinates[0];
    // 0.4 + 2² 0.2 at a; b rests where a = (0.5 − 0.1)/(−2) = −0.2.
    near(a.stiffness, 1.2);
    near(a.rest, 0.8 * -0.2 / 1.2);
    // a + 0.25 b = 0.5 a + 0.025
    let belt = &hand.tendons[0];
    assert!(belt.both_ways && belt.motors.is_empty());
    let pull = belt.stiffness * (belt.rest - belt.length(&[0.3]));
    near(pull, 2.0 * (0.3 - (0.5 * 0.3 + 0.025)) * belt.length(&[1.0]).signum());
}

#[test]
fn a_tendon_spring_without_a_length_rests_where_the_joints_springs_do() {
    let tail = "<tendon><fixed name='belt' stiffness='2'><joint joint='a' coef='1'/><joint joint='b' coef='-1'/></fixed></tendon>";
    let joints = ["range='-1 1' stiffness='0.1' springref='0.3'", "range='-1 1' ref='0.2' springref='0.1'"];
    let (_, hand) = read(&document(joints, tail));
    // MuJoCo's lengthspring is 0.3 − 0.1; a hand's b counts from 0.2.
    near(hand.springs[0].rest, 0.2 + 0.2);
}

#[test]
fn a_motor_of_a_joint_that_follows_drives_the_leader() {
    let tail = format!(
        "{FOLLOWS}<actuator><position name='m' joint='b' kp='3' ctrlrange='-0.9 0.5' forcerange='-1 1'/></actuator>"
    );
    let (imported, hand) = read(&document(["range='-0.2 0.5'", "range='-0.9 0.5'"], &tail));
    has(&imported, DecisionKind::Taken, "actuator 'm'", "follows 'a'");
    assert_eq!((hand.tendons[0].stiffness, hand.tendons[0].force_limit), (12.0, 2.0));
    // σ = 0 stays the lower end of the command: b = −0.9 is a = 0.5.
    near(wound(&hand, 0.0), 0.5);
    near(wound(&hand, 1.0), -0.2);
}

#[test]
fn a_servo_far_from_zero_keeps_the_limits_of_a_competition() {
    let tail = "<actuator><position name='m' joint='a' kp='3' kv='0.1' inheritrange='1' forcerange='-1 1'/></actuator>";
    let (_, hand) = read(&document(["range='1.2 1.5'", "range='-1 1' stiffness='0.1'"], tail));
    near(wound(&hand, 0.0), 1.2);
    near(wound(&hand, 1.0), 1.5);
    assert!(hand.motors[0].offset.abs() <= 1.0, "{:?}", hand.motors);
}

#[test]
fn commands_of_a_servo_are_its_range() {
    let tail = "<actuator><position name='m' joint='a' kp='3' ctrlrange='-0.3 0.9' forcerange='-1 1'/>\
        <general name='n' joint='b' gainprm='2' biastype='affine' biasprm='0.4 -4 -0.2' gear='-2' ctrlrange='-1 1' forcerange='-3 3'/></actuator>";
    let (imported, hand) = read(&document(["range='-0.2 0.8'", "range='-0.5 0.5'"], tail));
    near(wound(&hand, 0.0), -0.3);
    near(wound(&hand, 1.0), 0.9);
    // f = −2 (2 c + 0.4 + 8 b): K = 16, and b = −(2 c + 0.4)/8 at rest.
    let servo = &hand.tendons[1];
    assert_eq!((servo.stiffness, servo.damping, servo.force_limit), (16.0, 0.8, 6.0));
    near(servo.wound(&hand.motors, |_| 0.0), -0.3);
    near(servo.wound(&hand.motors, |_| 1.0), 0.2);
    has(&imported, DecisionKind::Taken, "general 'n'", "ctrl from 1 to -1");
}

#[test]
fn the_home_keyframe_is_the_start() {
    let tail = "<tendon><fixed name='t'><joint joint='a' coef='1'/><joint joint='b' coef='1'/></fixed></tendon>\
        <actuator><position name='m' tendon='t' kp='3' ctrlrange='0 2' forcerange='-1 1'/></actuator>\
        <keyframe><key name='open' qpos='0 0'/><key name='home' qpos='0.3 0' ctrl='0.5'/></keyframe>";
    let (imported, hand) = read(&document(["range='-1 1' stiffness='0.1'", "range='-1 1'"], tail));
    has(&imported, DecisionKind::Taken, "key 'home'", "is the start");
    has(&imported, DecisionKind::Dropped, "key 'open'", "one start");
    assert_eq!(hand.beginning(), [0.3, 0.0]);
    near(hand.start.sigma_of(0), 0.25);
    // A servo holds its joint.
    let tail = "<actuator><position name='m' joint='a' kp='3' ctrlrange='-1 1' forcerange='-1 1'/></actuator>\
        <keyframe><key qpos='0.5 0' ctrl='0.5'/></keyframe>";
    let (_, hand) = read(&document(["range='-1 1'", "range='-1 1' stiffness='0.1'"], tail));
    near(hand.start.sigma_of(0), 0.75);
    // A key beyond the limits begins at the limit.
    let beyond = tail.replace("qpos='0.5 0' ctrl='0.5'", "qpos='0.5 -1.2'");
    let (_, hand) = read(&document(["range='-1 1'", "range='-1 1' stiffness='0.1'"], &beyond));
    assert_eq!(hand.beginning(), [0.5, -1.0]);
}

#[test]
fn a_spring_of_a_time_constant_counts_the_inertia_that_is_free() {
    // Two slides in a row of 0.3 and 0.6 kg: 1/(M⁻¹)ᵢᵢ are 0.3 kg and 0.3 · 0.6/0.9 kg.
    let tail = "<actuator><position name='m' joint='b' kp='50' dampratio='1' gear='2' ctrlrange='0 0.01' forcerange='-9 9'/></actuator>";
    let body = |name: &str, mass: &str, inner: &str| {
        format!(
            "<body name='{name}_link'><joint name='{name}' type='slide' range='0 0.01' springdamper='0.1 0.5'/>\
             <geom type='box' size='0.02 0.02 0.02' mass='{mass}'/>{inner}</body>"
        )
    };
    let text = format!(
        "<mujoco><worldbody><body name='palm'><geom type='box' size='0.03 0.03 0.03'/>{}</body></worldbody>{tail}</mujoco>",
        body("a", "0.3", &body("b", "0.6", ""))
    );
    let (_, hand) = read(&text);
    for (coordinate, (stiffness, damping)) in hand.coordinates.iter().zip([(120.0, 6.0), (80.0, 4.0)]) {
        near(coordinate.stiffness, stiffness);
        near(coordinate.damping, damping);
    }
    // kv = 2 √(kp m) with m = 0.2 kg / 2², and b = 2² kv at the joint.
    near(hand.tendons[0].damping, 4.0 * 2.0 * (50.0f64 * 0.05).sqrt());
}

#[test]
fn copies_have_their_numbers_and_what_names_them_is_copied() {
    let text = "<mujoco><compiler angle='degree'/><worldbody><body name='palm'><geom type='box' size='0.03 0.03 0.02'/>\
        <replicate count='3' sep='_' euler='0 0 120' offset='0.01 0 0'><body name='finger' pos='0.05 0 0'>\
        <joint name='j' axis='0 1 0' range='0 60'/><geom type='box' size='0.01 0.01 0.02' mass='0.03'/></body></replicate>\
        </body></worldbody><actuator><position name='m' joint='j' kp='3' ctrlrange='0 1' forcerange='-1 1'/></actuator></mujoco>";
    let (_, hand) = read(text);
    let names: Vec<&str> = hand.motors.iter().map(|motor| motor.name.as_str()).collect();
    assert_eq!(names, ["m_0", "m_1", "m_2"]);
    let poses = hand.base_from_links(&[0.0; 3]);
    // The step is a shift of 1 cm, then a turn of 120°.
    let (sin, cos) = (std::f64::consts::TAU / 3.0).sin_cos();
    let expected = [
        (0.05, 0.0),
        (0.01 + 0.05 * cos, 0.05 * sin),
        (0.01 + 0.01 * cos + 0.05 * (cos * cos - sin * sin), 0.01 * sin + 0.1 * sin * cos),
    ];
    for (number, (x, y)) in expected.into_iter().enumerate() {
        let link = hand.link(&format!("finger_{number}")).expect("is there");
        near(poses[link].translation.x, x);
        near(poses[link].translation.y, y);
    }
}

#[test]
fn joints_that_put_the_hand_to_its_place_are_left_out() {
    let joints = "<joint name='x' type='slide' axis='1 0 0' range='-1 1'/><joint name='y' type='slide' axis='0 1 0' range='-1 1'/>\
        <joint name='turn' axis='0 0 1' range='-3 3'/>";
    let tail = "<actuator><position name='mx' joint='x' kp='100' ctrlrange='-1 1'/>\
        <position name='m' joint='a' kp='3' ctrlrange='-1 1' forcerange='-1 1'/></actuator>";
    let text = document(["range='-1 1'", "range='-1 1' stiffness='0.1'"], tail)
        .replace("<body name='palm'>", &format!("<body name='palm'>{joints}"));
    let (imported, hand) = read(&text);
    has(&imported, DecisionKind::Dropped, "body 'palm'", "by joints of its own");
    has(&imported, DecisionKind::Dropped, "position 'mx'", "outside the hand");
    assert_eq!(hand.coordinates.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["a", "b"]);
}

#[test]
fn too_many_shapes_of_a_link_become_the_hulls_of_near_ones() {
    // Twenty rows of three boxes, 2 mm in a row and 20 mm between rows.
    let boxes: String = (0..60)
        .map(|k| {
            let (x, y) = (0.004 * f64::from(k % 3), 0.01 * f64::from(k / 3));
            format!("<geom type='box' size='0.001 0.002 0.003' pos='{x} {y} 0.03' mass='0.001'/>")
        })
        .collect();
    let tail =
        "<actuator><position name='m' joint='a' kp='3' ctrlrange='-1 1' forcerange='-1 1'/></actuator>";
    let text = document(["range='-1 1'", "range='-1 1' stiffness='0.1'"], tail)
        .replace("<geom type='box' size='0.03 0.05 0.02' mass='0.3'/>", &boxes);
    let (imported, hand) = read(&text);
    has(&imported, DecisionKind::Guessed, "link 'palm'", "has 60 shapes, a hand at most 32");
    let palm = &hand.links[0];
    assert_eq!(palm.geoms.len(), 32);
    near(palm.inertia.mass, 0.06);
}

#[test]
fn a_servo_hand_goes_through_mjcf_and_back() {
    let tail = "<actuator><position name='m' joint='a' kp='3' kv='0.1' ctrlrange='-0.5 1' forcerange='-1 1'/>\
        <position name='n' joint='b' kp='4' kv='0.2' ctrlrange='-1 1' forcerange='-2 2'/></actuator>";
    let (imported, hand) = read(&document(["range='-1 1'", "range='-1 1'"], tail));
    let (folder, out) = (tempfile::tempdir().expect("a folder"), tempfile::tempdir().expect("a folder"));
    imported.write(folder.path(), true).expect("written");
    let exported = export(&folder.path().display().to_string(), ExportTarget::Mjcf).expect("exported");
    exported.write(out.path(), true).expect("written");
    let text = String::from_utf8(exported.files[Path::new("hand.xml")].clone()).expect("text");
    // MuJoCo clamps the force of an actuator before its implicit step: damping is the tendon's.
    assert!(text.contains("biasprm=\"-1.5 -3.0 0\"") && text.contains("damping=\"0.1\""), "{text}");
    let again = loaded(&import(out.path(), &ImportOptions::default()).expect("imported"));
    assert_eq!(again.motors.len(), 2);
    for (a, b) in hand.tendons.iter().zip(&again.tendons) {
        assert_eq!(
            (&a.name, a.stiffness, a.damping, a.force_limit),
            (&b.name, b.stiffness, b.damping, b.force_limit)
        );
        for sigma in [0.0, 0.3, 1.0] {
            near(a.wound(&hand.motors, |_| sigma), b.wound(&again.motors, |_| sigma));
        }
    }
}

#[test]
fn a_regulator_of_position_is_a_servo() {
    let tail = "<extension><plugin plugin='mujoco.pid'><instance name='pd'><config key='kp' value='2.8'/>\
        <config key='ki' value='4'/><config key='kd' value='0.03'/><config key='slewmax' value='2'/></instance></plugin></extension>\
        <actuator><plugin name='m' joint='a' plugin='mujoco.pid' instance='pd' ctrlrange='-1 1' forcerange='-1 1'/></actuator>";
    let (imported, hand) = read(&document(["range='-1 1'", "range='-1 1' stiffness='0.1'"], tail));
    has(&imported, DecisionKind::Dropped, "plugin 'm'", "no integral part");
    let servo = &hand.tendons[0];
    assert_eq!((servo.stiffness, servo.damping, servo.force_limit), (2.8, 0.03, 1.0));
    near(hand.motors[0].speed_limit, 1.0);
}

#[test]
fn masks_of_geoms_keep_links_from_each_other() {
    let tail = "<default><geom contype='0' conaffinity='1'/></default>\
        <actuator><position name='m' joint='a' kp='3' ctrlrange='-1 1' forcerange='-1 1'/></actuator>";
    let joints = ["range='-1 1'", "range='-1 1' stiffness='0.1'"];
    let (imported, hand) = read(&document(joints, tail));
    has(&imported, DecisionKind::Taken, "geom", "keep 1 pairs");
    let [a, b] = ["a_link", "b_link"].map(|name| hand.link(name).expect("is there"));
    assert_eq!(hand.no_collision, [[a, b]]);
    let pair = tail.replace("<actuator>", "<contact><pair geom1='ga' geom2='gb'/></contact><actuator>");
    let text =
        document(joints, &pair).replacen("size='0.01 0.01 0.02'", "name='ga' size='0.01 0.01 0.02'", 1);
    let text = text.replacen("<geom type='box' size='0.01", "<geom name='gb' type='box' size='0.01", 1);
    assert!(read(&text).1.no_collision.is_empty());
}
