//! The hand as a multibody: a floating root, one joint per hinge.

use super::joints::{HingeDof, Joints, dof};
use super::tendon;
use anyhow::{Context, Result};
use palmares_models::hand::{Hand, Hinge, HingeKind};
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::actuation::base::{self, shortest_turn};
use palmares_sim::actuation::motor;
use palmares_sim::{BaseCommand, Command, Model, State};
use rapier3d_f64::dynamics::{
    GenericJointBuilder, JointAxesMask, JointAxis, MassProperties, Multibody, MultibodyDofCoupling,
    MultibodyJointHandle, RigidBodyBuilder, RigidBodyHandle,
};
use rapier3d_f64::pipeline::PhysicsWorld;
use std::sync::Arc;

/// Mass and inertia of the coupler between the two hinges of a rolling joint; the model's has none.
const COUPLER_KG: f64 = 1e-4;
const COUPLER_KGM2: f64 = 1e-9;

/// The hand's bodies and joints in rapier.
pub(super) struct HandBody {
    joint: MultibodyJointHandle,
    bodies: Vec<RigidBodyHandle>,
    joints: Joints,
    hand: Arc<Hand>,
}

impl HandBody {
    pub(super) fn build(
        world: &mut PhysicsWorld,
        hand: &Arc<Hand>,
        state: &State,
        bolted: bool,
    ) -> Result<Self> {
        let coupler = MassProperties::new(Vec3::ZERO, COUPLER_KG, Vec3::splat(COUPLER_KGM2));
        let weight = if hand.gravity_compensation { 0.0 } else { 1.0 };
        let dynamic = |mass: MassProperties| {
            RigidBodyBuilder::dynamic()
                .pose(state.base)
                .additional_mass_properties(mass)
                .gravity_scale(weight)
                .can_sleep(false)
        };
        let mut bodies: Vec<RigidBodyHandle> = Vec::new();
        let mut hinges = Vec::new();
        let mut last = None;
        for link in &hand.links {
            let inertia = &link.inertia;
            let mass = MassProperties::with_inertia_matrix(inertia.com, inertia.mass, inertia.about_com);
            let (Some(parent), Some(joint)) = (link.parent, &link.joint) else {
                let body = if bolted { RigidBodyBuilder::fixed().pose(state.base) } else { dynamic(mass) };
                bodies.push(world.insert_body(body));
                continue;
            };
            let mut before = bodies[parent];
            for (k, hinge) in joint.hinges.iter().enumerate() {
                let outermost = k + 1 == joint.hinges.len();
                let body = world.insert_body(dynamic(if outermost { mass } else { coupler }));
                let (data, axis) = joint_data(hinge);
                last = world.multibody_joints.insert(before, body, data, true);
                let (_, id) = last.and_then(|handle| world.multibody_joints.get(handle)).context("joint")?;
                let (coordinate, ratio, offset) = (joint.coordinate, hinge.ratio, hinge.offset);
                hinges.push(HingeDof { link: id, axis, coordinate, ratio, offset });
                before = body;
            }
            bodies.push(before);
        }
        let masters = (0..hand.coordinates.len())
            .map(|c| hinges.iter().position(|h| h.coordinate == c && h.ratio != 0.0))
            .collect::<Option<Vec<usize>>>()
            .context("a coordinate moves no hinge")?;
        let joint = last.context("the hand has no joints")?;
        let base_dofs = if bolted { 0 } else { 6 };
        let body =
            HandBody { joint, bodies, joints: Joints { hinges, masters, base_dofs }, hand: Arc::clone(hand) };
        body.equip(world.multibody_joints.get_mut(joint).context("the hand's multibody")?.0);
        Ok(body)
    }

    /// Springs, dampers, limits and couplings.
    fn equip(&self, multibody: &mut Multibody) {
        multibody.set_self_contacts_enabled(true);
        multibody.damping_mut().fill(0.0);
        multibody.armature_mut().fill(0.0);
        for (c, coordinate) in self.hand.coordinates.iter().enumerate() {
            let master = &self.joints.hinges[self.joints.masters[c]];
            let dof = dof(multibody, master);
            let r = master.ratio;
            multibody.damping_mut()[dof] = coordinate.damping / (r * r);
            let ends = [r * coordinate.lower + master.offset, r * coordinate.upper + master.offset];
            if let Some(link) = multibody.link_mut(master.link).filter(|_| ends.iter().all(|x| x.is_finite()))
            {
                let limits = [ends[0].min(ends[1]), ends[0].max(ends[1])];
                link.joint.data.set_limits(AXES[master.axis], limits);
            }
        }
        for (i, hinge) in self.joints.hinges.iter().enumerate() {
            let master = &self.joints.hinges[self.joints.masters[hinge.coordinate]];
            if i != self.joints.masters[hinge.coordinate] {
                let coeff = hinge.ratio / master.ratio;
                multibody.add_dof_coupling(MultibodyDofCoupling {
                    link1: master.link,
                    dof1: 0,
                    axis1: master.axis,
                    link2: hinge.link,
                    dof2: 0,
                    axis2: hinge.axis,
                    coeff,
                    offset: hinge.offset - coeff * master.offset,
                });
            }
        }
    }

    /// Body of a link of the model.
    pub(super) fn body(&self, link: usize) -> RigidBodyHandle {
        self.bodies[link]
    }

