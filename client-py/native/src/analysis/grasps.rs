//! Functions of contacts, G and J.

use super::arrays::{Matrix, Seven, array, matrix, pose, value_error, vector};
use super::contacts::{Given, contacts};
use nalgebra::DMatrix;
use numpy::PyArray2;
use palmares_analysis::closure::{Closure, PLANAR, force_closure as force, form_closure as form};
use palmares_analysis::ellipsoid as shapes;
use palmares_analysis::grasp;
use palmares_analysis::hand::CompliantHand;
use palmares_analysis::linear::{intersection, null_space};
use palmares_analysis::quality::{Norm, QualitySettings, quality as measure};
use palmares_analysis::quasistatic::{ContactStiffness, QuasiStatic};
use pyo3::prelude::*;
use pyo3::types::PyDict;

const SPATIAL: [usize; 6] = [0, 1, 2, 3, 4, 5];

fn rows(planar: bool) -> &'static [usize] {
    if planar { &PLANAR } else { &SPATIAL }
}

/// G, and contacts as (n, t, o) rows.
fn g_of(
    given: &[Given],
    object: Seven,
) -> PyResult<(Vec<palmares_analysis::contact::Contact>, DMatrix<f64>)> {
    let contacts = contacts(given)?;
    let g = grasp::grasp_matrix(&contacts, pose("object", object)?);
    Ok((contacts, g))
}

#[pyfunction]
pub(crate) fn grasp_matrix<'py>(
    py: Python<'py>,
    contacts: Vec<Given>,
    object: Seven,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    array(py, &g_of(&contacts, object)?.1)
}

/// The linear behaviour of a hand with soft synergies: compliance, motion, tension per torque.
#[pyfunction]
pub(crate) fn soft_synergies<'py>(
    py: Python<'py>,
    synergies: Matrix<'py>,
    joint_stiffness: Matrix<'py>,
    synergy_stiffness: Matrix<'py>,
) -> PyResult<Bound<'py, PyDict>> {
    let found = CompliantHand::soft_synergies(
        &matrix("synergies", &synergies)?,
        &matrix("joint_stiffness", &joint_stiffness)?,
        &matrix("synergy_stiffness", &synergy_stiffness)?,
    )
    .map_err(value_error)?;
    let told = PyDict::new(py);
    told.set_item("compliance", array(py, &found.compliance)?)?;
    told.set_item("motion", array(py, &found.motion)?)?;
    told.set_item("tension", array(py, &found.tension)?)?;
    told.set_item("tension_per_torque", array(py, &found.tension_per_torque)?)?;
    told.set_item("winding", array(py, &found.winding)?)?;
    Ok(told)
}

/// K_c of contacts: of one number k, or of normal, tangential and spin.
#[pyfunction]
pub(crate) fn contact_stiffness<'py>(
    py: Python<'py>,
    contacts: Vec<Given>,
    stiffness: Vec<f64>,
) -> PyResult<Bound<'py, PyArray2<f64>>> {
    let given = match *stiffness.as_slice() {
        [k] => ContactStiffness::Equal(k),
        [normal, tangential, spin] => ContactStiffness::Parts { normal, tangential, spin },
        _ => {
            let wanted = "1 (N/m), 3 (normal, tangential in N/m, spin in N·m/rad), or a c × c matrix";
            return Err(value_error(format!("contact_stiffness: found {stiffness:?}; wanted {wanted}")));
        }
    };
    let contacts = super::contacts::contacts(&contacts)?;
    array(py, &given.of(&contacts).map_err(value_error)?)
}

/// Stiffness and maps of a grasp, from the five matrices of its hand, G, J, K_c and K_g.
#[pyfunction]
#[allow(clippy::too_many_arguments)]
pub(crate) fn quasistatic<'py>(
    py: Python<'py>,
    compliance: Matrix<'py>,
    motion: Matrix<'py>,
    tension: Matrix<'py>,
    tension_per_torque: Matrix<'py>,
    winding: Matrix<'py>,
    g: Matrix<'py>,
    j: Matrix<'py>,
    contact_stiffness: Matrix<'py>,
    object_geometric: Option<Matrix<'py>>,
) -> PyResult<Bound<'py, PyDict>> {
    let hand = CompliantHand {
        springs: DMatrix::zeros(0, 0),
        r: DMatrix::zeros(0, 0),
        acting: Vec::new(),
        compliance: matrix("compliance", &compliance)?,
        motion: matrix("motion", &motion)?,
        tension: matrix("tension", &tension)?,
        tension_per_torque: matrix("tension_per_torque", &tension_per_torque)?,
        winding: matrix("winding", &winding)?,
        tendon_stiffness: DMatrix::zeros(0, 0),
    };
    let geometric = object_geometric.map(|given| matrix("object_geometric", &given)).transpose()?;
    let found = QuasiStatic::new(
        &hand,
        &matrix("G", &g)?,
        &matrix("J", &j)?,
        &matrix("contact_stiffness", &contact_stiffness)?,
        geometric.as_ref(),
    )
    .map_err(value_error)?;
    let told = PyDict::new(py);
    for (name, matrix) in [
        ("contact_stiffness", &found.contact_stiffness),
        ("object_stiffness", &found.object_stiffness),
        ("object_per_input", &found.object_per_input),
        ("forces_per_input", &found.forces_per_input),
        ("joints_per_input", &found.joints_per_input),
        ("tension_per_input", &found.tension_per_input),
        ("input_stiffness", &found.input_stiffness),
        ("object_per_wrench", &found.object_per_wrench),
        ("forces_per_wrench", &found.forces_per_wrench),
        ("joints_per_wrench", &found.joints_per_wrench),
        ("internal_forces", &found.internal_forces()),
        ("controllable_internal_forces", &found.controllable_internal_forces()),
    ] {
        told.set_item(name, array(py, matrix)?)?;
    }
    let (inputs, motions) = found.rigid_motions();
    told.set_item("rigid_inputs", array(py, &inputs)?)?;
    told.set_item("rigid_motions", array(py, &motions)?)?;
    told.set_item("held", found.held)?;
    Ok(told)
}

