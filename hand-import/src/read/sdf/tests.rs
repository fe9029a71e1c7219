use std::path::{Path, PathBuf};

use crate::decision::DecisionKind;
use palmares_models::Vec3;

use crate::decision::Log;
use crate::draft::{Draft, JointKind};
use crate::options::ImportOptions;
use crate::read::reading::Reading;
use crate::source::Source;

fn read(files: &[(&str, &str)]) -> (Draft, Log) {
    let entries = files.iter().map(|(name, text)| (PathBuf::from(name), text.as_bytes().to_vec())).collect();
    let source = Source::memory(Path::new("test"), entries).expect("small");
    let path = PathBuf::from("model.sdf");
    let options = ImportOptions::default();
    let mut reading = Reading::open(&source, &path, "SDF", &options).expect("a text");
    let draft = super::read(&mut reading).expect("a hand");
    (draft, reading.log)
}

const GRIPPER: &str = r#"<sdf version="1.11"><world name="w"><model name="ball"><link name="b"/></model><model name="gripper">
    <pose>0 0 1 0 0 0</pose>
    <frame name="mount"><pose>0 0 0.1 0 0 1.5707963267948966</pose></frame>
    <link name="palm"><inertial><pose>0 0 0.02 0 0 0</pose><mass>0.3</mass><inertia><ixx>1e-4</ixx><iyy>2e-4</iyy><izz>3e-4</izz></inertia></inertial>
      <collision name="c"><geometry><box><size>0.1 0.05 0.04</size></box></geometry><surface><friction><ode><mu>0.7</mu></ode></friction></surface></collision></link>
    <link name="left"><pose relative_to="mount">0.02 0 0 0 0 0</pose><inertial><mass>0.02</mass></inertial>
      <collision name="c"><pose>0 0 0.03 0 0 0</pose><geometry><capsule><radius>0.008</radius><length>0.04</length></capsule></geometry></collision></link>
    <link name="right"><pose>0 -0.02 0.1 0 0 0</pose><inertial><mass>0.02</mass></inertial></link>
    <joint name="base" type="fixed"><parent>world</parent><child>palm</child></joint>
    <joint name="left" type="revolute"><pose>0 0 -0.01 0 0 0</pose><parent>palm</parent><child>left</child>
      <axis><xyz expressed_in="__model__">1 0 0</xyz><limit><lower>0</lower><upper>1.2</upper><effort>2</effort><velocity>-1</velocity></limit>
      <dynamics><damping>0.01</damping><spring_stiffness>0.2</spring_stiffness><spring_reference>-0.1</spring_reference></dynamics></axis></joint>
    <joint name="right" type="revolute"><parent>palm</parent><child>right</child>
      <axis><xyz>-1 0 0</xyz><limit><lower>-1.2</lower><upper>1e16</upper></limit>
      <mimic joint="left"><multiplier>2</multiplier><offset>0.3</offset><reference>0.1</reference></mimic></axis></joint>
    <gripper name="g"><palm_link>palm</palm_link></gripper>
    <plugin name="p" filename="libgazebo_grasp_fix.so"/>
    <plugin name="q" filename="gz-sim-joint-position-controller-system"><joint_name>left</joint_name><p_gain>30</p_gain><cmd_max>2</cmd_max></plugin>
    </model></world></sdf>"#;