    /// Set points, servo and tendons for the next step.
    pub(super) fn actuate(
        &self,
        world: &mut PhysicsWorld,
        model: &Model,
        state: &mut State,
        command: &Command,
    ) {
        let config = model.config();
        base::advance(config, state.base, &mut state.reference, &command.base);
        for (i, motor) in self.hand.motors.iter().enumerate() {
            let sigma = command.sigma.get(i).copied().unwrap_or(state.motors[i].command);
            motor::advance(motor, &mut state.motors[i], sigma, config.step_s, |change| change);
        }
        // A force stays until it is taken away.
        for link in &self.bodies {
            if let Some(body) = world.bodies.get_mut(*link) {
                body.reset_forces(true);
                body.reset_torques(true);
            }
        }
        for push in &command.pushes {
            if let Some(body) = world.bodies.get_mut(self.bodies[push.link]) {
                let at = body.position().transform_point(push.point);
                body.add_force_at_point(push.force, at, true);
            }
        }
        if self.joints.base_dofs > 0 {
            self.servo(world, model, state, command.base == BaseCommand::Free);
        }
        let contact = tendon::contact_impulses(world, self.joint);
        let Some((multibody, _)) = world.multibody_joints.get_mut(self.joint) else { return };
        tendon::pull(&self.joints, &self.hand, multibody, state, config.step_s, &contact);
    }

    /// The base servo as springs and dampers of the root's free joint, implicit like those of ours; without them it is off.
    fn servo(&self, world: &mut PhysicsWorld, model: &Model, state: &State, off: bool) {
        let servo = &model.config().base;
        let Some((multibody, _)) = world.multibody_joints.get_mut(self.joint) else { return };
        let pose = *multibody.root().local_to_world();
        let to = &state.reference;
        let offset = (to.pose.translation - pose.translation).to_array();
        let turn = shortest_turn(pose.rotation, to.pose.rotation).to_array();
        let rows = [
            (0, offset, to.linear.to_array(), servo.stiffness, servo.damping, servo.force_limit),
            (
                3,
                turn,
                to.angular.to_array(),
                servo.angular_stiffness,
                servo.angular_damping,
                servo.torque_limit,
            ),
        ];
        for (first, error, rate, stiffness, damping, limit) in rows {
            for k in 0..3 {
                let joint = &mut multibody.root_mut().joint;
                let at = joint.coords()[first + k];
                if off || stiffness == 0.0 {
                    joint.set_spring(first + k, 0.0, at);
                    multibody.damping_mut()[first + k] = 0.0;
                    continue;
                }
                let ahead =
                    (error[k] + damping / stiffness * rate[k]).clamp(-limit / stiffness, limit / stiffness);
                joint.set_spring(first + k, stiffness, at + ahead);
                multibody.damping_mut()[first + k] = damping;
            }
        }
    }

    /// Pose and velocities from the state.
    pub(super) fn push(&self, world: &mut PhysicsWorld, state: &State) {
        if let Some(root) = world.bodies.get_mut(self.bodies[0]) {
            root.set_position(state.base, true);
        }
        let Some((multibody, _)) = world.multibody_joints.get_mut(self.joint) else { return };
        // The root's joint takes the body's pose and has its six degrees of freedom from here on.
        multibody.forward_kinematics(&world.bodies, true);
        let mut change = vec![0.0; multibody.ndofs()];
        for hinge in &self.joints.hinges {
            let x = hinge.ratio * state.q[hinge.coordinate] + hinge.offset;
            let joint = multibody.link(hinge.link).map_or(0.0, |link| link.joint.coords()[hinge.axis]);
            change[dof(multibody, hinge)] = x - joint;
        }
        multibody.apply_displacements(&change);
        let mut velocity = vec![0.0; multibody.ndofs()];
        velocity[..self.joints.base_dofs].copy_from_slice(&state.v[..self.joints.base_dofs]);
        for hinge in &self.joints.hinges {
            velocity[dof(multibody, hinge)] = hinge.ratio * state.v[6 + hinge.coordinate];
        }
        multibody.generalized_velocity_mut().copy_from_slice(&velocity);
        multibody.forward_kinematics(&world.bodies, false);
        multibody.update_rigid_bodies(&mut world.bodies, true);
    }

    /// Pose and velocities from rapier into the state.
    pub(super) fn pull(&self, world: &PhysicsWorld, state: &mut State) {
        let Some((multibody, _)) = world.multibody_joints.get(self.joint) else { return };
        state.base = *multibody.root().local_to_world();
        let velocity = multibody.generalized_velocity();
        state.v[..self.joints.base_dofs].copy_from_slice(&velocity.as_slice()[..self.joints.base_dofs]);
        for (c, &master) in self.joints.masters.iter().enumerate() {
            let hinge = &self.joints.hinges[master];
            state.q[c] = self.joints.coordinate(multibody, c);
            state.v[6 + c] = velocity[dof(multibody, hinge)] / hinge.ratio;
        }
    }
}

const AXES: [JointAxis; 6] =
    [JointAxis::LinX, JointAxis::LinY, JointAxis::LinZ, JointAxis::AngX, JointAxis::AngY, JointAxis::AngZ];

/// A joint that turns about, or slides along, its own x axis; and which axis that is.
fn joint_data(hinge: &Hinge) -> (rapier3d_f64::dynamics::GenericJoint, usize) {
    let align = Pose::from_rotation(Rotation::from_rotation_arc(Vec3::X, hinge.axis));
    let (locked, axis) = match hinge.kind {
        HingeKind::Revolute => (JointAxesMask::LOCKED_REVOLUTE_AXES, 3),
        HingeKind::Prismatic => (JointAxesMask::LOCKED_PRISMATIC_AXES, 0),
    };
    let data = GenericJointBuilder::new(locked)
        .local_frame1(hinge.parent_from_hinge * align)
        .local_frame2(align)
        .contacts_enabled(false)
        .build();
    (data, axis)
}
