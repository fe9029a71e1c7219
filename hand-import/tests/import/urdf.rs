//! URDF, ROS packages, transmissions, `gazebo`.

use super::*;

const SIMPLE: &str = "<transmission name='t1'><type>transmission_interface/SimpleTransmission</type>\
    <joint name='base'><hardwareInterface>hardware_interface/PositionJointInterface</hardwareInterface></joint>\
    <actuator name='m1'><mechanicalReduction>50</mechanicalReduction></actuator></transmission>";

#[test]
fn a_hand_without_motors_gets_one_for_each_independent_joint() {
    let source = Source::new(&[("claw.urdf", &finger(""))]);
    let imported = source.import("claw.urdf");
    no_problems(&imported);
    has(&imported, DecisionKind::Guessed, "robot", "names no motor");
    let hand = loaded(&imported);
    assert_eq!((hand.motors.len(), hand.tendons.len(), hand.coordinates.len()), (2, 2, 2));
    let (motor, tendon) = (&hand.motors[0], &hand.tendons[0]);
    // From the lower limit at σ = 0 to the upper one at σ = 1, at 2 rad/s.
    near(motor.scaling * (0.0 - motor.offset), -0.2);
    near(motor.scaling * (1.0 - motor.offset), 1.4);
    near(motor.speed_limit, 2.0 / 1.6);
    near(tendon.force_limit, 0.7);
    assert!(tendon.both_ways);
}

#[test]
fn transmissions_count_wherever_they_are_in_the_file() {
    let text = finger("").replacen("<link", &format!("{SIMPLE}<link"), 1);
    let source = Source::new(&[("claw.urdf", &text)]);
    let imported = source.import("claw.urdf");
    has(&imported, DecisionKind::Taken, "transmission 't1'", "mechanicalReduction 50");
    has(&imported, DecisionKind::Problem, "joint 'tip'", "moves freely");
    let hand = loaded(&imported);
    assert_eq!(hand.motors.iter().map(|m| m.name.as_str()).collect::<Vec<_>>(), ["m1"]);
}

#[test]
fn all_problems_are_found_in_one_run() {
    let text = finger(
        "<joint name='a' type='planar'><parent link='palm'/><child link='none'/></joint>\
         <transmission name='t'><type>x/FourBarLinkageTransmission</type></transmission>\
         <link name='lonely'/>",
    )
    .replace(
        "<geometry><box size='0.02 0.02 0.04'/></geometry>",
        "<geometry><mesh filename='gone.stl'/></geometry>",
    )
    .replace("upper='1.4'", "upper='high'");
    let source = Source::new(&[("claw.urdf", &text)]);
    let imported = source.import("claw.urdf");
    for (element, text) in [
        ("joint 'a'", "planar"),
        ("joint 'a'", "names link 'none'"),
        ("transmission 't'", "names no <joint>"),
        ("link 'lonely'", "no joint connects it"),
        ("link 'palm'", "gone.stl"),
        ("link 'distal'", "gone.stl"),
        ("joint 'base'", "upper of <limit> is 'high'"),
    ] {
        has(&imported, DecisionKind::Problem, element, text);
    }
}

#[test]
fn meshes_of_a_ros_package_are_found_from_its_urdf_folder() {
    let cube = cube_stl(0.02);
    for name in
        ["package://claw_description/meshes/part.stl", "../meshes/part.stl", "/home/me/ws/meshes/part.stl"]
    {
        let text = finger("").replace("<box size='0.02 0.02 0.04'/>", &format!("<mesh filename='{name}'/>"));
        let source = Source::new(&[
            ("package.xml", "<package><name>claw_description</name></package>"),
            ("urdf/claw.urdf", &text),
        ]);
        source.write("meshes/part.stl", &cube);
        for path in ["urdf/claw.urdf", ""] {
            let imported = source.import(path);
            no_problems(&imported);
            assert!(imported.files.contains_key(Path::new("meshes/part.stl")), "{name}");
            assert_eq!(loaded(&imported).links[0].geoms.len(), 1);
        }
    }
}

