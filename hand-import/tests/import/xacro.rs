//! xacro, where it is installed.

use super::*;

const MACROS: &str = "<robot xmlns:xacro='http://www.ros.org/wiki/xacro'>
  <xacro:macro name='part' params='name'>
    <link name='${name}'><inertial><mass value='${0.1 * 0.5}'/>
      <inertia ixx='1e-5' iyy='1e-5' izz='1e-5' ixy='0' ixz='0' iyz='0'/></inertial>
      <collision><geometry><box size='0.02 0.02 0.04'/></geometry></collision></link>
  </xacro:macro></robot>";
const ROBOT: &str = "<robot name='claw' xmlns:xacro='http://www.ros.org/wiki/xacro'>
  <xacro:include filename='$(find claw_description)/urdf/macros.xacro'/>
  <xacro:arg name='upper' default='1.0'/>
  <xacro:part name='palm'/><xacro:part name='finger'/>
  <joint name='base' type='revolute'><parent link='palm'/><child link='finger'/><origin xyz='0 0 0.05'/>
    <axis xyz='1 0 0'/><limit lower='0' upper='$(arg upper)' effort='1' velocity='1'/></joint></robot>";

fn source() -> Source {
    Source::new(&[
        ("package.xml", "<package><name>claw_description</name></package>"),
        ("urdf/claw.urdf.xacro", ROBOT),
        ("urdf/macros.xacro", MACROS),
    ])
}

fn installed() -> bool {
    let python = std::process::Command::new("python3").args(["-c", "import xacro"]).output();
    python.is_ok_and(|output| output.status.success())
}

#[test]
fn macros_are_expanded_or_their_program_is_named() {
    let source = source();
    if !installed() {
        let refusal = source.refusal("urdf/claw.urdf.xacro");
        assert!(refusal.contains("pip install xacro"), "{refusal}");
        return;
    }
    let options =
        ImportOptions { xacro_arguments: vec!["upper:=1.25".to_owned()], ..ImportOptions::default() };
    // The file of macros is no robot of its own: the folder has one.
    let imported = source.import_with("", &options);
    no_problems(&imported);
    let hand = loaded(&imported);
    near(hand.coordinates[0].upper, 1.25);
    near(hand.links[1].inertia.mass, 0.05);
}

#[test]
fn arguments_have_a_name_and_a_value() {
    let options = ImportOptions { xacro_arguments: vec!["upper=1".to_owned()], ..ImportOptions::default() };
    let error = import(&source().path("urdf/claw.urdf.xacro"), &options).expect_err("refused").to_string();
    assert!(error.contains("--arg 'upper=1'; valid: NAME:=VALUE"), "{error}");
    let urdf = Source::new(&[("claw.urdf", &finger(""))]);
    has(&urdf.import_with("claw.urdf", &options), DecisionKind::Dropped, "--arg", "the file is URDF");
}

#[test]
fn what_xacro_refuses_is_passed_on() {
    if !installed() {
        return;
    }
    let source = source();
    source.write("urdf/claw.urdf.xacro", ROBOT.replace("claw_description", "none").as_bytes());
    let refusal = source.refusal("urdf/claw.urdf.xacro");
    assert!(refusal.contains("xacro refuses it") && refusal.contains("none"), "{refusal}");
    source.write(
        "urdf/claw.urdf.xacro",
        ROBOT.replace("<xacro:arg name='upper' default='1.0'/>", "").as_bytes(),
    );
    assert!(source.refusal("urdf/claw.urdf.xacro").contains("--arg NAME:=VALUE"));
}