fn closure<'py>(py: Python<'py>, found: &Closure) -> PyResult<Bound<'py, PyDict>> {
    let told = PyDict::new(py);
    told.set_item("closed", found.closed)?;
    told.set_item("rank", found.rank)?;
    told.set_item("margin", found.margin)?;
    told.set_item("forces", vector(py, &found.forces))?;
    Ok(told)
}

#[pyfunction]
pub(crate) fn form_closure<'py>(
    py: Python<'py>,
    contacts: Vec<Given>,
    object: Seven,
    planar: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let (contacts, g) = g_of(&contacts, object)?;
    closure(py, &form(&contacts, &g, rows(planar)))
}

/// Closure with friction; for a J, also whether the hand controls all inner forces.
#[pyfunction]
pub(crate) fn force_closure<'py>(
    py: Python<'py>,
    contacts: Vec<Given>,
    object: Seven,
    j: Option<Matrix<'py>>,
    planar: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let (contacts, g) = g_of(&contacts, object)?;
    let j = match j {
        Some(j) => matrix("J", &j)?,
        // Without a hand, every contact force is controlled.
        None => DMatrix::identity(g.ncols(), g.ncols()),
    };
    let found = force(&contacts, &g, &j, rows(planar));
    let told = closure(py, &found.frictional)?;
    told.set_item("frictional", found.frictional.closed)?;
    told.set_item("closed", found.closed)?;
    told.set_item("uncontrolled", array(py, &found.uncontrolled)?)?;
    Ok(told)
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
) -> PyResult<Bound<'py, PyDict>> {
    let (contacts, g) = g_of(&contacts, object)?;
    let norm = match norm {
        "total" => Norm::Total,
        "each" => Norm::Each,
        _ => return Err(value_error(format!("norm: found {norm:?}; wanted \"total\" or \"each\""))),
    };
    if !(length > 0.0 && length.is_finite()) || edges < 3 {
        let message =
            format!("found length {length}, edges {edges}; wanted a positive length and at least 3 edges");
        return Err(value_error(message));
    }
    let settings = QualitySettings { norm, edges, length };
    let found = py.detach(|| measure(&contacts, &g, rows(planar), settings)).map_err(value_error)?;
    let told = PyDict::new(py);
    told.set_item("epsilon", found.epsilon)?;
    told.set_item("epsilon_bound", found.epsilon_bound)?;
    told.set_item("weakest", vector(py, &found.weakest))?;
    told.set_item("volume", found.volume)?;
    Ok(told)
}

/// The ellipsoid of a matrix, or of the forces that it holds.
#[pyfunction]
pub(crate) fn ellipsoid<'py>(
    py: Python<'py>,
    map: Matrix<'py>,
    of_forces: bool,
) -> PyResult<Bound<'py, PyDict>> {
    let map = matrix("map", &map)?;
    let found = if of_forces { shapes::force_ellipsoid(&map) } else { shapes::ellipsoid(&map) };
    let told = PyDict::new(py);
    told.set_item("radii", vector(py, &found.radii))?;
    told.set_item("axes", array(py, &found.axes)?)?;
    told.set_item("inputs", array(py, &found.inputs)?)?;
    told.set_item("manipulability", found.manipulability)?;
    told.set_item("isotropy", found.isotropy)?;
    Ok(told)
}

/// Bases of the null spaces of G, Gᵀ, J and Jᵀ, and of N(G) ∩ N(Jᵀ): a grasp is graspable, indeterminate, redundant, defective or
/// hyperstatic if its space is not empty.
#[pyfunction]
pub(crate) fn spaces<'py>(py: Python<'py>, g: Matrix<'py>, j: Matrix<'py>) -> PyResult<Bound<'py, PyDict>> {
    let (g, j) = (matrix("G", &g)?, matrix("J", &j)?);
    if g.ncols() != j.nrows() {
        let message = format!("G has {} columns, J {} rows; wanted as many", g.ncols(), j.nrows());
        return Err(value_error(message));
    }
    let (graspable, defective) = (null_space(&g), null_space(&j.transpose()));
    let told = PyDict::new(py);
    told.set_item("hyperstatic", array(py, &intersection(&graspable, &defective))?)?;
    told.set_item("graspable", array(py, &graspable)?)?;
    told.set_item("defective", array(py, &defective)?)?;
    told.set_item("indeterminate", array(py, &null_space(&g.transpose()))?)?;
    told.set_item("redundant", array(py, &null_space(&j))?)?;
    Ok(told)
}