#[test]
fn several_robots_are_listed_and_one_is_chosen() {
    let text = finger("");
    let source =
        Source::new(&[("urdf/left.urdf", &text), ("urdf/right.urdf", &text), ("mesh.xml", "<mesh/>")]);
    let refusal = source.refusal("");
    assert!(refusal.contains("--robot") && refusal.contains("left.urdf (URDF)"), "{refusal}");
    let options = ImportOptions { robot: Some("right".to_owned()), ..ImportOptions::default() };
    assert!(source.import_with("", &options).description.ends_with("urdf/right.urdf"));
    let none = ImportOptions { robot: Some("middle".to_owned()), ..ImportOptions::default() };
    let error = import(&source.path(""), &none).expect_err("refused").to_string();
    assert!(error.contains("no robot 'middle'") && error.contains("urdf/left.urdf"), "{error}");
}

#[test]
fn an_archive_is_a_source_too() {
    let source = Source::new(&[]);
    let mut zip = zip::ZipWriter::new(std::io::Cursor::new(Vec::new()));
    let options = zip::write::SimpleFileOptions::default();
    zip.start_file("claw/urdf/claw.urdf", options).expect("started");
    let text = finger("").replace("<box size='0.02 0.02 0.04'/>", "<mesh filename='../meshes/part.stl'/>");
    std::io::Write::write_all(&mut zip, text.as_bytes()).expect("written");
    zip.start_file("claw/meshes/part.stl", options).expect("started");
    std::io::Write::write_all(&mut zip, &cube_stl(0.02)).expect("written");
    source.write("claw.zip", &zip.finish().expect("finished").into_inner());
    no_problems(&source.import("claw.zip"));
}

#[test]
fn a_mimic_by_factor_zero_is_a_fixed_joint() {
    let joint =
        "<mimic joint='base' multiplier='0.0' offset='0.1'/><dynamics damping='0.01'/></joint></robot>";
    let text = finger("").replace("<dynamics damping='0.01'/></joint></robot>", joint);
    let source = Source::new(&[("claw.urdf", &text)]);
    let imported = source.import("claw.urdf");
    no_problems(&imported);
    has(&imported, DecisionKind::Taken, "joint 'tip'", "taken is a fixed joint at 0.1");
    assert_eq!(loaded(&imported).coordinates.len(), 1);
}

#[test]
fn a_joint_without_shapes_gives_its_motor_to_its_first_follower() {
    let mimic =
        |multiplier: &str| format!("<mimic joint='synergy' multiplier='{multiplier}' offset='0.1'/></joint>");
    let mut text = finger(
        "<link name='virtual'/><joint name='synergy' type='revolute'><parent link='palm'/><child link='virtual'/>\
         <axis xyz='0 0 1'/><limit lower='0' upper='1' effort='2' velocity='4'/></joint>",
    );
    text = text.replacen("<dynamics damping='0.01'/></joint>", &mimic("0.5"), 1);
    text = text.replacen("<dynamics damping='0.01'/></joint>", &mimic("0.25"), 1);
    let source = Source::new(&[("claw.urdf", &text)]);
    let imported = source.import("claw.urdf");
    no_problems(&imported);
    has(&imported, DecisionKind::Taken, "joint 'synergy'", "'base' leads the 1 others");
    let hand = loaded(&imported);
    assert_eq!((hand.coordinates.len(), hand.motors.len()), (1, 1));
    near(hand.coordinates[0].lower, 0.1);
    near(hand.coordinates[0].upper, 0.6);
    let tip = &hand.links[2].joint.as_ref().expect("a joint").hinges[0];
    near(tip.ratio, 0.5);
    // At synergy 0.4: base 0.3, tip 0.2.
    near(tip.ratio * 0.3 + tip.offset, 0.2);
}

#[test]
fn stand_ins_for_efforts_and_speeds_are_replaced() {
    let text = finger("").replace("effort='0.7' velocity='2'", "effort='1000' velocity='100'");
    let source = Source::new(&[("claw.urdf", &text)]);
    let imported = source.import("claw.urdf");
    has(&imported, DecisionKind::Guessed, "actuator 'base'", "largest force 1000");
    has(&imported, DecisionKind::Guessed, "actuator 'base'", "largest speed 100");
    let hand = loaded(&imported);
    near(hand.tendons[0].force_limit, 1.0);
    assert!(hand.motors[0].speed_limit <= 6.0);
}

