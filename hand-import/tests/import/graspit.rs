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
    has(&imported, Kind::Dropped, "dof 1", "breakaway clutch of 0.5 N·m");
    has(&imported, Kind::Dropped, "<eigenGrasps>", "no motors");
    let hand = loaded(&imported);
    // The second link turns about two hinges with one motor.
    assert_eq!((hand.coordinates.len(), hand.motors.len(), hand.links.len()), (2, 2, 3));
    near(hand.coordinates[0].upper, std::f64::consts::PI);
    near(hand.coordinates[0].damping, 0.05);
    near(hand.tendons[0].force_limit, 5.0);
    near(hand.tendons[0].stiffness, 100.0);
    let poses = hand.base_from_links(&[0.3, 0.2]);
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
    for (link, body) in [(1, first), (2, last)] {
        let shapes = poses[link] * hand.links[link].geoms[0].link_from_geom;
        near((shapes.translation - body.translation).length(), 0.0);
        near((shapes.rotation * Vec3::Y - body.rotation * Vec3::Y).length(), 0.0);
    }
}

#[test]
fn bodies_that_cannot_be_read_are_all_named() {
    let source =
        Source::new(&[("claw.xml", ROBOT), ("iv/palm.xml", BODY), ("iv/box.iv", "#Inventor V2.1 binary\n")]);
    let imported = source.import("claw.xml");
    has(&imported, Kind::Problem, "link 'palm'", "binary Open Inventor");
    has(&imported, Kind::Problem, "link 'chain0_link0'", "link.xml");
    has(&imported, Kind::Problem, "link 'chain0_link1'", "link.xml");
}
