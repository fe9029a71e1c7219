//! GraspIt!'s robot XML.

use super::*;
use palmares_models::Vec3;

const ROBOT: &str = "<?xml version='1.0' ?>
<robot type='Hand'>
  <palm>palm.xml</palm>
  <dof type='r'><maxEffort>5.0e+9</maxEffort><Kp>1.0e+11</Kp><Kd>1.0e+7</Kd></dof>
  <dof type='b'><maxEffort>2.5e+9</maxEffort><breakAwayTorque>0.5</breakAwayTorque></dof>
  <chain>
    <transform><translation>25 0 -1</translation><rotation>180 y</rotation></transform>
    <joint type='Revolute'><theta>d0+90</theta><d>0</d><a>50</a><alpha>-90</alpha>
      <minValue>0</minValue><maxValue>180</maxValue><viscousFriction>5.0e+7</viscousFriction></joint>
    <joint type='Revolute'><theta>d1+5</theta><d>0</d><a>70</a><alpha>0</alpha>
      <minValue>0</minValue><maxValue>140</maxValue></joint>
    <joint type='Revolute'><theta>d1*0.25-40</theta><d>0</d><a>55</a><alpha>0</alpha>
      <minValue>0</minValue><maxValue>35</maxValue></joint>
    <link dynamicJointType='Revolute'>link.xml</link>
    <link dynamicJointType='Universal'>link.xml</link>
  </chain>
  <eigenGrasps>eigen.xml</eigenGrasps>
  <virtualContacts>contacts.xml</virtualContacts>
</robot>";

const BODY: &str = "<root><material>wood</material><mass>200</mass><cog>-10 0 0</cog>
  <inertia_matrix>400 0 0 0 800 0 0 0 900</inertia_matrix><geometryFile>box.iv</geometryFile></root>";

const BOX: &str = "#Inventor V2.0 ascii
Separator { Material { diffuseColor 0 0 0 } # black
  Coordinate3 { point [ 0 0 0, -50 0 0, 0 10 0, -50 10 0, 0 0 10, -50 0 10, 0 10 10, -50 10 10 ] }
  IndexedFaceSet { coordIndex [ 0,1,3,2,-1, 4,6,7,5,-1, 0,4,5,1,-1, 2,3,7,6,-1, 0,2,6,4,-1, 1,5,7,3,-1 ] }
}";

#[test]
fn chains_become_joints_in_metres_and_radians() {
    let source = Source::new(&[
        ("models/claw.xml", ROBOT),
        ("models/iv/palm.xml", BODY),
        ("models/iv/link.xml", BODY),
        ("models/iv/box.iv", BOX),
    ]);
    let imported = source.import("models/claw.xml");
    no_problems(&imported);
    has(&imported, DecisionKind::Taken, "dof 1", "breakaway clutch of 0.5 N·m");
    has(&imported, DecisionKind::Dropped, "<eigenGrasps>", "no motors");
    let hand = loaded(&imported);
    // The second link turns about two hinges, the second of which the clutch of the first lets go on.
    assert_eq!((hand.coordinates.len(), hand.motors.len(), hand.links.len()), (3, 2, 4));
    near(hand.coordinates[0].upper, std::f64::consts::PI);
    near(hand.coordinates[0].damping, 0.05);
    let first = hand.tendons.iter().find(|tendon| tendon.name == "chain0_joint0").expect("a drive");
    near(first.force_limit, 5.0);
    near(first.stiffness, 100.0);
    let poses = hand.base_from_links(&[0.3, 0.2, 0.05]);
    // The same chain by its definition: Rz(theta) Tz(d) Tx(a) Rx(alpha) of each joint.
    let about = |axis: Vec3, angle: f64| {
        palmares_models::Pose::from_parts(Vec3::ZERO, palmares_models::Rotation::from_axis_angle(axis, angle))
    };
    let along = |x: f64, y: f64, z: f64| {
        palmares_models::Pose::from_parts(Vec3::new(x, y, z), palmares_models::Rotation::IDENTITY)
    };
    let dh = |theta: f64, a: f64, alpha: f64| {
        about(Vec3::Z, theta) * along(a, 0.0, 0.0) * about(Vec3::X, f64::to_radians(alpha))
    };
    let palm = along(0.025, 0.0, -0.001) * about(Vec3::Y, std::f64::consts::PI);
    let first = palm * dh(0.3 + 90f64.to_radians(), 0.05, -90.0);
    let last = first * dh(0.2 + 5f64.to_radians(), 0.07, 0.0) * dh(0.05 - 40f64.to_radians(), 0.055, 0.0);
    for (link, body) in [(1, first), (3, last)] {
        let shapes = poses[link] * hand.links[link].geoms[0].link_from_geom;
        near((shapes.translation - body.translation).length(), 0.0);
        near((shapes.rotation * Vec3::Y - body.rotation * Vec3::Y).length(), 0.0);
    }
}