#[test]
fn figures_that_no_hand_may_have_are_replaced() {
    let text = finger("").replacen("damping='0.01'", "damping='100'", 1).replace(
        "<link name='distal'><inertial><mass value='0.05'/>",
        "<link name='distal'><inertial><mass value='1e-8'/>",
    );
    // The second joint never comes to 0: its motor's offset would be beyond its travel.
    let second = text.rfind("lower='-0.2' upper='1.4'").expect("limits");
    let text = format!("{}lower='-1.4' upper='-0.2'{}", &text[..second], &text[second + 24..]);
    let imported = Source::new(&[("claw.urdf", &text)]).import("claw.urdf");
    no_problems(&imported);
    has(&imported, DecisionKind::Guessed, "joint 'base'", "the damping 100");
    has(&imported, DecisionKind::Guessed, "link 'distal'", "weighs 1.000e-8 kg");
    let hand = loaded(&imported);
    assert!(hand.coordinates[0].damping < 5.0);
    near(hand.links[2].inertia.mass, 0.016);
    let drive = hand.tendons.iter().find(|tendon| tendon.name == "tip").expect("a drive");
    for (sigma, angle) in [(0.0, -1.4), (0.5, -0.8), (1.0, -0.2)] {
        near(drive.wound(&hand.motors, |_| sigma), angle);
    }
    assert!(hand.motors.iter().all(|motor| motor.offset.abs() <= 1.0));
}

#[test]
fn limits_of_a_mimic_that_contradict_its_leader_are_named_and_replaced() {
    let joint = "<mimic joint='base' multiplier='-1'/><dynamics damping='0.01'/></joint></robot>";
    let text = finger("").replace("<dynamics damping='0.01'/></joint></robot>", joint);
    let text = text.replacen("lower='-0.2' upper='1.4'", "lower='0' upper='0.8'", 1);
    let text = text.replace("lower='-0.2' upper='1.4'", "lower='0' upper='0.8'");
    let source = Source::new(&[("claw.urdf", &text)]);
    let imported = source.import("claw.urdf");
    has(&imported, DecisionKind::Problem, "joint 'tip'", "follows 'base' to -0.8");
    let hand = loaded(&imported);
    near(hand.coordinates[0].lower, 0.0);
    near(hand.coordinates[0].upper, 0.8);
}

#[test]
fn springs_and_friction_of_gazebo_are_taken() {
    let text = finger(
        "<gazebo reference='tip'><springStiffness>0.3</springStiffness><springReference>-0.1</springReference></gazebo>\
         <gazebo reference='distal'><mu1>0.9</mu1><kp>1e6</kp><selfCollide>true</selfCollide></gazebo>\
         <gazebo><plugin name='p' filename='libgazebo_ros_control.so'/></gazebo>",
    );
    let source = Source::new(&[("claw.urdf", &(text.replace("</robot>", SIMPLE) + "</robot>"))]);
    let imported = source.import("claw.urdf");
    has(&imported, DecisionKind::Dropped, "<gazebo>", "selfCollide");
    has(&imported, DecisionKind::Dropped, "plugin name='p'", "Gazebo only");
    let hand = loaded(&imported);
    let tip = hand.coordinates.iter().find(|c| c.name == "tip").expect("tip");
    near(tip.stiffness, 0.3);
    near(tip.rest, -0.1);
    near(hand.links[2].geoms[0].friction, 0.9);
}

