//! Tendons as implicit cables: `f = clamp(K (s_ref − s − h ṡ₁) − b ṡ₁, 0, f_max)` with the tendon's speed ṡ₁
//! at the end of the step, predicted from rapier's own reduced inertia, and applied as torques through the
//! springs of the joints. Contact impulses of the last step approximate those of the next.

use super::joints::{Joints, dof};
use palmares_models::hand::{Hand, Tendon};
use palmares_sim::State;
use rapier3d_f64::dynamics::{Multibody, MultibodyJointHandle};
use rapier3d_f64::na::{DMatrix, DVector, Vector6};
use rapier3d_f64::pipeline::PhysicsWorld;

/// Stiffness of the spring that carries a torque if the coordinate has no stiffness, N·m/rad.
const CARRIER: f64 = 1e-6;

/// Generalized impulse of all contacts on the hand in the last step.
pub(super) fn contact_impulses(world: &PhysicsWorld, joint: MultibodyJointHandle) -> DVector<f64> {
    let Some((multibody, _)) = world.multibody_joints.get(joint) else { return DVector::zeros(0) };
    let mut sum = DVector::zeros(multibody.ndofs());
    let hand = world.multibody_joints.rigid_body_link(multibody.root().rigid_body_handle());
    let link_of = |collider| {
        let body = world.colliders.get(collider)?.parent()?;
        let link = world.multibody_joints.rigid_body_link(body)?;
        (Some(link.multibody) == hand.map(|hand| hand.multibody)).then_some(link.id)
    };
    let substeps = world.integration_parameters.num_solver_iterations as f64;
    for pair in world.narrow_phase.contact_pairs() {
        let links = [link_of(pair.collider1), link_of(pair.collider2)];
        if links == [None, None] {
            continue;
        }
        for manifold in pair.manifolds() {
            for contact in &manifold.data.solver_contacts {
                let data = &manifold.points[contact.contact_indices()[0] as usize].data;
                if data.impulse == 0.0 {
                    continue;
                }
                let on_second = manifold.data.normal * data.impulse - data.warmstart_tangent_world * substeps;
                for (link, sign, lever) in
                    [(links[0], -1.0, data.solver_dp1), (links[1], 1.0, data.solver_dp2)]
                {
                    let Some(link) = link else { continue };
                    let force = on_second * sign;
                    let torque = lever.cross(force);
                    let wrench = Vector6::new(force.x, force.y, force.z, torque.x, torque.y, torque.z);
                    sum.gemv_tr(1.0, multibody.body_jacobian(link), &wrench, 1.0);
                }
            }
        }
    }
    sum
}

/// Finds the tensions of the step and loads the joints' springs with them.
pub(super) fn pull(
    joints: &Joints,
    hand: &Hand,
    multibody: &mut Multibody,
    state: &mut State,
    h: f64,
    contact: &DVector<f64>,
) {
    let tensions = foresee(joints, hand, multibody, state, h, contact);
    for (c, coordinate) in hand.coordinates.iter().enumerate() {
        let hinge = &joints.hinges[joints.masters[c]];
        let stiffness = (coordinate.stiffness / (hinge.ratio * hinge.ratio)).max(CARRIER);
        let arms = hand.tendons.iter().zip(&tensions);
        let torque: f64 = arms.map(|(tendon, f)| f * arm(&tendon.moment_arms, c) / hinge.ratio).sum();
        let rest = hinge.ratio * coordinate.rest + hinge.offset;
        if let Some(link) = multibody.link_mut(hinge.link) {
            link.joint.set_spring(hinge.axis, stiffness, rest + torque / stiffness);
        }
    }
    state.tension.copy_from_slice(&tensions);
}

fn arm(moment_arms: &[(usize, f64)], coordinate: usize) -> f64 {
    moment_arms.iter().filter(|(c, _)| *c == coordinate).map(|(_, r)| r).sum()
}