#[test]
fn poses_axes_springs_and_mimics_of_a_gripper() {
    let (draft, log) = read(&[("model.sdf", GRIPPER)]);
    assert_eq!(draft.name, "gripper");
    let joint = |name: &str| draft.joints.iter().find(|joint| joint.name == name).expect("is there");
    let left = joint("left");
    // The joint is 1 cm below the link, which is 2 cm along the mount's x, the model's y.
    assert!((left.origin.pose().translation - Vec3::new(0.0, 0.02, 0.09)).length() < 1e-12, "{left:?}");
    let axis = left.origin.pose().rotation * Vec3::from_array(left.axis);
    assert!((axis - Vec3::X).length() < 1e-12, "{axis:?}");
    assert_eq!((left.limits, left.effort, left.velocity), (Some([0.0, 1.2]), Some(2.0), None));
    assert_eq!(
        (left.stated.damping, left.stated.stiffness, left.stated.rest),
        (Some(0.01), Some(0.2), Some(-0.1))
    );
    let link = draft.links.iter().find(|link| link.name == "left").expect("is there");
    assert!((link.collisions[0].origin.pose().translation - Vec3::Z * 0.04).length() < 1e-12);
    assert_eq!(joint("right").kind, JointKind::Continuous);
    let [offset, multiplier] = draft.couplings[0].coefficients[..] else { panic!("{:?}", draft.couplings) };
    assert!(multiplier == 2.0 && (offset - 0.1).abs() < 1e-12, "{offset}");
    assert_eq!(draft.links[0].friction, Some(0.7));
    assert_eq!((draft.actuators[0].gain, draft.actuators[0].force_limit), (Some(30.0), Some(2.0)));
    let dropped: Vec<&str> = log.of(DecisionKind::Dropped).map(|d| d.element.as_str()).collect();
    assert_eq!(dropped, ["model 'ball'", "gripper 'g'", "joint 'base'", "joint 'right'", "plugin 'p'"]);
    assert!(log.of(DecisionKind::Problem).next().is_none(), "{:?}", log.decisions);
}

#[test]
fn an_included_model_brings_its_links_under_its_name() {
    let finger = r#"<sdf version="1.9"><model name="finger"><link name="a"/><link name="b"><pose>0 0 0.05 0 0 0</pose></link>
        <joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz>0 1 0</xyz></axis></joint></model></sdf>"#;
    let hand = r#"<sdf version="1.9"><model name="hand"><link name="palm"/>
        <include><uri>model://finger</uri><name>thumb</name><pose>0.1 0 0 0 0 1.5707963267948966</pose></include>
        <joint name="fix" type="fixed"><parent>palm</parent><child>thumb::a</child></joint></model></sdf>"#;
    let config = "<model><sdf version='1.9'>finger.sdf</sdf></model>";
    let (draft, log) =
        read(&[("model.sdf", hand), ("finger/model.config", config), ("finger/finger.sdf", finger)]);
    assert!(log.of(DecisionKind::Problem).next().is_none(), "{:?}", log.decisions);
    let joint = draft.joints.iter().find(|joint| joint.name == "thumb_j").expect("is there");
    assert_eq!((joint.parent.as_str(), joint.child.as_str()), ("thumb_a", "thumb_b"));
    let fix = draft.joints.iter().find(|joint| joint.name == "fix").expect("is there");
    assert!((fix.origin.pose().translation - Vec3::X * 0.1).length() < 1e-12, "{fix:?}");
}

#[test]
fn a_second_joint_to_a_link_is_a_pin() {
    let text = r#"<sdf version="1.9"><model name="bar"><link name="base"/><link name="a"><pose>0 0 0.1 0 0 0</pose></link>
        <link name="b"><pose>0 0.1 0 0 0 0</pose></link>
        <joint name="a" type="revolute"><parent>base</parent><child>a</child><axis><xyz>1 0 0</xyz></axis></joint>
        <joint name="b" type="revolute"><parent>base</parent><child>b</child><axis><xyz>1 0 0</xyz></axis></joint>
        <joint name="pin" type="revolute"><pose>0 0.02 0.05 0 0 0</pose><parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz></axis></joint>
        </model></sdf>"#;
    let (draft, _) = read(&[("model.sdf", text)]);
    assert_eq!(draft.joints.len(), 2);
    let pin = &draft.loops[0];
    assert_eq!(pin.links, ["a", "b"]);
    for (point, wanted) in pin.points.iter().zip([[0.0, 0.12, -0.05], [0.0, 0.02, 0.05]]) {
        assert!((Vec3::from_array(*point) - Vec3::from_array(wanted)).length() < 1e-12, "{pin:?}");
    }
}

/// Pose of a joint in the base, with all coordinates at 0.
fn pose_of(draft: &Draft, name: &str) -> palmares_models::Pose {
    let joint = draft.joints.iter().find(|joint| joint.name == name).expect("is there");
    let above = draft.joints.iter().find(|other| other.child == joint.parent);
    above.map_or(palmares_models::Pose::IDENTITY, |above| pose_of(draft, &above.name)) * joint.origin.pose()
}