/// A robot with a palm and one chain of `joints` and `links` for these degrees of freedom.
fn robot(dofs: &str, chain: &str) -> String {
    format!("<robot type='Hand'><palm>palm.xml</palm>{dofs}{chain}</robot>")
}

fn revolute(theta: &str, more: &str) -> String {
    format!(
        "<joint type='Revolute'><theta>{theta}</theta><d>0</d><a>50</a><alpha>0</alpha><minValue>0</minValue>\
         <maxValue>90</maxValue>{more}</joint>"
    )
}

const LINK: &str = "<link dynamicJointType='Revolute'>link.xml</link>";

fn files(robot: &str) -> Source {
    Source::new(&[("claw.xml", robot), ("iv/palm.xml", BODY), ("iv/link.xml", BODY), ("iv/box.iv", BOX)])
}

#[test]
fn a_breakaway_clutch_lets_the_outer_joint_go_on() {
    let dof = "<dof type='b'><maxEffort>2.5e+9</maxEffort><Kp>4e+10</Kp><Kd>5e+8</Kd>\
               <breakAwayTorque>0.9</breakAwayTorque></dof>";
    let joints = revolute("d0", "<viscousFriction>2e+7</viscousFriction>") + &revolute("d0*0.25+40", "");
    let imported = files(&robot(dof, &format!("<chain>{joints}{LINK}{LINK}</chain>"))).import("claw.xml");
    no_problems(&imported);
    has(&imported, DecisionKind::Guessed, "dof 0", "holds 9 N·m");
    let hand = loaded(&imported);
    assert_eq!((hand.coordinates.len(), hand.motors.len(), hand.tendons.len()), (2, 1, 2));
    let [inner, outer] = hand.tendons.as_slice() else { panic!("two drives") };
    assert!(inner.breakaway && inner.both_ways && !outer.breakaway && outer.both_ways);
    near(inner.force_limit, 0.9);
    near(inner.hold_limit.expect("held"), 9.0);
    assert_eq!(outer.hold_limit, None);
    near(outer.force_limit, 2.5);
    for tendon in [inner, outer] {
        near(tendon.stiffness, 40.0);
        near(tendon.damping, 0.5);
    }
    // Both limits allow the motor 90°; it winds the joints by 1 : 0.25.
    near(hand.motors[0].scaling, 90f64.to_radians());
    near(hand.motors[0].offset, 0.0);
    for sigma in [0.0, 0.5, 1.0] {
        let wound = |tendon: &palmares_models::hand::Tendon| tendon.wound(&hand.motors, |_| sigma);
        near(wound(inner), sigma * 90f64.to_radians());
        near(wound(outer), 0.25 * wound(inner));
    }
    // Without a torque, and with one joint only, nothing can let go.
    for (dof, chain, text) in [
        ("<dof type='b'/>", format!("<chain>{joints}{LINK}{LINK}</chain>"), "without a breakAwayTorque"),
        (dof, format!("<chain>{}{LINK}</chain>", revolute("d0", "")), "only one joint"),
    ] {
        let imported = files(&robot(dof, &chain)).import("claw.xml");
        has(&imported, DecisionKind::Dropped, "dof 0", text);
        assert_eq!(loaded(&imported).coordinates.len(), 1);
    }
}

