//! State, mechanics and contacts of a run as arrays.

use crate::analysis::arrays::value_error;
use numpy::{PyArray1, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use palmares_analysis::hand::moment_arms;
use palmares_analysis::mechanics::Mechanics;
use palmares_models::hand::Hand;
use palmares_models::{Pose, Vec3};
use palmares_sim::Owner;
use palmares_tasks::Run;
use palmares_tasks::observation::BodyState;
use palmares_tasks::run::Placement;
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::iter::repeat_n;

/// An array of numbers that a run has.
pub(crate) struct Quantity {
    pub(crate) name: &'static str,
    /// Shape in one run, with a number of objects.
    shape: fn(&Hand, usize) -> Vec<usize>,
    write: fn(&Run, &Mechanics, &mut Vec<f64>),
}

/// The state, as `set_state` takes it, and the tensions.
pub(crate) const STATE: [Quantity; 6] = [
    Quantity {
        name: "base",
        shape: |_, _| vec![13],
        write: |run, _, row| row.extend(thirteen(&run.base_state())),
    },
    Quantity {
        name: "q",
        shape: |hand, _| vec![hand.coordinates.len()],
        write: |run, _, row| row.extend_from_slice(&run.world().state().q),
    },
    Quantity {
        name: "joint_velocity",
        shape: |hand, _| vec![hand.coordinates.len()],
        write: |run, _, row| {
            row.extend_from_slice(&run.world().state().v[6..run.world().model().hand_dofs()])
        },
    },
    Quantity {
        name: "motors",
        shape: |hand, _| vec![hand.motors.len(), 2],
        write: |run, _, row| row.extend(run.motor_motion().into_iter().flatten()),
    },
    Quantity {
        name: "objects",
        shape: |_, objects| vec![objects, 13],
        write: |run, _, row| row.extend(run.object_states().flat_map(|object| thirteen(&object))),
    },
    Quantity {
        name: "tension",
        shape: |hand, _| vec![hand.tendons.len()],
        write: |run, _, row| row.extend_from_slice(&run.world().state().tension),
    },
];

/// Quantities that follow from the state.
pub(crate) const MECHANICS: [Quantity; 8] = [
    Quantity {
        name: "links",
        shape: |hand, _| vec![hand.links.len(), 7],
        write: |_, now, row| row.extend(now.links().iter().flat_map(seven)),
    },
    Quantity {
        name: "link_velocities",
        shape: |hand, _| vec![hand.links.len(), 6],
        write: |_, now, row| {
            for (link, pose) in now.links().iter().enumerate() {
                let (linear, angular) = now.velocity(link, pose.translation);
                row.extend(linear.to_array());
                row.extend(angular.to_array());
            }
        },
    },
    Quantity {
        name: "jacobians",
        shape: |hand, _| vec![hand.links.len(), 6, dofs(hand)],
        write: |run, now, row| {
            for (link, pose) in now.links().iter().enumerate() {
                add_jacobian(run, now, link, pose.translation, row);
            }
        },
    },
    Quantity {
        name: "fingertips",
        shape: |hand, _| vec![hand.fingers().len(), 7],
        write: |run, now, row| {
            row.extend(fingertips(run.hand()).into_iter().flat_map(|link| seven(&now.links()[link])));
        },
    },
    Quantity {
        name: "fingertip_jacobians",
        shape: |hand, _| vec![hand.fingers().len(), 6, dofs(hand)],
        write: |run, now, row| {
            for link in fingertips(run.hand()) {
                add_jacobian(run, now, link, now.links()[link].translation, row);
            }
        },
    },
    Quantity {
        name: "mass_matrix",
        shape: |hand, _| vec![dofs(hand), dofs(hand)],
        write: |_, now, row| row.extend_from_slice(now.mass_matrix()),
    },
    Quantity {
        name: "bias",
        shape: |hand, _| vec![dofs(hand)],
        write: |_, now, row| row.extend_from_slice(now.bias()),
    },
    Quantity {
        name: "moment_arms",
        shape: |hand, _| vec![hand.tendons.len(), hand.coordinates.len()],
        write: |run, _, row| {
            row.extend(moment_arms(run.hand(), &run.world().state().q).transpose().as_slice());
        },
    },
];

/// Velocities of a hand.
fn dofs(hand: &Hand) -> usize {
    6 + hand.coordinates.len()
}

/// The last link of each finger.
pub(crate) fn fingertips(hand: &Hand) -> Vec<usize> {
    hand.fingers().iter().filter_map(|finger| finger.links.last().copied()).collect()
}

fn add_jacobian(run: &Run, now: &Mechanics, link: usize, point: Vec3, row: &mut Vec<f64>) {
    let first = row.len();
    row.resize(first + 6 * dofs(run.hand()), 0.0);
    now.add_jacobian(run.hand(), link, point, &mut row[first..]);
}

fn seven(pose: &Pose) -> [f64; 7] {
    let ([x, y, z], [a, b, c, d]) = (pose.translation.to_array(), pose.rotation.to_array());
    [x, y, z, a, b, c, d]
}

fn thirteen(body: &BodyState) -> [f64; 13] {
    let BodyState { position, quat_xyzw, linear, angular } = body;
    let mut all = [0.0; 13];
    for (to, from) in all.iter_mut().zip(position.iter().chain(quat_xyzw).chain(linear).chain(angular)) {
        *to = *from;
    }
    all
}

/// The quantities of these names.
pub(crate) fn named(names: &[String]) -> PyResult<Vec<&'static Quantity>> {
    let known = || STATE.iter().chain(&MECHANICS);
    let find = |name: &String| {
        known().find(|quantity| quantity.name == *name).ok_or_else(|| {
            let wanted = known().map(|quantity| quantity.name).collect::<Vec<_>>().join(", ");
            value_error(format!("found {name:?}; wanted one of {wanted}"))
        })
    };
    names.iter().map(find).collect()
}

