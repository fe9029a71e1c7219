//! Forward kinematics: poses, joint screws and velocities of the hand's links.

use super::spatial::SpatialVelocity;
use palmares_models::hand::{Hand, Hinge, HingeKind};
use palmares_models::{Mat3, Pose, Rotation, Vec3};

/// Quantities that follow from the hand's configuration; rebuilt in every step.
#[derive(Clone, Debug, Default)]
pub struct Kinematics {
    /// World pose of every link.
    pub pose: Vec<Pose>,
    /// Rotation of `pose` as a matrix.
    pub rotation: Vec<Mat3>,
    /// Origin of all spatial quantities: the base origin in the world, m.
    pub origin: Vec3,
    /// Screw of every link's joint per unit of its coordinate; unused for the base.
    pub screw: Vec<SpatialVelocity>,
    /// The part of `screw` that belongs to the first of two hinges; zero for plain joints.
    pub first_screw: Vec<SpatialVelocity>,
}

/// Quaternion of a turn by `angle` about a unit axis. libm, so that every machine gives the same bits.
#[inline]
fn turn(axis: Vec3, (sin, cos): (f64, f64)) -> Rotation {
    Rotation::from_xyzw(axis.x * sin, axis.y * sin, axis.z * sin, cos)
}

impl Kinematics {
    /// Poses and screws at base pose `world_from_base` and coordinates `q`.
    pub fn update(&mut self, hand: &Hand, world_from_base: Pose, q: &[f64]) {
        let n = hand.links.len();
        self.pose.resize(n, Pose::IDENTITY);
        self.rotation.resize(n, Mat3::IDENTITY);
        self.screw.resize(n, SpatialVelocity::ZERO);
        self.first_screw.resize(n, SpatialVelocity::ZERO);
        self.origin = world_from_base.translation;
        self.pose[0] = world_from_base;
        self.rotation[0] = Mat3::from_quat(world_from_base.rotation);
        self.update_joints(hand, q);
    }

    /// The same for an unmoved base.
    pub fn update_joints(&mut self, hand: &Hand, q: &[f64]) {
        for (i, link) in hand.links.iter().enumerate().skip(1) {
            let (Some(parent), Some(joint)) = (link.parent, &link.joint) else { continue };
            let mut pose = self.pose[parent];
            let mut screw = SpatialVelocity::ZERO;
            self.first_screw[i] = SpatialVelocity::ZERO;
            // The two hinges of a rolling joint turn by the same angle: one sine serves both.
            let mut known: Option<(f64, (f64, f64))> = None;
            for (k, hinge) in joint.hinges.iter().enumerate() {
                if k == 1 {
                    self.first_screw[i] = screw;
                }
                let fixed = &hinge.parent_from_hinge;
                pose.translation += pose.rotation * fixed.translation;
                // Many hinges are parallel to the one before.
                if fixed.rotation != Rotation::IDENTITY {
                    pose.rotation *= fixed.rotation;
                }
                let x = hinge.ratio * q[joint.coordinate] + hinge.offset;
                let axis = pose.rotation * hinge.axis;
                screw += hinge_screw(hinge, axis, pose.translation - self.origin);
                match hinge.kind {
                    HingeKind::Revolute => {
                        let half = match known {
                            Some((angle, half)) if angle == x => half,
                            _ => libm::sincos(0.5 * x),
                        };
                        known = Some((x, half));
                        pose.rotation *= turn(hinge.axis, half);
                    }
                    HingeKind::Prismatic => pose.translation += axis * x,
                }
            }
            self.pose[i] = pose;
            self.rotation[i] = Mat3::from_quat(pose.rotation);
            self.screw[i] = screw;
        }
    }

    /// Spatial velocity of every link at generalized velocity `v`.
    pub fn velocities(&self, hand: &Hand, v: &[f64], out: &mut Vec<SpatialVelocity>) {
        out.resize(hand.links.len(), SpatialVelocity::ZERO);
        out[0] =
            SpatialVelocity { angular: Vec3::new(v[3], v[4], v[5]), linear: Vec3::new(v[0], v[1], v[2]) };
        for (i, link) in hand.links.iter().enumerate().skip(1) {
            if let (Some(parent), Some(joint)) = (link.parent, &link.joint) {
                out[i] = out[parent] + self.screw[i] * v[6 + joint.coordinate];
            }
        }
    }
}

/// Spatial velocity per unit of the coordinate, about the base origin; `at` is the hinge's position from there.
#[inline]
fn hinge_screw(hinge: &Hinge, axis: Vec3, at: Vec3) -> SpatialVelocity {
    match hinge.kind {
        HingeKind::Revolute => SpatialVelocity { angular: axis, linear: at.cross(axis) } * hinge.ratio,
        HingeKind::Prismatic => SpatialVelocity { angular: Vec3::ZERO, linear: axis } * hinge.ratio,
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The recursion with shared sines against the plain product of poses that describes a hand.
    #[test]
    fn poses_are_those_of_the_hand_and_screws_their_derivatives() {
        let hand = Hand::builtin("softhand").expect("it is built in");
        let q: Vec<f64> = (0..hand.coordinates.len()).map(|i| 0.1 + 0.03 * i as f64).collect();
        let mut kin = Kinematics::default();
        kin.update(&hand, Pose::IDENTITY, &q);
        for (ours, plain) in kin.pose.iter().zip(hand.base_from_links(&q)) {
            assert!((ours.translation - plain.translation).length() < 1e-14);
            assert!(ours.rotation.dot(plain.rotation).abs() > 1.0 - 1e-14);
        }
        let step = 1e-6;
        for (i, link) in hand.links.iter().enumerate().skip(1) {
            let joint = link.joint.as_ref().expect("every link but the base moves");
            let (mut more, mut less) = (q.clone(), q.clone());
            more[joint.coordinate] += step;
            less[joint.coordinate] -= step;
            let origin = |q: &[f64]| hand.base_from_links(q)[i].translation;
            let numeric = (origin(&more) - origin(&less)) / (2.0 * step);
            let exact = kin.screw[i].at(kin.pose[i].translation);
            assert!((numeric - exact).length() < 1e-9, "{}: {numeric} {exact}", link.name);
        }
    }
}