fn foresee(
    joints: &Joints,
    hand: &Hand,
    multibody: &Multibody,
    state: &State,
    h: f64,
    contact: &DVector<f64>,
) -> Vec<f64> {
    let n = multibody.ndofs();
    let couplings = multibody.couplings();
    let (nc, nt) = (couplings.len(), hand.tendons.len());
    if nt == 0 {
        return Vec::new();
    }
    // Columns: rows of the couplings, rows of R, the impulse of all other forces.
    let mut columns = DMatrix::zeros(n, nc + nt + 1);
    for (k, coupling) in couplings.iter().enumerate() {
        let at = |link: usize| multibody.link(link).map_or(0, |link| link.assembly_id());
        columns[(at(coupling.link1), k)] = -coupling.coeff;
        columns[(at(coupling.link2), k)] = 1.0;
    }
    for (k, tendon) in hand.tendons.iter().enumerate() {
        for &(c, r) in &tendon.moment_arms {
            let hinge = &joints.hinges[joints.masters[c]];
            columns[(dof(multibody, hinge), nc + k)] += r / hinge.ratio;
        }
    }
    let velocity = multibody.generalized_velocity().clone_owned();
    let mut impulse = contact.clone();
    for (c, coordinate) in hand.coordinates.iter().enumerate() {
        let hinge = &joints.hinges[joints.masters[c]];
        let (at, square) = (dof(multibody, hinge), hinge.ratio * hinge.ratio);
        let stretch = (joints.coordinate(multibody, c) - coordinate.rest) * hinge.ratio;
        let v = velocity[at];
        impulse[at] -= h * (coordinate.stiffness * (stretch + h * v) + coordinate.damping * v) / square;
    }
    let root = multibody.root().joint;
    for k in 0..joints.base_dofs {
        let (stiffness, rest) = root.spring(k);
        let v = velocity[k];
        impulse[k] -= h * (stiffness * (root.coords()[k] - rest + h * v) + multibody.damping()[k] * v);
    }
    columns.set_column(nc + nt, &impulse);

    let rows = columns.columns(0, nc + nt).into_owned();
    let Some(moved) = multibody.inv_augmented_mass().solve(&columns) else { return vec![0.0; nt] };
    let mut response = rows.tr_mul(&moved);
    let drift = rows.tr_mul(&velocity);
    let mut free = response.column(nc + nt) + drift;
    // Eliminate the couplings, which keep their two hinges together under every load.
    if nc > 0 {
        let within = response.view((0, 0), (nc, nc)).into_owned().lu();
        let to_tendons = response.view((nc, 0), (nt, nc)).into_owned();
        let mut right = response.view((0, nc), (nc, nt + 1)).into_owned();
        right.set_column(nt, &free.rows(0, nc));
        let Some(taken) = within.solve(&right) else { return vec![0.0; nt] };
        let change = to_tendons * taken;
        for i in 0..nt {
            for j in 0..nt {
                response[(nc + i, nc + j)] -= change[(i, j)];
            }
            free[nc + i] -= change[(i, nt)];
        }
    }
    let mut matrix = DMatrix::identity(nt, nt);
    let mut right = DVector::zeros(nt);
    for (i, tendon) in hand.tendons.iter().enumerate() {
        let s: f64 = tendon.moment_arms.iter().map(|&(c, r)| r * joints.coordinate(multibody, c)).sum();
        let error = tendon.wound(&hand.motors, |motor| state.motors[motor].position) - s;
        let implicit = h * tendon.stiffness + tendon.damping;
        for j in 0..nt {
            matrix[(i, j)] += implicit * h * response[(nc + i, nc + j)];
        }
        right[i] = tendon.stiffness * error - implicit * free[nc + i];
    }
    let Some(tensions) = matrix.lu().solve(&right) else { return vec![0.0; nt] };
    let clamped = |(tendon, f): (&Tendon, &f64)| f.clamp(tendon.least_force(), tendon.most_held());
    hand.tendons.iter().zip(tensions.iter()).map(clamped).collect()
}