#[test]
fn two_elasticities_of_one_joint_are_a_problem() {
    let transmission = |name: &str, elasticity: &str| {
        format!(
            "<transmission name='{name}'><type>transmission_interface/AdaptiveSynergyTransmission</type>\
             <actuator name='{name}_motor'/><joint name='tip'><mechanicalReduction>0.5</mechanicalReduction>\
             <mechanicalElasticity>{elasticity}</mechanicalElasticity></joint></transmission>"
        )
    };
    let text = finger(&(transmission("one", "0.2") + &transmission("two", "0.9")));
    let source = Source::new(&[("claw.urdf", &text)]);
    let imported = source.import("claw.urdf");
    has(&imported, DecisionKind::Problem, "transmission 'two', joint 'tip'", "0.9 here and 0.2 in another");
    near(loaded(&imported).coordinates[1].stiffness, 0.2);
}

#[test]
fn links_without_mass_get_one_from_their_shapes() {
    let source =
        Source::new(&[("claw.urdf", &finger("").replace("<mass value='0.05'/>", "<mass value='0'/>"))]);
    let imported = source.import("claw.urdf");
    has(&imported, DecisionKind::Guessed, "link 'distal'", "0.0160 kg");
    near(loaded(&imported).links[2].inertia.mass, 0.016);
}

#[test]
fn pictures_become_collision_shapes_on_request() {
    let text = finger("").replace("collision>", "visual>");
    let source = Source::new(&[("claw.urdf", &text)]);
    has(&source.import("claw.urdf"), DecisionKind::Problem, "robot", "--visual-as-collision");
    let options = ImportOptions { visual_as_collision: true, ..ImportOptions::default() };
    let imported = source.import_with("claw.urdf", &options);
    no_problems(&imported);
    assert_eq!(loaded(&imported).links[1].geoms.len(), 1);
}

#[test]
fn a_drafted_hand_has_a_commented_table_for_every_coordinate() {
    let source = Source::new(&[("claw.urdf", &finger("")), ("hand.toml", "name = \"other\"\n")]);
    let options = ImportOptions { template: true, name: Some("mine".to_owned()), ..ImportOptions::default() };
    let imported = source.import_with("claw.urdf", &options);
    let text = String::from_utf8(imported.files[Path::new("hand.toml")].clone()).expect("text");
    assert!(
        text.contains("name = \"mine\"") && text.contains("# [coordinates.base]  # -0.2 to 1.4 rad"),
        "{text}"
    );
    // It loads as it is, and with the tables filled in.
    loaded(&imported);
    let filled = text.replace("# [coordinates", "[coordinates").replace("# stiffness", "stiffness");
    let filled: toml::Table = filled.parse().expect("TOML");
    assert!(
        filled["coordinates"]["tip"]["stiffness"].is_integer()
            || filled["coordinates"]["tip"]["stiffness"].is_float()
    );
}

#[test]
fn an_existing_folder_is_only_replaced_by_force() {
    let source = Source::new(&[("claw.urdf", &finger(""))]);
    let imported = source.import("claw.urdf");
    let out = tempfile::tempdir().expect("a folder");
    let error = imported.write(out.path(), false).expect_err("refused").to_string();
    assert!(error.contains("--force"), "{error}");
    imported.write(out.path(), true).expect("written");
    assert!(out.path().join("hand.toml").is_file());
}

#[test]
fn limits_of_a_continuous_joint_are_none() {
    let text = finger("").replacen("type='revolute'", "type='continuous'", 1);
    let text = text.replacen("lower='-0.2' upper='1.4'", "lower='0' upper='0'", 1);
    let source = Source::new(&[("claw.urdf", &text)]);
    let imported = source.import("claw.urdf");
    no_problems(&imported);
    let hand = loaded(&imported);
    assert!(hand.coordinates[0].lower.is_infinite() && hand.motors[0].scaling > 6.0);
}

