//! OpenRAVE's XML of robots.

use super::*;
use palmares_models::Vec3;

/// A palm, a finger of two joints of which the second follows, and a slide.
const HAND: &str = "<Robot name='claw'>
  <KinBody>
    <Body name='palm' type='dynamic'>
      <Geom type='box'><Extents>0.03 0.04 0.01</Extents><Translation>0 0 0.01</Translation></Geom>
      <mass type='custom'><total>0.5</total><com>0 0 0.01</com><inertia>3e-4 0 0 0 2e-4 0 0 0 4e-4</inertia></mass>
    </Body>
    <Body name='near'>
      <offsetfrom>palm</offsetfrom>
      <Translation>0 0.03 0.02</Translation>
      <RotationAxis>1 0 0 90</RotationAxis>
      <Geom type='cylinder'><radius>0.006</radius><height>0.04</height><Translation>0 0.02 0</Translation></Geom>
      <mass type='mimicgeom'><density>1000</density></mass>
    </Body>
    <Joint name='J1' type='hinge'>
      <Body>palm</Body><Body>near</Body><offsetfrom>near</offsetfrom>
      <limitsdeg>0 90</limitsdeg><axis>0 0 1</axis><anchor>0 0.002 0</anchor>
      <maxvel>2</maxvel><maxtorque>1.5</maxtorque><weight>1</weight><resolution>4</resolution>
    </Joint>
    <body name='far'>
      <offsetfrom>near</offsetfrom>
      <translation>0 0.045 0</translation>
      <geom type='sphere'><radius>0.008</radius></geom>
      <mass type='sphere'><radius>0.008</radius><total>0.02</total></mass>
    </body>
    <joint name='J2' type='hinge' enable='false' mimic_pos='J1/3+0.1' mimic_vel='|J1 0.3333'>
      <body>near</body><body>far</body><offsetfrom>far</offsetfrom><limits>0 1.5</limits><axis>0 0 1</axis>
    </joint>
    <Body name='thumb'>
      <Translation>0 -0.03 0.03</Translation>
      <Geom type='trimesh'><data>cube.off 0.5</data><render>cube.off 0.5</render><diffuseColor>1 0 0</diffuseColor></Geom>
    </Body>
    <Joint name='J3' type='slider'>
      <Body>thumb</Body><Body>palm</Body><limits>0 0.02</limits><axis>0 1 0</axis>
    </Joint>
    <adjacent>palm far</adjacent>
  </KinBody>
  <Manipulator name='m'><base>palm</base></Manipulator>
</Robot>";

const CUBE: &str = "OFF\n8 6 0\n0 0 0\n0.02 0 0\n0 0.02 0\n0.02 0.02 0\n0 0 0.02\n0.02 0 0.02\n0 0.02 0.02\n0.02 0.02 0.02\n\
    4 0 2 3 1\n4 4 5 7 6\n4 0 1 5 4\n4 2 6 7 3\n4 0 4 6 2\n4 1 3 7 5\n";

fn source(text: &str) -> Source {
    Source::new(&[("claw.robot.xml", text), ("cube.off", CUBE)])
}

#[track_caller]
fn at(a: Vec3, b: Vec3) {
    assert!((a - b).length() < 1e-9, "{a} and {b}");
}

#[test]
fn bodies_joints_and_masses_are_read() {
    let imported = source(HAND).import("claw.robot.xml");
    no_problems(&imported);
    let hand = loaded(&imported);
    assert_eq!(hand.name, "claw");
    let names: Vec<&str> = hand.motors.iter().map(|motor| motor.name.as_str()).collect();
    assert_eq!(names, ["J1", "J3"]);
    let link = |name: &str| &hand.links[hand.link(name).expect("a link")];
    let palm = link("palm").inertia;
    assert_eq!(palm.mass, 0.5);
    at(palm.com, Vec3::Z * 0.01);
    at(palm.about_com.y_axis, Vec3::Y * 2e-4);
    // π r² h at 1000 kg/m³.
    near(link("near").inertia.mass, std::f64::consts::PI * 0.006 * 0.006 * 0.04 * 1000.0);
    near(link("far").inertia.about_com.x_axis.x, 0.4 * 0.02 * 0.008 * 0.008);
    let hinge = |name: &str| link(name).joint.as_ref().expect("a joint").hinges[0].clone();
    // The frame of a link is at its joint: the anchor, 2 mm along the turned y, is above.
    at(hinge("near").parent_from_hinge.translation, Vec3::new(0.0, 0.03, 0.022));
    at(hinge("near").parent_from_hinge.rotation * hinge("near").axis, Vec3::new(0.0, -1.0, 0.0));
    // The far body is 45 mm from the near one, and that one's joint 2 mm nearer.
    at(hinge("far").parent_from_hinge.translation, Vec3::Y * 0.043);
    near(hinge("far").ratio, 1.0 / 3.0);
    near(hinge("far").offset, 0.1);
    // A joint from the outer body to the inner one moves it the other way.
    at(hinge("thumb").axis, Vec3::NEG_Y);
    let limits: Vec<[f64; 2]> = hand.coordinates.iter().map(|c| [c.lower, c.upper]).collect();
    near(limits[0][1], std::f64::consts::FRAC_PI_2);
    near(limits[1][1], 0.02);
    for (element, text) in [("<weight>", "planners"), ("Manipulator 'm'", "own programs")] {
        has(&imported, DecisionKind::Dropped, element, text);
    }
}