#[track_caller]
fn at(draft: &Draft, joint: &str, wanted: [f64; 3]) {
    let found = pose_of(draft, joint).translation;
    assert!((found - Vec3::from_array(wanted)).length() < 1e-9, "{joint}: {found:?}");
}

const FINGER: &str = r#"<sdf version="1.9"><model name="finger"><link name="a"/><frame name="mount"><pose>0 0 0.01 0 0 0</pose></frame>
    <link name="b"><pose>0 0 0.05 0 0 0</pose></link>
    <joint name="j" type="revolute"><parent>a</parent><child>b</child><axis><xyz expressed_in="__model__">0 1 0</xyz></axis></joint>
    </model></sdf>"#;

fn hand_with(include: &str, version: &str) -> (Draft, Log) {
    let hand = format!(
        r#"<sdf version="{version}"><model name="hand"><link name="palm"/><frame name="side"><pose>0 0.1 0 0 0 1.5707963267948966</pose></frame>
        {include}</model></sdf>"#
    );
    read(&[("model.sdf", &hand), ("finger/model.sdf", FINGER)])
}

#[test]
fn nested_models_are_placed_relative_to_frames_and_by_frames() {
    let fix = "<joint name='fix' type='fixed'><parent>palm</parent><child>thumb::a</child></joint>";
    let include =
        |more: &str| format!("<include><uri>model://finger</uri><name>thumb</name>{more}</include>{fix}");
    let (draft, _) = hand_with(&include("<pose relative_to='side'>0.02 0 0 0 0 0</pose>"), "1.9");
    at(&draft, "fix", [0.0, 0.12, 0.0]);
    at(&draft, "thumb_j", [0.0, 0.12, 0.05]);
    let placed = "<placement_frame>mount</placement_frame><pose>0 0 0.2 0 0 0</pose>";
    let (draft, log) = hand_with(&include(placed), "1.9");
    assert!(log.of(DecisionKind::Problem).next().is_none(), "{:?}", log.decisions);
    at(&draft, "fix", [0.0, 0.0, 0.19]);
    // The same, written as a model of this file.
    let nested = FINGER.replace(
        "<sdf version=\"1.9\"><model name=\"finger\">",
        "<model name=\"thumb\" placement_frame=\"mount\"><pose relative_to=\"side\">0 0 0.2 0 0 0</pose>",
    );
    let (draft, _) = hand_with(&(nested.replace("</sdf>", "") + fix), "1.9");
    at(&draft, "fix", [0.0, 0.1, 0.19]);
}

#[test]
fn a_merged_model_has_its_own_place_but_no_prefix() {
    let include = "<include merge='1'><uri>model://finger</uri><pose>0.1 0 0 0 0 1.5707963267948966</pose></include>\
                   <joint name='fix' type='fixed'><parent>palm</parent><child>a</child></joint>";
    let (draft, log) = hand_with(include, "1.9");
    assert!(log.of(DecisionKind::Problem).next().is_none(), "{:?}", log.decisions);
    at(&draft, "fix", [0.1, 0.0, 0.0]);
    at(&draft, "j", [0.1, 0.0, 0.05]);
    // Its axis is in its own model's frame.
    let joint = draft.joints.iter().find(|joint| joint.name == "j").expect("is there");
    let axis = pose_of(&draft, "j").rotation * Vec3::from_array(joint.axis);
    assert!((axis + Vec3::X).length() < 1e-9, "{axis:?}");
}