#[test]
fn transmissions_of_other_types_give_each_joint_a_motor() {
    let two = |kind: &str, joints: &str| {
        format!(
            "<transmission name='t'><type>maker/{kind}</type>{joints}<actuator name='m1'/><actuator name='m2'/></transmission>"
        )
    };
    for (kind, element, text) in [
        ("DifferentialTransmission", "transmission 't'", "a motor of its own"),
        ("makersOwn", "transmissions of type 'makersOwn'", "are not known"),
    ] {
        let source =
            Source::new(&[("claw.urdf", &finger(&two(kind, "<joint name='base'/><joint name='tip'/>")))]);
        let imported = source.import("claw.urdf");
        no_problems(&imported);
        has(&imported, DecisionKind::Guessed, element, text);
        let hand = loaded(&imported);
        assert_eq!(hand.motors.iter().map(|motor| motor.name.as_str()).collect::<Vec<_>>(), ["m1", "m2"]);
    }
    let source = Source::new(&[("claw.urdf", &finger(&two("SimpleTransmission", "<joint name='tip'/>")))]);
    has(&source.import("claw.urdf"), DecisionKind::Dropped, "transmission 't'", "'m2'");
    let source = Source::new(&[("claw.urdf", &finger(&two("makersOwn", "")))]);
    has(&source.import("claw.urdf"), DecisionKind::Problem, "transmission 't'", "names no <joint>");
    // Also where a joint without a shape leads: its motor is that of its first follower.
    let virtual_joint = "<link name='virtual'/><joint name='synergy' type='revolute'><parent link='palm'/><child link='virtual'/>\
         <axis xyz='0 0 1'/><limit lower='0' upper='1' effort='2' velocity='4'/></joint>";
    let all = ["synergy", "base", "tip"].map(|joint| {
        format!("<transmission name='{joint}_t'><type>maker/own</type><joint name='{joint}'/><actuator name='{joint}'/></transmission>")
    });
    let text = finger(&(virtual_joint.to_owned() + &all.concat()))
        .replace("<dynamics damping='0.01'/></joint>", "<mimic joint='synergy'/></joint>");
    let source = Source::new(&[("claw.urdf", &text)]);
    let imported = source.import("claw.urdf");
    no_problems(&imported);
    let hand = loaded(&imported);
    assert_eq!(hand.motors.iter().map(|motor| motor.name.as_str()).collect::<Vec<_>>(), ["synergy"]);
}

#[test]
fn elements_and_types_that_are_not_read_are_named() {
    let text = finger("")
        .replacen(
            "<link name='distal'>",
            "<link name='distal'><contact><lateral_friction value='0.8'/></contact><sensing/>",
            1,
        )
        .replacen("type='revolute'", "type='planar'", 1)
        .replacen("<joint name='tip'", "<joint", 1);
    let text = text.replace(
        "<robot name='claw'>",
        "<robot name='claw'><link name='world'/>\
        <joint name='free' type='floating'><parent link='world'/><child link='palm'/></joint>",
    );
    let source = Source::new(&[("claw.urdf", &text)]);
    let imported = source.import("claw.urdf");
    has(&imported, DecisionKind::Taken, "link 'distal'", "lateral_friction 0.8");
    has(&imported, DecisionKind::Dropped, "<sensing> of a link", "no place");
    has(&imported, DecisionKind::Problem, "joint 'base'", "valid: fixed, revolute, continuous, prismatic");
    has(&imported, DecisionKind::Problem, "joint of line 1", "has no name");
    has(&imported, DecisionKind::Taken, "joint 'free'", "moves with the controller's arm");
    let hand = loaded(&imported);
    near(hand.links.iter().find(|link| link.name == "distal").expect("is there").geoms[0].friction, 0.8);
}

#[test]
fn the_hand_of_an_arm_is_taken_by_its_root() {
    let arm = "<link name='arm'/><joint name='elbow' type='revolute'><parent link='arm'/><child link='palm'/><axis xyz='0 0 1'/>\
        <limit lower='-1' upper='1' effort='50' velocity='1'/></joint>\
        <transmission name='e'><type>transmission_interface/SimpleTransmission</type><joint name='elbow'/><actuator name='e'/></transmission>\
        <transmission name='t'><type>transmission_interface/SimpleTransmission</type><joint name='tip'/><actuator name='m'/></transmission>";
    let arm = &format!("{arm}{SIMPLE}");
    let source = Source::new(&[("claw.urdf", &finger(arm)), ("hand.toml", "servo_joints = \"all\"\n")]);
    let options = ImportOptions { root: Some("palm".to_owned()), ..ImportOptions::default() };
    let imported = source.import_with("claw.urdf", &options);
    no_problems(&imported);
    has(&imported, DecisionKind::Taken, "robot", "3 of 4 links");
    has(&imported, DecisionKind::Dropped, "hand.toml", "whole robot");
    let hand = loaded(&imported);
    assert_eq!((hand.links[0].name.as_str(), hand.links.len(), hand.motors.len()), ("palm", 3, 2));
    let none = ImportOptions { root: Some("hand".to_owned()), ..ImportOptions::default() };
    let error = import(&source.path("claw.urdf"), &none).expect_err("refused").to_string();
    assert!(error.contains("no link 'hand'") && error.contains("palm, proximal, distal, arm"), "{error}");
}

