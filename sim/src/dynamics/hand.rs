//! Kinematics, mass matrix and bias of the hand at one configuration: `M(q) v̇ + c(q, v) = τ`.

use super::crba::Inertias;
use super::jacobian::add_point_force;
use super::rnea::Recursion;
use super::tree::Kinematics;
use crate::command::Push;
use crate::model::Model;
use palmares_models::Pose;

/// Result of the last [`HandDynamics::update`].
#[derive(Default)]
pub(crate) struct HandDynamics {
    pub kin: Kinematics,
    inertias: Inertias,
    pub recursion: Recursion,
    /// M, row-major; rows and columns of the base come first.
    pub mass: Vec<f64>,
    /// c: Coriolis, centrifugal and gravity forces, less external forces.
    pub bias: Vec<f64>,
}

impl HandDynamics {
    /// Computes everything at a configuration; only the joints' part of M if the base is `bolted`.
    pub(crate) fn update(&mut self, model: &Model, bolted: bool, base: Pose, q: &[f64], v: &[f64]) {
        let Some(hand) = model.hand() else { return };
        let n = model.hand_dofs();
        let HandDynamics { kin, inertias, recursion, mass, bias } = self;
        mass.resize(n * n, 0.0);
        bias.resize(n, 0.0);
        if bolted {
            kin.update_joints(hand, q);
            inertias.update(hand, kin, 1);
            inertias.joint_matrix(hand, kin, mass);
        } else {
            kin.update(hand, base, q);
            inertias.update(hand, kin, 0);
            inertias.mass_matrix(hand, kin, mass);
        }
        recursion.bias(hand, kin, inertias, &v[..n], model.config().gravity, bias);
    }

    /// Adds external forces to the bias.
    pub(crate) fn add_pushes(&mut self, model: &Model, pushes: &[Push]) {
        let Some(hand) = model.hand() else { return };
        for push in pushes {
            let point = self.kin.pose[push.link].transform_point(push.point);
            add_point_force(hand, &self.kin, push.link, point, push.force, -1.0, &mut self.bias);
        }
    }
}