/// The numbers of a run, one quantity after the other; rows of objects that it lacks of `objects` are zeros.
pub(crate) fn row(
    quantities: &[&Quantity],
    run: &Run,
    mechanics: &mut Mechanics,
    objects: usize,
    row: &mut Vec<f64>,
) {
    row.clear();
    if quantities.iter().any(|quantity| MECHANICS.iter().any(|other| other.name == quantity.name)) {
        mechanics.update(run.world());
    }
    for quantity in quantities {
        let len: usize = (quantity.shape)(run.hand(), objects).iter().product();
        let end = row.len() + len;
        (quantity.write)(run, mechanics, row);
        row.extend(repeat_n(0.0, end.saturating_sub(row.len())));
    }
}

/// A dictionary of arrays from rows as [`row`] writes them; `lead` is the shape before that of each quantity.
pub(crate) fn arrays<'py>(
    py: Python<'py>,
    quantities: &[&Quantity],
    hand: &Hand,
    objects: usize,
    lead: &[usize],
    rows: &[Vec<f64>],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let mut begin = 0;
    for quantity in quantities {
        let shape = (quantity.shape)(hand, objects);
        let end = begin + shape.iter().product::<usize>();
        let values: Vec<f64> = rows.iter().flat_map(|row| row[begin..end].iter().copied()).collect();
        begin = end;
        let whole: Vec<usize> = lead.iter().copied().chain(shape).collect();
        dict.set_item(quantity.name, PyArray1::from_vec(py, values).reshape(whole)?)?;
    }
    Ok(dict)
}

/// New poses and velocities, as Python gives them: arrays of one run, or with a row for each.
#[derive(FromPyObject)]
pub(crate) struct Placed<'py> {
    base: Option<PyReadonlyArrayDyn<'py, f64>>,
    q: Option<PyReadonlyArrayDyn<'py, f64>>,
    joint_velocity: Option<PyReadonlyArrayDyn<'py, f64>>,
    motors: Option<PyReadonlyArrayDyn<'py, f64>>,
    objects: Option<PyReadonlyArrayDyn<'py, f64>>,
}

impl Placed<'_> {
    /// The new poses and velocities of each of `count` runs; without `lead` there is one. `present` has the number of objects of each run.
    pub(crate) fn placements(
        &self,
        hand: &Hand,
        objects: usize,
        lead: &[usize],
        present: &[usize],
    ) -> PyResult<Vec<Placement>> {
        let rows = |name: &str, given: &Option<PyReadonlyArrayDyn<'_, f64>>| {
            let Some(given) = given else { return Ok(None) };
            let shape =
                STATE.iter().find(|quantity| quantity.name == name).map(|it| (it.shape)(hand, objects));
            let shape: Vec<usize> = lead.iter().copied().chain(shape.unwrap_or_default()).collect();
            if given.shape() != shape {
                let found = given.shape();
                return Err(value_error(format!("{name}: found shape {found:?}; wanted {shape:?}")));
            }
            let numbers: Vec<f64> = given.as_array().iter().copied().collect();
            if let Some(bad) = numbers.iter().find(|x| !x.is_finite()) {
                return Err(value_error(format!("{name}: found {bad}; wanted finite numbers")));
            }
            let length = numbers.len().checked_div(present.len()).unwrap_or(0);
            Ok(Some((numbers, length)))
        };
        let base = rows("base", &self.base)?;
        let q = rows("q", &self.q)?;
        let joint_velocity = rows("joint_velocity", &self.joint_velocity)?;
        let motors = rows("motors", &self.motors)?;
        let bodies = rows("objects", &self.objects)?;
        let of = |given: &Option<(Vec<f64>, usize)>, world: usize| -> Option<Vec<f64>> {
            given.as_ref().map(|(numbers, length)| numbers[world * length..(world + 1) * length].to_vec())
        };
        let placement = |(world, present): (usize, &usize)| Placement {
            base: of(&base, world).and_then(|row| body(&row)),
            q: of(&q, world),
            joint_velocity: of(&joint_velocity, world),
            motors: of(&motors, world).map(|row| row.chunks_exact(2).map(|two| [two[0], two[1]]).collect()),
            objects: of(&bodies, world)
                .map(|row| row.chunks_exact(13).take(*present).filter_map(body).collect()),
        };
        Ok(present.iter().enumerate().map(placement).collect())
    }
}