#[test]
fn a_compliant_degree_of_freedom_is_a_cable_against_springs() {
    let dof = "<dof type='c'><maxEffort>6e+7</maxEffort></dof>";
    let finger = |constant: &str| {
        let spring = |k: &str| format!("<springStiffness>{k}</springStiffness><restValue>-30</restValue>");
        revolute(constant, &spring("1600")) + &revolute("d0*0.6+45", &spring("1000"))
    };
    let chains = format!("<chain>{}{LINK}{LINK}</chain>", finger("d0+-65")).repeat(2);
    let imported = files(&robot(dof, &chains)).import("claw.xml");
    no_problems(&imported);
    has(&imported, DecisionKind::Taken, "dof 0", "one cable over 4 joints");
    let hand = loaded(&imported);
    assert_eq!((hand.coordinates.len(), hand.motors.len(), hand.tendons.len()), (4, 1, 1));
    near(hand.tendons[0].force_limit, 60.0);
    // GraspIt!'s own proportion of the free motion: 0.6 of the inner joint for the outer one, by E⁻¹ Rᵀ.
    let arms = [0.064, 0.024, 0.064, 0.024];
    for (k, arm) in arms.into_iter().enumerate() {
        near(hand.tendons[0].moment_arms[k].1, arm);
        near(hand.coordinates[k].stiffness, if k % 2 == 0 { 1.6 } else { 1.0 });
        near(hand.coordinates[k].rest, -30f64.to_radians());
    }
    near(arms[1] / 1.0, 0.6 * arms[0] / 1.6);
}

#[test]
fn every_kind_of_transform_is_read() {
    // The same pose three times: 90° about z, then 90° about the new x; the columns are (0, 1, 0), (0, 0, 1), (1, 0, 0).
    let same = [
        "<translation>10 20 30</translation><rotation>90 z</rotation><rotation>90 x</rotation>",
        "<translation>10 20 30</translation><rotationMatrix>0 1 0 0 0 1 1 0 0</rotationMatrix>",
        "<fullTransform>(0.5 0.5 0.5 0.5)[10 20 30]</fullTransform>",
    ];
    for transform in same {
        let chain = format!("<chain><transform>{transform}</transform>{}{LINK}</chain>", revolute("d0", ""));
        let imported = files(&robot("<dof type='r'/>", &chain)).import("claw.xml");
        no_problems(&imported);
        let hand = loaded(&imported);
        let hinge = hand.base_from_links(&[0.0])[1];
        near((hinge.translation - Vec3::new(0.01, 0.02, 0.03)).length(), 0.0);
        near((hinge.rotation * Vec3::X - Vec3::Y).length(), 0.0);
        near((hinge.rotation * Vec3::Z - Vec3::X).length(), 0.0);
    }
    for (wrong, text) in [
        ("<rotationMatrix>0 1 0 0 0 1 -1 0 0</rotationMatrix>", "no rotation"),
        ("<fullTransform>(0 0 0 0)[1 2 3]</fullTransform>", "no rotation"),
        ("<rotation>90 w</rotation>", "unknown axis"),
        ("<scale>2</scale>", "is not read"),
    ] {
        let chain = format!("<chain><transform>{wrong}</transform>{}{LINK}</chain>", revolute("d0", ""));
        let imported = files(&robot("<dof type='r'/>", &chain)).import("claw.xml");
        has(&imported, DecisionKind::Problem, "chain 0", text);
        loaded(&imported);
    }
}

