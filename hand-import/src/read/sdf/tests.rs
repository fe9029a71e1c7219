use std::path::{Path, PathBuf};

use crate::decision::Kind;
use palmares_models::Vec3;

use crate::decision::Log;
use crate::draft::{Draft, JointKind};
use crate::read::reading::Reading;
use crate::source::Source;

fn read(files: &[(&str, &str)]) -> (Draft, Log) {
    let entries = files.iter().map(|(name, text)| (PathBuf::from(name), text.as_bytes().to_vec())).collect();
    let source = Source::memory(Path::new("test"), entries).expect("small");
    let path = PathBuf::from("model.sdf");
    let mut reading = Reading { source: &source, path: path.clone(), log: Log::new(&path), mounted: 0 };
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
    assert_eq!((left.damping, left.stiffness, left.rest), (Some(0.01), Some(0.2), Some(-0.1)));
    let link = draft.links.iter().find(|link| link.name == "left").expect("is there");
    assert!((link.collisions[0].origin.pose().translation - Vec3::Z * 0.04).length() < 1e-12);
    assert_eq!(joint("right").kind, JointKind::Continuous);
    let [offset, multiplier] = draft.couplings[0].coefficients[..] else { panic!("{:?}", draft.couplings) };
    assert!(multiplier == 2.0 && (offset - 0.1).abs() < 1e-12, "{offset}");
    assert_eq!(draft.links[0].friction, Some(0.7));
    assert_eq!((draft.actuators[0].gain, draft.actuators[0].force_limit), (Some(30.0), Some(2.0)));
    let dropped: Vec<&str> = log.of(Kind::Dropped).map(|d| d.element.as_str()).collect();
    assert_eq!(dropped, ["model 'ball'", "gripper 'g'", "joint 'base'", "plugin 'p'"]);
    assert!(log.of(Kind::Problem).next().is_none(), "{:?}", log.decisions);
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
    assert!(log.of(Kind::Problem).next().is_none(), "{:?}", log.decisions);
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
