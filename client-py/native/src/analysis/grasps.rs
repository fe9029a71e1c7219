//! Functions of contacts, G and J.

use super::arrays::{Answer, Matrix, Part, Seven, answer, matrix, pose, value_error, word};
use super::contacts::{Given, contacts};
use nalgebra::DMatrix;
use palmares_analysis::closure::{PLANAR, force_closure as force, form_closure as form};
use palmares_analysis::contact::Contact;
use palmares_analysis::ellipsoid as shapes;
use palmares_analysis::grasp;
use palmares_analysis::hand::CompliantHand;
use palmares_analysis::linear::{intersection, null_space};
use palmares_analysis::quality::{Norm, QualitySettings, quality as measure};
use palmares_analysis::quasistatic::{ContactStiffness, QuasiStatic};
use pyo3::prelude::*;

fn rows(planar: bool) -> &'static [usize] {
    if planar { &PLANAR } else { &[0, 1, 2, 3, 4, 5] }
}

/// G, and contacts as (n, t, o) rows.
fn g_of(given: &[Given], object: Seven) -> PyResult<(Vec<Contact>, DMatrix<f64>)> {
    let contacts = contacts(given)?;
    let g = grasp::grasp_matrix(&contacts, pose("object", object)?);
    Ok((contacts, g))
}

#[pyfunction]
pub(crate) fn grasp_matrix(py: Python<'_>, contacts: Vec<Given>, object: Seven) -> Answer<'_> {
    g_of(&contacts, object)?.1.part(py)
}

/// The linear behaviour of a hand with soft synergies; its inputs are those of z, each with a tendon that acts.
#[pyfunction]
pub(crate) fn soft_synergies<'py>(
    py: Python<'py>,
    synergies: Matrix<'py>,
    joint_stiffness: Matrix<'py>,
    synergy_stiffness: Matrix<'py>,
) -> Answer<'py> {
    let found = CompliantHand::soft_synergies(
        &matrix("synergies", &synergies)?,
        &matrix("joint_stiffness", &joint_stiffness)?,
        &matrix("synergy_stiffness", &synergy_stiffness)?,
    )
    .map_err(value_error)?;
    answer!(py, found: {compliance, motion, tension, tension_per_torque, winding, acting})
}

/// K_c of contacts: of one number k, or of normal, tangential and spin.
#[pyfunction]
pub(crate) fn contact_stiffness(py: Python<'_>, contacts: Vec<Given>, stiffness: Vec<f64>) -> Answer<'_> {
    let given = match *stiffness.as_slice() {
        [k] => ContactStiffness::Equal(k),
        [normal, tangential, spin] => ContactStiffness::Parts { normal, tangential, spin },
        _ => {
            let wanted = "1 (N/m), 3 (normal, tangential in N/m, spin in N·m/rad), or a c × c matrix";
            return Err(value_error(format!("contact_stiffness: found {stiffness:?}; wanted {wanted}")));
        }
    };
    let contacts = super::contacts::contacts(&contacts)?;
    given.of(&contacts).map_err(value_error)?.part(py)
}

/// `palmares.analysis.LinearHand`, as far as a grasp needs it.
#[derive(FromPyObject)]
pub(crate) struct LinearHand<'py> {
    compliance: Matrix<'py>,
    motion: Matrix<'py>,
    tension: Matrix<'py>,
    tension_per_torque: Matrix<'py>,
    winding: Matrix<'py>,
}

/// Stiffness and maps of a grasp, from its hand, G, J, K_c and K_g.
#[pyfunction]
pub(crate) fn quasistatic<'py>(
    py: Python<'py>,
    hand: LinearHand<'py>,
    g: Matrix<'py>,
    j: Matrix<'py>,
    contact_stiffness: Matrix<'py>,
    object_geometric: Option<Matrix<'py>>,
) -> Answer<'py> {
    let hand = CompliantHand {
        springs: DMatrix::zeros(0, 0),
        r: DMatrix::zeros(0, 0),
        acting: Vec::new(),
        compliance: matrix("compliance", &hand.compliance)?,
        motion: matrix("motion", &hand.motion)?,
        tension: matrix("tension", &hand.tension)?,
        tension_per_torque: matrix("tension_per_torque", &hand.tension_per_torque)?,
        winding: matrix("winding", &hand.winding)?,
        tendon_stiffness: DMatrix::zeros(0, 0),
    };
    let geometric = object_geometric.map(|given| matrix("object_geometric", &given)).transpose()?;
    let (g, j, k) = (matrix("G", &g)?, matrix("J", &j)?, matrix("contact_stiffness", &contact_stiffness)?);
    let found = QuasiStatic::new(&hand, &g, &j, &k, geometric.as_ref()).map_err(value_error)?;
    let (inputs, motions) = found.rigid_motions();
    answer!(
        py,
        found: {
            contact_stiffness, object_stiffness, object_per_input, forces_per_input, joints_per_input,
            tension_per_input, input_stiffness, object_per_wrench, forces_per_wrench, joints_per_wrench, held
        },
        "internal_forces": found.internal_forces().part(py)?,
        "controllable_internal_forces": found.controllable_internal_forces().part(py)?,
        "rigid_inputs": inputs.part(py)?,
        "rigid_motions": motions.part(py)?,
    )
}