#[test]
fn a_fixed_link_is_in_the_frame_of_the_joint_before_it() {
    let chain = format!(
        "<chain>{}{}{LINK}<link dynamicJointType='Fixed'>link.xml</link>{LINK}</chain>",
        revolute("d0", ""),
        revolute("d1", "")
    );
    let imported = files(&robot("<dof type='r'/><dof type='r'/>", &chain)).import("claw.xml");
    no_problems(&imported);
    let hand = loaded(&imported);
    // The fixed link is one body with the first: both shapes are 50 mm out.
    assert_eq!(hand.links.len(), 3);
    assert_eq!(hand.links[1].geoms.len(), 2);
    for geom in &hand.links[1].geoms {
        near((geom.link_from_geom.translation - Vec3::X * 0.05).length(), 0.0);
    }
    near((hand.base_from_links(&[0.0, 0.0])[2].translation - Vec3::X * 0.05).length(), 0.0);
}

#[test]
fn a_fixed_link_can_have_a_joint_that_it_holds() {
    let held = "<joint type='Revolute'><theta>d0+90</theta><d>10</d><a>20</a><alpha>0</alpha><minValue>0</minValue>\
                <maxValue>0</maxValue></joint>";
    let chain = format!(
        "<chain>{held}{}<link dynamicJointType='Fixed'>link.xml</link>{LINK}</chain>",
        revolute("d1", "")
    );
    let imported = files(&robot("<dof type='r'/><dof type='r'/>", &chain)).import("claw.xml");
    no_problems(&imported);
    has(&imported, DecisionKind::Dropped, "dof 0", "moves no joint");
    let hand = loaded(&imported);
    assert_eq!((hand.links.len(), hand.links[0].geoms.len()), (2, 2));
    near((hand.links[0].geoms[1].link_from_geom.translation - Vec3::new(0.0, 0.02, 0.01)).length(), 0.0);
    near((hand.base_from_links(&[0.0])[1].translation - Vec3::new(0.0, 0.02, 0.01)).length(), 0.0);
}

#[test]
fn a_tendon_over_points_is_a_cable_with_a_motor() {
    let spring = "<springStiffness>200</springStiffness>";
    let joints = revolute("d0", spring) + &revolute("d1+20", spring);
    let point = |chain: i32, link: i32, at: &str| {
        format!(
            "<insertionPoint><chain>{chain}</chain><link>{link}</link><position>{at}</position></insertionPoint>"
        )
    };
    // Link frames are 50 mm behind their joints.
    let points = point(-1, -1, "-40 8 3")
        + &point(-1, -1, "-10 6 0")
        + &point(0, 0, "-41 8 2")
        + &point(0, 0, "-5 7 0")
        + &point(0, 1, "-45 9 0");
    let dofs = "<dof type='r'/><dof type='r'/>";
    let chain = format!("<chain>{joints}{LINK}{LINK}</chain>");
    let text = robot(dofs, &format!("{chain}<tendon name='Finger 0'>{points}</tendon>"));
    let imported = files(&text).import("claw.xml");
    no_problems(&imported);
    has(&imported, DecisionKind::Dropped, "dof 1", "a tendon pulls");
    let hand = loaded(&imported);
    assert_eq!((hand.coordinates.len(), hand.motors.len(), hand.tendons.len()), (2, 1, 1));
    // The guessed numbers are within the limits of a hand.
    assert!(hand.tendons[0].stiffness <= 1e6);
    let distance = |a: [f64; 3], b: [f64; 3]| (Vec3::from_array(a) - Vec3::from_array(b)).length();
    let turned = |[x, y, z]: [f64; 3], angle: f64| {
        let (sin, cos) = angle.sin_cos();
        [x * cos - y * sin, x * sin + y * cos, z]
    };
    let length = |q: [f64; 2]| {
        distance([-0.01, 0.006, 0.0], turned([0.009, 0.008, 0.002], q[0]))
            + distance([-0.005, 0.007, 0.0], turned([0.005, 0.009, 0.0], q[1] + 20f64.to_radians()))
    };
    for q in [[0.0, 0.0], [0.4, 0.0], [0.3, 1.1], [1.5, 0.7]] {
        // The motor takes the cable in by as much as it gets shorter.
        let shorter = length([0.0, 0.0]) - length(q);
        let off = hand.tendons[0].length(&q) - hand.tendons[0].length(&[0.0, 0.0]) - shorter;
        assert!(off.abs() < 2e-7, "{q:?}: {off}");
    }
    // Over joints without springs, over two joints at once, and around a cylinder it is left out by name.
    let wrapper = "<tendonWrapper><chain>0</chain><link>0</link></tendonWrapper>";
    let bare = format!("<chain>{}{}{LINK}{LINK}</chain>", revolute("d0", ""), revolute("d1", ""));
    let far = point(-1, -1, "0 9 0") + &point(0, 1, "0 9 0");
    for (chain, points, extra, reason) in [
        (&bare, &points, "", "no spring"),
        (&chain, &far, "", "straight over 2 joints"),
        (&chain, &points, wrapper, "<tendonWrapper>"),
        (&chain, &point(7, 0, "0 0 0"), "", "not read"),
        (&chain, &String::new(), "", "over no joint"),
    ] {
        let text = robot(dofs, &format!("{chain}<tendon name='Finger 0'>{points}</tendon>{extra}"));
        let imported = files(&text).import("claw.xml");
        has(&imported, DecisionKind::Dropped, "tendon 'Finger 0'", reason);
        assert_eq!(loaded(&imported).motors.len(), 2);
    }
}

