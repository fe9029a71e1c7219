//! The links of each built-in hand against its file's joints, followed one by one with another library's rotations.

use nalgebra::{Isometry3, Point3, Rotation3, Translation3, Unit, Vector3};
use urdf_rs::{JointType, Robot};

use crate::Vec3;
use crate::builtin::{builtin_hands, builtin_texts};
use crate::hand::Hand;

/// The value of a joint: that of its coordinate, or of the joint that it mimics.
fn value(robot: &Robot, joint: &str, hand: &Hand, q: &[f64]) -> f64 {
    let found = robot.joints.iter().find(|other| other.name == joint).unwrap();
    match &found.mimic {
        Some(mimic) => {
            let leader = value(robot, &mimic.joint, hand, q);
            mimic.multiplier.unwrap_or(1.0) * leader + mimic.offset.unwrap_or(0.0)
        }
        None => q[hand.coordinate(joint).unwrap()],
    }
}

/// The pose of a link in the root's frame.
fn pose(robot: &Robot, link: &str, hand: &Hand, q: &[f64]) -> Isometry3<f64> {
    let Some(joint) = robot.joints.iter().find(|joint| joint.child.link == link) else {
        return Isometry3::identity();
    };
    let ([x, y, z], [roll, pitch, yaw]) = (*joint.origin.xyz, *joint.origin.rpy);
    let origin = Rotation3::from_euler_angles(roll, pitch, yaw);
    let origin = Isometry3::from_parts(Translation3::new(x, y, z), origin.into());
    let axis = Unit::new_normalize(Vector3::from(*joint.axis.xyz));
    let motion = match joint.joint_type {
        JointType::Fixed => Isometry3::identity(),
        JointType::Prismatic => Translation3::from(axis.scale(value(robot, &joint.name, hand, q))).into(),
        _ => Isometry3::from_parts(
            Translation3::identity(),
            Rotation3::from_axis_angle(&axis, value(robot, &joint.name, hand, q)).into(),
        ),
    };
    pose(robot, &joint.parent.link, hand, q) * origin * motion
}

#[test]
fn links_stand_where_the_joints_of_the_file_put_them() {
    for hand in builtin_hands() {
        let robot = urdf_rs::read_from_string(builtin_texts(&hand.name).unwrap().0).unwrap();
        for k in 1..4 {
            let share = |i: usize| f64::fract(0.618 * (k * (i + 1)) as f64);
            let within = |(i, c): (usize, &crate::hand::Coordinate)| c.lower + share(i) * (c.upper - c.lower);
            let q: Vec<f64> = hand.coordinates.iter().enumerate().map(within).collect();
            for (link, found) in hand.links.iter().zip(hand.base_from_links(&q)) {
                let expected = pose(&robot, &link.name, hand, &q);
                for point in [Vec3::ZERO, Vec3::X, Vec3::Y] {
                    let at = expected * Point3::from(point.to_array());
                    let away = (found.transform_point(point) - Vec3::new(at.x, at.y, at.z)).length();
                    assert!(away < 1e-12, "{}: {} is {away} m away", hand.name, link.name);
                }
            }
        }
    }
}