#[test]
fn ends_of_joints_are_the_links_that_frames_are_attached_to() {
    let text = r#"<sdf version="1.8"><model name="m" canonical_link="second"><link name="first"/><link name="second"><pose>0 0 0.1 0 0 0</pose></link>
        <link name="third"><pose>0 0 0.3 0 0 0</pose></link>
        <frame name="on_second" attached_to="second"><pose relative_to="first">0 0 0.2 0 0 0</pose></frame><frame name="free"/>
        <joint name="a" type="fixed"><parent>first</parent><child>on_second</child></joint>
        <joint name="b" type="fixed"><parent>free</parent><child>third</child></joint></model></sdf>"#;
    let (draft, log) = read(&[("model.sdf", text)]);
    assert!(log.of(DecisionKind::Problem).next().is_none(), "{:?}", log.decisions);
    let ends = |name: &str| {
        let joint = draft.joints.iter().find(|joint| joint.name == name).expect("is there");
        (joint.parent.clone(), joint.child.clone())
    };
    assert_eq!(ends("a"), ("first".to_owned(), "second".to_owned()));
    assert_eq!(ends("b"), ("second".to_owned(), "third".to_owned()));
    at(&draft, "a", [0.0, 0.0, 0.2]);
}

#[test]
fn poses_can_be_relative_to_each_other_along_a_long_chain() {
    let mut text = r#"<sdf version="1.9"><model name="m"><link name="l0"/>"#.to_owned();
    for k in 1..40 {
        text += &format!(
            "<joint name='j{k}' type='revolute'><pose relative_to='l{0}'>0 0 0.01 0 0 0</pose><parent>l{0}</parent><child>l{k}</child>\
             <axis><xyz>1 0 0</xyz></axis></joint><link name='l{k}'><pose relative_to='j{k}'/></link>",
            k - 1
        );
    }
    let (draft, log) = read(&[("model.sdf", &(text + "</model></sdf>"))]);
    assert!(log.of(DecisionKind::Problem).next().is_none(), "{:?}", log.decisions);
    at(&draft, "j39", [0.0, 0.0, 0.39]);
}

#[test]
fn axes_of_the_first_versions_are_in_the_frame_of_the_model() {
    let text = |version: &str, more: &str| {
        format!(
            "<sdf version='{version}'><model name='m'><link name='a'/><link name='b'><pose>0 0 0 0 0 1.5707963267948966</pose></link>\
             <joint name='j' type='revolute'><parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz>{more}</axis></joint></model></sdf>"
        )
    };
    let axis = |version: &str, more: &str| {
        let (draft, _) = read(&[("model.sdf", &text(version, more))]);
        pose_of(&draft, "j").rotation * Vec3::from_array(draft.joints[0].axis)
    };
    assert!((axis("1.4", "") - Vec3::X).length() < 1e-9);
    assert!((axis("1.5", "") - Vec3::Y).length() < 1e-9);
    assert!((axis("1.5", "<use_parent_model_frame>1</use_parent_model_frame>") - Vec3::X).length() < 1e-9);
    assert!((axis("1.11", "") - Vec3::Y).length() < 1e-9);
}

#[test]
fn screws_and_gearboxes_are_couplings() {
    let link = |name: &str| format!("<link name='{name}'><inertial><mass>0.1</mass></inertial></link>");
    let hinge = |name: &str, child: &str, axis: &str| {
        format!(
            "<joint name='{name}' type='revolute'><parent>base</parent><child>{child}</child><axis><xyz>{axis}</xyz></axis></joint>"
        )
    };
    let text = format!(
        "<sdf version='1.10'><model name='m'>{}{}{}{}{}{}\
         <joint name='gear' type='gearbox'><parent>one</parent><child>two</child><gearbox_ratio>3</gearbox_ratio>\
         <gearbox_reference_body>base</gearbox_reference_body><axis><xyz>0 0 1</xyz></axis><axis2><xyz>0 0 1</xyz></axis2></joint>\
         <joint name='screw' type='screw'><parent>base</parent><child>nut</child><screw_thread_pitch>0.002</screw_thread_pitch>\
         <axis><xyz>0 1 0</xyz><limit><lower>0</lower><upper>3</upper></limit></axis></joint></model></sdf>",
        link("base"),
        link("one"),
        link("two"),
        link("nut"),
        hinge("first", "one", "0 0 1"),
        hinge("second", "two", "0 0 -1"),
    );
    let (draft, log) = read(&[("model.sdf", &text)]);
    assert!(log.of(DecisionKind::Problem).next().is_none(), "{:?}", log.decisions);
    let coupling = |joint: &str| draft.couplings.iter().find(|c| c.joint == joint).expect("is there").clone();
    let gear = coupling("second");
    // θ2 = -3 θ1 about the gearbox's axes; the second hinge turns the other way.
    assert_eq!((gear.leader.as_str(), gear.coefficients.as_slice()), ("first", &[0.0, 3.0][..]));
    let screw = coupling("screw_slide");
    assert_eq!(screw.leader, "screw");
    assert!((screw.coefficients[1] - 0.002 / std::f64::consts::TAU).abs() < 1e-12);
    let slide = draft.joints.iter().find(|joint| joint.name == "screw_slide").expect("is there");
    assert_eq!(
        (slide.kind, slide.child.as_str(), slide.axis),
        (JointKind::Prismatic, "nut", [0.0, 1.0, 0.0])
    );
    assert!(draft.loops.is_empty());
}