#[test]
fn geometry_has_its_own_scale_and_offset() {
    let body = BODY.replace(
        "</root>",
        "<geometryScaling>2</geometryScaling><geometryOffset><transform><translation>0 0 7</translation>\
         <rotation>90 z</rotation></transform></geometryOffset></root>",
    );
    let text = robot("<dof type='r'/>", &format!("<chain>{}{LINK}</chain>", revolute("d0", "")));
    let source = files(&text);
    source.write("iv/link.xml", body.as_bytes());
    let imported = source.import("claw.xml");
    no_problems(&imported);
    let urdf = String::from_utf8(imported.files[Path::new("hand.urdf")].clone()).expect("text");
    assert!(urdf.contains("scale=\"0.002 0.002 0.002\""), "{urdf}");
    let hand = loaded(&imported);
    let pose = hand.links[1].geoms[0].link_from_geom;
    near((pose.translation - Vec3::new(0.05, 0.0, 0.007)).length(), 0.0);
    near((pose.rotation * Vec3::X - Vec3::Y).length(), 0.0);
}

#[test]
fn links_of_solids_have_their_own_shapes() {
    let text = robot("<dof type='r'/>", &format!("<chain>{}{LINK}</chain>", revolute("d0", "")));
    let source = files(&text);
    let solids = "#Inventor V2.1 ascii\nSeparator { Translation { translation 0 0 10 } Cylinder { radius 5 height 40 }\n\
                  Separator { Translation { translation 0 25 0 } Sphere { radius 6 } } }";
    source.write("iv/box.iv", solids.as_bytes());
    let imported = source.import("claw.xml");
    no_problems(&imported);
    let urdf = String::from_utf8(imported.files[Path::new("hand.urdf")].clone()).expect("text");
    assert!(urdf.contains("<cylinder radius=\"0.005\" length=\"0.04\"/>"), "{urdf}");
    assert!(urdf.contains("<sphere radius=\"0.006\"/>"), "{urdf}");
    let hand = loaded(&imported);
    let [cylinder, ball] = hand.links[0].geoms.as_slice() else { panic!("two shapes") };
    near((cylinder.link_from_geom.translation - Vec3::new(0.0, 0.0, 0.01)).length(), 0.0);
    near((ball.link_from_geom.translation - Vec3::new(0.0, 0.025, 0.01)).length(), 0.0);
    near((cylinder.link_from_geom.rotation * Vec3::Z).y.abs(), 1.0);
}