#[test]
fn text_of_windows_comments_and_escaped_paths_are_read() {
    let plain = finger("").replace(
        "<robot",
        "<?xml version='1.0' encoding='utf-16'?>\r\n<!-- made of <xacro:include> and <palm> -->\r\n<robot",
    );
    let plain = plain.replace("<box size='0.02 0.02 0.04'/>", "<mesh filename='file:meshes/my%20part.stl'/>");
    let plain = plain.replace("file:meshes", "meshes");
    let source = Source::new(&[]);
    let words: Vec<u8> =
        std::iter::once(0xfeff).chain(plain.encode_utf16()).flat_map(u16::to_le_bytes).collect();
    source.write("claw.urdf", &words);
    source.write("meshes/my part.stl", &cube_stl(0.02));
    let imported = source.import("claw.urdf");
    no_problems(&imported);
    assert_eq!(imported.format, palmares_hand_import::Format::Urdf);
    assert_eq!(loaded(&imported).links.len(), 3);
    let entities = "<!DOCTYPE robot [ <!ENTITY a '<link/>'> ]>";
    source.write("claw.urdf", finger("").replace("<robot", &format!("{entities}<robot")).as_bytes());
    let refusal = source.refusal("claw.urdf");
    assert!(refusal.contains("DTD") || refusal.contains("document type"), "{refusal}");
}

/// A binary STL of a cube.
pub(super) fn cube_stl(edge: f64) -> Vec<u8> {
    let corners =
        |k: usize| palmares_models::Vec3::new((k & 1) as f64, (k >> 1 & 1) as f64, (k >> 2) as f64) * edge;
    let points: Vec<_> = (0..8).map(corners).collect();
    palmares_models::pieces::TriangleMesh::hull(&points).expect("a hull").to_stl("cube")
}

#[test]
fn a_leader_whose_picture_touches_keeps_leading() {
    let picture = |text: &str| text.replace("<collision", "<visual").replace("</collision", "</visual");
    let inertial = "<inertial><mass value='0.05'/><inertia ixx='1e-5' ixy='0' ixz='0' iyy='1e-5' iyz='0' izz='1e-5'/></inertial>";
    let link = |name: &str| {
        format!(
            "<link name='{name}'>{inertial}<collision><origin xyz='0 0 0.03'/><geometry><box size='0.02 0.01 0.06'/></geometry>\
             </collision></link>"
        )
    };
    let joint = |name: &str, child: &str, y: f64, more: &str| {
        format!(
            "<joint name='{name}' type='revolute'><parent link='palm'/><child link='{child}'/><origin xyz='0 {y} 0.045'/>\
             <axis xyz='1 0 0'/><limit lower='-0.5' upper='1' effort='1' velocity='2'/>{more}</joint>"
        )
    };
    let (left, right) = (joint("lj", "l", 0.04, ""), joint("rj", "r", -0.04, "<mimic joint='lj'/>"));
    let text = format!("<robot name='claw'>{}{}{}{left}{right}</robot>", link("palm"), link("l"), link("r"));
    let source = Source::new(&[("claw.urdf", &picture(&text))]);
    let options = ImportOptions { visual_as_collision: true, ..ImportOptions::default() };
    let hand = loaded(&source.import_with("claw.urdf", &options));
    assert_eq!(hand.coordinates.iter().map(|c| c.name.as_str()).collect::<Vec<_>>(), ["lj"]);
    assert_eq!(hand.links.iter().filter(|link| link.joint.is_some()).count(), 2);
}