#[pyfunction]
pub(crate) fn form_closure(py: Python<'_>, contacts: Vec<Given>, object: Seven, planar: bool) -> Answer<'_> {
    let (contacts, g) = g_of(&contacts, object)?;
    let found = form(&contacts, &g, rows(planar));
    answer!(py, found: {closed, rank, margin, forces})
}

/// Closure with friction, and whether the hand controls all inner forces.
#[pyfunction]
pub(crate) fn force_closure<'py>(
    py: Python<'py>,
    contacts: Vec<Given>,
    object: Seven,
    j: Matrix<'py>,
    planar: bool,
) -> Answer<'py> {
    let (contacts, g) = g_of(&contacts, object)?;
    let j = matrix("J", &j)?;
    let found = force(&contacts, &g, &j, rows(planar));
    let frictional = &found.frictional;
    answer!(
        py,
        frictional: {rank, margin, forces},
        "frictional": frictional.closed,
        "closed": found.closed,
        "uncontrolled": found.uncontrolled.part(py)?,
    )
}

#[pyfunction]
pub(crate) fn quality<'py>(
    py: Python<'py>,
    contacts: Vec<Given>,
    object: Seven,
    norm: &str,
    edges: usize,
    length: f64,
    planar: bool,
) -> Answer<'py> {
    let (contacts, g) = g_of(&contacts, object)?;
    let norm = word("norm", norm, &[("total", Norm::Total), ("each", Norm::Each)])?;
    if !(length > 0.0 && length.is_finite()) || edges < 3 {
        let message =
            format!("found length {length}, edges {edges}; wanted a positive length and at least 3 edges");
        return Err(value_error(message));
    }
    let settings = QualitySettings { norm, edges, length };
    let found = py.detach(|| measure(&contacts, &g, rows(planar), settings)).map_err(value_error)?;
    answer!(py, found: {epsilon, epsilon_bound, weakest, volume})
}

/// The ellipsoid of a matrix, or of the forces that it holds.
#[pyfunction]
pub(crate) fn ellipsoid<'py>(py: Python<'py>, map: Matrix<'py>, of_forces: bool) -> Answer<'py> {
    let map = matrix("map", &map)?;
    let found = if of_forces { shapes::force_ellipsoid(&map) } else { shapes::ellipsoid(&map) };
    answer!(py, found: {radii, axes, inputs, manipulability, isotropy})
}

/// Bases of the null spaces of G, Gᵀ, J and Jᵀ, and of N(G) ∩ N(Jᵀ): a grasp is graspable, indeterminate, redundant, defective or
/// hyperstatic if its space is not empty.
#[pyfunction]
pub(crate) fn spaces<'py>(py: Python<'py>, g: Matrix<'py>, j: Matrix<'py>) -> Answer<'py> {
    let (g, j) = (matrix("G", &g)?, matrix("J", &j)?);
    if g.ncols() != j.nrows() {
        let message = format!("G has {} columns, J {} rows; wanted as many", g.ncols(), j.nrows());
        return Err(value_error(message));
    }
    let (graspable, defective) = (null_space(&g), null_space(&j.transpose()));
    answer!(
        py,
        "hyperstatic": intersection(&graspable, &defective).part(py)?,
        "graspable": graspable.part(py)?,
        "defective": defective.part(py)?,
        "indeterminate": null_space(&g.transpose()).part(py)?,
        "redundant": null_space(&j).part(py)?,
    )
}