#[test]
fn a_scene_that_draws_nothing_is_a_link_without_a_shape() {
    let chain = format!("<chain>{}{}{LINK}{LINK}</chain>", revolute("d0", ""), revolute("d1", ""));
    let text = robot("<dof type='r'/><dof type='r'/>", &chain.replacen("link.xml", "faux.xml", 1));
    let source = files(&text);
    source.write("iv/faux.xml", BODY.replace("box.iv", "faux.iv").as_bytes());
    source.write("iv/faux.iv", b"#Inventor V2.1 ascii\nSeparator { Material { } }");
    let imported = source.import("claw.xml");
    no_problems(&imported);
    has(&imported, DecisionKind::Taken, "link 'chain0_link0'", "draws nothing");
    assert_eq!(loaded(&imported).coordinates.len(), 2);
}

#[test]
fn slides_springs_and_starts_have_their_units() {
    let joint = "<joint type='Prismatic'><theta>0</theta><d>d0*-1+8</d><a>0</a><alpha>0</alpha><minValue>0</minValue>\
                 <maxValue>-20</maxValue><viscousFriction>3e+5</viscousFriction>\
                 <springStiffness>0.4</springStiffness></joint>";
    let turning = revolute("d1", "<springStiffness>500</springStiffness>");
    let prismatic = "<link dynamicJointType='Prismatic'>link.xml</link>";
    let dofs = "<dof type='r'><maxEffort>4e+7</maxEffort><Kp>2e+6</Kp></dof><dof type='r'><defaultValue>20</defaultValue></dof>";
    let text = robot(dofs, &format!("<chain>{joint}{turning}{prismatic}{LINK}</chain>"));
    let imported = files(&text).import("claw.xml");
    no_problems(&imported);
    let hand = loaded(&imported);
    let [slide, turn] = hand.coordinates.as_slice() else { panic!("two") };
    near(slide.lower, -0.02);
    near(slide.upper, 0.0);
    near(slide.damping, 300.0);
    near(slide.stiffness, 400.0);
    near(turn.stiffness, 0.5);
    let drive = hand.tendons.iter().find(|tendon| tendon.name == "chain0_joint0").expect("a drive");
    near(drive.force_limit, 40.0);
    near(drive.stiffness, 2000.0);
    near(hand.base_from_links(&[0.0, 0.0])[1].translation.z, 0.008);
    let settings = String::from_utf8(imported.files[Path::new("hand.toml")].clone()).expect("text");
    assert!(settings.contains("[start]\njoints = { chain0_joint1 = 0.349"), "{settings}");
}

#[test]
fn gains_of_another_kind_of_joint_are_stand_ins() {
    let joint = "<joint type='Prismatic'><theta>0</theta><d>d0</d><a>0</a><alpha>0</alpha><minValue>0</minValue>\
                 <maxValue>20</maxValue><viscousFriction>1e+8</viscousFriction></joint>";
    let dof = "<dof type='r'><maxEffort>2e+7</maxEffort><Kp>1e+11</Kp><Kd>1e+7</Kd></dof>";
    let text =
        robot(dof, &format!("<chain>{joint}<link dynamicJointType='Prismatic'>link.xml</link></chain>"));
    let imported = files(&text).import("claw.xml");
    no_problems(&imported);
    has(&imported, DecisionKind::Guessed, "joint 'chain0_joint0'", "the damping 100000");
    has(&imported, DecisionKind::Guessed, "actuator 'd0'", "the gain 100000000");
    let hand = loaded(&imported);
    assert!(hand.tendons[0].stiffness <= 1e6 && hand.coordinates[0].damping <= 1e3);
    near(hand.tendons[0].force_limit, 20.0);
}

#[test]
fn exchanged_gains_do_not_make_a_motor_creep() {
    let dof = "<dof type='r'><maxEffort>1e+8</maxEffort><Kp>1e+8</Kp><Kd>1e+11</Kd></dof>";
    let text = robot(dof, &format!("<chain>{}{LINK}</chain>", revolute("d0", "")));
    let imported = files(&text).import("claw.xml");
    no_problems(&imported);
    has(&imported, DecisionKind::Guessed, "actuator 'd0'", "it would creep");
    let hand = loaded(&imported);
    near(hand.tendons[0].stiffness, 0.1);
    near(hand.tendons[0].damping, 0.002);
}