#[test]
fn shapes_are_where_their_bodies_have_them() {
    let text = String::from_utf8(source(HAND).import("claw.robot.xml").files[Path::new("hand.urdf")].clone());
    let text = text.expect("text");
    let link = |name: &str| {
        let start = text.split(&format!("<link name=\"{name}\">")).nth(1).expect("the link");
        start.split("</link>").next().expect("ends").to_owned()
    };
    // Half the sides are stated.
    assert!(link("palm").contains("<box size=\"0.06 0.08 0.02\"/>"), "{}", link("palm"));
    // A cylinder is along y, so that its z is turned by a quarter about x; the link's frame is 2 mm along y.
    assert!(
        link("near").contains("xyz=\"0 0.018") && link("near").contains("rpy=\"1.570796326794896"),
        "{}",
        link("near")
    );
    assert!(link("near").contains("<cylinder radius=\"0.006\" length=\"0.04\"/>"));
    assert_eq!(link("thumb").matches("scale=\"0.5 0.5 0.5\"").count(), 2, "{}", link("thumb"));
}

#[test]
fn files_with_prefixes_are_parts_of_the_robot() {
    let finger = "<KinBody name='finger'><Body name='tip'><Geom type='sphere'><radius>0.01</radius></Geom>\
                  <mass type='sphere'><radius>0.01</radius><total>0.05</total></mass></Body></KinBody>";
    let part = |side: &str, y: f64| {
        format!(
            "<KinBody prefix='{side}_' file='parts/finger.kinbody.xml'><Body name='{side}_tip'><offsetfrom>base</offsetfrom>\
             <Translation>0 {y} 0.05</Translation></Body></KinBody>\
             <Joint name='{side}' type='slider'><Body>base</Body><Body>{side}_tip</Body><axis>0 1 0</axis><limits>0 0.03</limits></Joint>"
        )
    };
    let base = "<Body name='base'><Geom type='box'><extents>0.03 0.05 0.01</extents></Geom><mass type='box'><total>0.3</total></mass></Body>";
    let text = format!("<KinBody name='gripper'>{base}{}{}</KinBody>", part("L", 0.02), part("R", -0.02));
    let source = Source::new(&[("g.kinbody.xml", &text), ("parts/finger.kinbody.xml", finger)]);
    let imported = source.import("g.kinbody.xml");
    no_problems(&imported);
    // A box without sides has those of the shapes.
    has(&imported, DecisionKind::Guessed, "robot", "states no inertia for 1 link (base)");
    let hand = loaded(&imported);
    let place = |name: &str| {
        let link = &hand.links[hand.link(name).expect("a link")];
        link.joint.as_ref().expect("a joint").hinges[0].parent_from_hinge.translation
    };
    at(place("L_tip"), Vec3::new(0.0, 0.02, 0.05));
    at(place("R_tip"), Vec3::new(0.0, -0.02, 0.05));
}

#[test]
fn faults_name_their_element() {
    for (from, to, element, words) in [
        (
            "<Body>palm</Body><Body>near</Body>",
            "<Body>palm</Body><Body>elsewhere</Body>",
            "Joint 'J1'",
            "two bodies",
        ),
        (
            "<offsetfrom>near</offsetfrom>\n      <translation>",
            "<offsetfrom>ear</offsetfrom>\n      <translation>",
            "offsetfrom",
            "'ear'",
        ),
        ("J1/3+0.1", "sin(J1)", "joint 'J2'", "the function sin"),
        ("type='slider'", "type='universal'", "Joint 'J3'", "valid: hinge, slider, spherical"),
        ("<Extents>0.03 0.04 0.01</Extents>", "", "Geom", "valid: box with extents"),
        ("cube.off 0.5</data>", "gone.off</data>", "thumb", "'gone.off' is not in"),
        ("<KinBody>", "<KinBody scalegeometry='2'>", "KinBody", "scalegeometry"),
    ] {
        assert!(HAND.contains(from), "{from}");
        let imported = source(&HAND.replace(from, to)).import("claw.robot.xml");
        has(&imported, DecisionKind::Problem, element, words);
    }
    // A joint between two bodies that others join already.
    let second = "<Joint name='J4'><Body>palm</Body><Body>far</Body></Joint></KinBody>";
    let imported = source(&HAND.replace("</KinBody>", second)).import("claw.robot.xml");
    has(&imported, DecisionKind::Problem, "joint 'J", "closes a chain");
}

#[test]
fn a_file_that_names_itself_often_ends() {
    let text = format!("<Robot name='r'>{}</Robot>", "<KinBody file='claw.robot.xml'/>".repeat(100));
    assert!(source(&text).refusal("claw.robot.xml").contains("has no links"));
    let bodies: String = (0..1025).map(|k| format!("<Body name='b{k}'/>")).collect();
    let refusal = source(&format!("<KinBody>{bodies}</KinBody>")).refusal("claw.robot.xml");
    assert!(refusal.contains("more than 1024 bodies"), "{refusal}");
}

#[test]
fn a_joint_that_follows_one_that_is_not_there_is_a_problem() {
    let imported = source(&HAND.replace("J1/3+0.1", "J9/3")).import("claw.robot.xml");
    has(&imported, DecisionKind::Problem, "J2", "J9");
}

#[test]
fn an_environment_says_what_is_in_it() {
    let text = format!("<Environment>{HAND}<KinBody name='mug'/></Environment>");
    let refusal = source(&text).refusal("claw.robot.xml");
    assert!(refusal.contains("environment of OpenRAVE with") && refusal.contains("mug"), "{refusal}");
}