/// A body of its thirteen numbers.
fn body(row: &[f64]) -> Option<BodyState> {
    let part = |first: usize| -> Option<[f64; 3]> { row.get(first..first + 3)?.try_into().ok() };
    Some(BodyState {
        position: part(0)?,
        quat_xyzw: row.get(3..7)?.try_into().ok()?,
        linear: part(7)?,
        angular: part(10)?,
    })
}

/// The contacts of a run, in as many rows as fit.
pub(crate) struct Contacts {
    /// Their number, also where it is larger.
    count: i64,
    /// The two bodies of each: −1 furniture, then links, then free objects.
    bodies: Vec<i64>,
    /// Numbers of each: position, normal from the first body to the second, force and torque on the second, gap.
    numbers: Vec<f64>,
}

/// Numbers of a contact, and their names and shapes.
const CONTACT: [(&str, usize); 5] = [("position", 3), ("normal", 3), ("force", 3), ("torque", 3), ("gap", 1)];
const CONTACT_LEN: usize = 13;

/// The contacts of the last step; where there are more than `most`, those with the largest forces.
pub(crate) fn contacts(run: &Run, most: usize) -> Contacts {
    let links = run.hand().links.len() as i64;
    let index = |owner: Owner| match owner {
        Owner::Static => -1,
        Owner::Link(link) => link as i64,
        Owner::Object(object) => links + object as i64,
    };
    let mut all: Vec<_> = run.world().contact_forces().iter().collect();
    let count = all.len() as i64;
    if all.len() > most {
        all.sort_by(|a, b| b.force.length_squared().total_cmp(&a.force.length_squared()));
        all.truncate(most);
    }
    let bodies = all.iter().flat_map(|contact| [index(contact.a), index(contact.b)]);
    let mut bodies: Vec<i64> = bodies.collect();
    bodies.resize(2 * most, -1);
    let mut numbers = Vec::with_capacity(CONTACT_LEN * most);
    for contact in all {
        let vectors = [contact.position, contact.normal, contact.force, contact.torque];
        numbers.extend(vectors.iter().flat_map(Vec3::to_array));
        numbers.push(contact.distance);
    }
    numbers.resize(CONTACT_LEN * most, 0.0);
    Contacts { count, bodies, numbers }
}

/// A dictionary of arrays of contacts: `count`, `mask`, `bodies` and the numbers of each.
pub(crate) fn contact_arrays<'py>(
    py: Python<'py>,
    lead: &[usize],
    most: usize,
    all: &[Contacts],
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let shape = |last: &[usize]| -> Vec<usize> { lead.iter().copied().chain(last.iter().copied()).collect() };
    let count: Vec<i64> = all.iter().map(|it| it.count).collect();
    dict.set_item("count", PyArray1::from_vec(py, count).reshape(shape(&[]))?)?;
    let mask = all.iter().flat_map(|it| (0..most as i64).map(|k| k < it.count));
    dict.set_item("mask", PyArray1::from_vec(py, mask.collect::<Vec<bool>>()).reshape(shape(&[most]))?)?;
    let bodies: Vec<i64> = all.iter().flat_map(|it| it.bodies.iter().copied()).collect();
    dict.set_item("bodies", PyArray1::from_vec(py, bodies).reshape(shape(&[most, 2]))?)?;
    let mut begin = 0;
    for (name, len) in CONTACT {
        let of = |it: &Contacts| -> Vec<f64> {
            it.numbers.chunks_exact(CONTACT_LEN).flat_map(|row| row[begin..begin + len].to_vec()).collect()
        };
        let values: Vec<f64> = all.iter().flat_map(of).collect();
        let last: &[usize] = if len == 1 { &[most] } else { &[most, len] };
        dict.set_item(name, PyArray1::from_vec(py, values).reshape(shape(last))?)?;
        begin += len;
    }
    Ok(dict)
}