#[test]
fn links_that_never_touch_are_kept() {
    let chain = |rule: &str| {
        format!(
            "<chain>{}<link dynamicJointType='Revolute' {rule}>link.xml</link></chain>",
            revolute("d0", "")
        )
    };
    let pair = "collisionRule='OverlappingPair' targetChain='0' targetLink='0'";
    let extra = "<disableCollision body1_chain='-1' body1_link='-1' body2_chain='1' body2_link='0'/>";
    let text = robot("<dof type='r'/>", &(chain("") + &chain(pair) + &chain("collisionRule='Off'") + extra));
    let imported = files(&text).import("claw.xml");
    no_problems(&imported);
    let settings = String::from_utf8(imported.files[Path::new("hand.toml")].clone()).expect("text");
    assert!(settings.contains("[\"chain0_link0\", \"chain1_link0\"]"), "{settings}");
    assert!(settings.contains("[\"palm\", \"chain1_link0\"]"), "{settings}");
    has(&imported, DecisionKind::Taken, "link 'chain2_link0'", "touches nothing");
    // It is drawn, so that its joint moves.
    assert_eq!(loaded(&imported).links.len(), 4);
    let own = text.replace("type='Hand'", "type='M7Tool'");
    has(&files(&own).import("claw.xml"), DecisionKind::Taken, "robot", "1 pairs");
}

#[test]
fn comments_may_have_hyphens_and_a_palm_attributes() {
    let text = ROBOT.replace("<palm>", "<!-- --- the palm --- --><palm sensorType='none'>");
    let source = Source::new(&[
        ("claw.xml", &text),
        ("virtual/contacts.xml", "<virtual_contacts/>"),
        ("eigen/eigen.xml", "<EigenGrasps/>"),
        ("iv/palm.xml", &BODY.replace("<mass>", "<!-- -- --><mass>")),
        ("iv/link.xml", BODY),
        ("iv/box.iv", BOX),
    ]);
    // The folder's only robot is found among its other files.
    no_problems(&source.import(""));
}

#[test]
fn a_hand_without_its_meshes_still_loads() {
    let dofs = "<dof type='c'/>";
    let spring = "<springStiffness>900</springStiffness>";
    let joints = revolute("d0", spring) + &revolute("d0*0.5", spring);
    let chains = format!("<chain>{joints}{LINK}{LINK}</chain>").repeat(2);
    let chains = chains.replacen("link.xml", "lost.xml", 1).replacen("link.xml", "lost.xml", 1);
    let imported = files(&robot(dofs, &chains)).import("claw.xml");
    has(&imported, DecisionKind::Problem, "link 'chain0_link0'", "lost.xml");
    has(&imported, DecisionKind::Dropped, "joint 'chain0_joint0'", "moves no shape");
    let hand = loaded(&imported);
    assert_eq!((hand.coordinates.len(), hand.tendons.len()), (2, 1));
    // Nothing at all is left of this one, and of one whose followers have lost their shapes.
    let none = chains.replace("link.xml", "lost.xml");
    for dofs in [dofs, "<dof type='r'/>"] {
        let imported = files(&robot(dofs, &none)).import("claw.xml");
        let problems = imported.problems().filter(|p| p.text.contains("lost.xml")).count();
        assert_eq!((loaded(&imported).coordinates.len(), problems), (0, 4));
    }
}

#[test]
fn bodies_that_cannot_be_read_are_all_named() {
    let source =
        Source::new(&[("claw.xml", ROBOT), ("iv/palm.xml", BODY), ("iv/box.iv", "#Inventor V2.1 binary\n")]);
    let imported = source.import("claw.xml");
    has(&imported, DecisionKind::Problem, "link 'palm'", "binary Open Inventor");
    has(&imported, DecisionKind::Problem, "link 'chain0_link0'", "link.xml");
    has(&imported, DecisionKind::Problem, "link 'chain0_link1'", "link.xml");
}