#[test]
fn shapes_masks_and_limits_that_a_hand_has_not_are_named() {
    let collision = |name: &str, geometry: &str, mask: &str| {
        format!(
            "<collision name='{name}'><geometry>{geometry}</geometry><surface><contact><collide_bitmask>{mask}</collide_bitmask>\
             </contact></surface></collision>"
        )
    };
    let ball = "<sphere><radius>0.01</radius></sphere>";
    let outline = "<polyline><height>0.02</height><point>0 0</point><point>0.01 0</point><point>0.01 0.03</point></polyline>";
    let text = format!(
        "<sdf version='1.9'><model name='m'><link name='a'>{}</link><link name='b'>{}</link><link name='c'>{}{}\
         <collision name='moved'><pose relative_to='b'>0 0 0.5 0 0 0</pose><geometry>{ball}</geometry></collision></link>\
         <joint name='j' type='revolute'><parent>a</parent><child>b</child><axis><xyz>1 0 0</xyz><limit><lower>-1</lower></limit></axis></joint>\
         <joint name='k' type='fixed'><parent>a</parent><child>c</child></joint></model></sdf>",
        collision("one", ball, "0x01"),
        collision("two", ball, "2"),
        collision("plane", "<plane><normal>0 0 1</normal></plane>", "3"),
        collision("outline", outline, "3"),
    );
    let (draft, log) = read(&[("model.sdf", &text)]);
    assert_eq!(draft.exclusions, [["a".to_owned(), "b".to_owned()]]);
    let c = draft.links.iter().find(|link| link.name == "c").expect("is there");
    assert_eq!(c.collisions.len(), 2);
    assert!((c.collisions[1].origin.pose().translation - Vec3::Z * 0.5).length() < 1e-12);
    let found = |kind: DecisionKind, text: &str| {
        let found = log.of(kind).any(|decision| decision.text.contains(text));
        assert!(found, "{text}: {:?}", log.decisions);
    };
    found(DecisionKind::Problem, "a plane has no counterpart");
    found(DecisionKind::Dropped, "the limit -1 on one side only");
    found(DecisionKind::Guessed, "<self_collide>");
    found(DecisionKind::Taken, "polyline");
}

#[test]
fn models_that_include_themselves_end() {
    let text = |other: &str| {
        let include =
            |name: &str| format!("<include><uri>model://{other}</uri><name>{name}</name></include>");
        let (first, second) = (include("x"), include("y"));
        format!("<sdf version='1.9'><model name='m'><link name='a'/>{first}{second}</model></sdf>")
    };
    let said = |files: &[(&str, &str)], sentence: &str| {
        let (_, log) = read(files);
        assert!(
            log.of(DecisionKind::Problem).any(|problem| problem.text.contains(sentence)),
            "{:?}",
            log.decisions
        );
    };
    let (m, n) = (text("m"), text("n"));
    said(&[("model.sdf", &m), ("m/model.sdf", &m)], "is the file that includes it");
    said(&[("model.sdf", &m), ("m/model.sdf", &n), ("n/model.sdf", &m)], "is one of more than");
}

#[test]
fn a_world_of_included_models_is_read() {
    let world = "<sdf version='1.9'><world name='w'><include><uri>model://finger</uri><name>mine</name></include></world></sdf>";
    let (draft, _) = read(&[("model.sdf", world), ("finger/model.sdf", FINGER)]);
    assert_eq!((draft.name.as_str(), draft.joints.len()), ("mine", 1));
}
