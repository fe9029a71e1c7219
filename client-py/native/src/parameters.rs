//! Numbers of runs that are given rather than drawn, and those in effect, as arrays.

use numpy::{PyArray1, PyArrayMethods, PyReadonlyArrayDyn, PyUntypedArrayMethods};
use palmares_models::hand::Hand;
use palmares_models::hand::uncertain::Range;
use palmares_tasks::Run;
use palmares_tasks::training::{Given, factors, link_factors, sensor_noise};
use pyo3::exceptions::PyValueError;
use pyo3::prelude::*;
use pyo3::types::PyDict;

/// Begin of the name of a number of the hand.
const HAND: &str = "hand_";
/// Names of the factors of objects.
const FACTORS: [&str; 3] = ["mass", "friction", "size"];
/// Name of the factors of the masses of links.
const LINK_MASS: &str = "link_mass";
const GRAVITY: &str = "gravity";

/// The given numbers of each of `count` runs: of the objects arrays (`count`, `objects`), of links (`count`, links), gravity
/// (`count`, 3), of the hand arrays (`count`,).
pub(crate) fn given(
    parameters: Option<&Bound<'_, PyDict>>,
    hand: &Hand,
    count: usize,
    objects: usize,
) -> PyResult<Vec<Given>> {
    let mut all = vec![Given::default(); count];
    let Some(parameters) = parameters else { return Ok(all) };
    for (name, array) in parameters.iter() {
        let (name, array): (String, PyReadonlyArrayDyn<'_, f64>) = (name.extract()?, array.extract()?);
        let columns = match name.as_str() {
            GRAVITY => Some(3),
            LINK_MASS => Some(hand.links.len()),
            of_hand if of_hand.starts_with(HAND) => None,
            factors if FACTORS.contains(&factors) => Some(objects),
            _ => {
                let known = FACTORS.join(", ");
                let message = format!(
                    "parameters: found {name:?}; wanted some of {known}, {LINK_MASS}, {GRAVITY}, hand_NAME"
                );
                return Err(PyValueError::new_err(message));
            }
        };
        let wanted: Vec<usize> = std::iter::once(count).chain(columns).collect();
        if array.shape() != wanted {
            let message = format!("parameters: {name}: found shape {:?}; wanted {wanted:?}", array.shape());
            return Err(PyValueError::new_err(message));
        }
        let numbers: Vec<f64> = array.as_array().iter().copied().collect();
        for (given, row) in all.iter_mut().zip(numbers.chunks(columns.unwrap_or(1).max(1))) {
            match name.as_str() {
                "mass" => given.mass = Some(row.to_vec()),
                "friction" => given.friction = Some(row.to_vec()),
                "size" => given.size = Some(row.to_vec()),
                LINK_MASS => given.link_mass = Some(row.to_vec()),
                // −0 becomes 0, which is equal to it and has other bits.
                GRAVITY => given.gravity = Some([0, 1, 2].map(|axis| row[axis] + 0.0)),
                of_hand => {
                    given.hand.insert(of_hand[HAND.len()..].to_owned(), row[0]);
                }
            }
        }
    }
    for (run, given) in all.iter().enumerate() {
        let of_run = |problem| PyValueError::new_err(format!("parameters: run {run}: {problem}"));
        given.check(hand).map_err(of_run)?;
    }
    Ok(all)
}

/// The numbers in effect in runs of a hand, with what was given or drawn of it, as [`given`] takes them. Objects that a run
/// lacks have factor 1; where the hand has its own number and not a factor of it, its entry is NaN.
pub(crate) fn in_effect<'py>(
    py: Python<'py>,
    runs: &[(&Run, &[Option<f64>])],
    hand: &Hand,
    objects: usize,
) -> PyResult<Bound<'py, PyDict>> {
    let dict = PyDict::new(py);
    let of_objects: Vec<Vec<[f64; 3]>> = runs.iter().map(|(run, _)| factors(run)).collect();
    for (k, name) in FACTORS.iter().enumerate() {
        let row = |of: &Vec<[f64; 3]>| -> Vec<f64> {
            (0..objects).map(|object| of.get(object).map_or(1.0, |three| three[k])).collect()
        };
        let numbers: Vec<f64> = of_objects.iter().flat_map(row).collect();
        dict.set_item(*name, PyArray1::from_vec(py, numbers).reshape([runs.len(), objects])?)?;
    }
    let links: Vec<f64> = runs.iter().flat_map(|(run, _)| link_factors(run)).collect();
    dict.set_item(LINK_MASS, PyArray1::from_vec(py, links).reshape([runs.len(), hand.links.len()])?)?;
    let gravity = |(run, _): &(&Run, &[Option<f64>])| run.world().model().config().gravity.to_array();
    let gravity: Vec<f64> = runs.iter().flat_map(gravity).collect();
    dict.set_item(GRAVITY, PyArray1::from_vec(py, gravity).reshape([runs.len(), 3])?)?;
    let noise: Vec<f64> = runs.iter().map(|(run, _)| sensor_noise(run)).collect();
    dict.set_item("sensor_noise", PyArray1::from_vec(py, noise))?;
    for (k, entry) in hand.uncertain.iter().enumerate() {
        let own = match entry.range {
            Range::Factor(_) => 1.0,
            Range::Value(_) => f64::NAN,
        };
        let number = |(_, numbers): &(&Run, &[Option<f64>])| numbers.get(k).copied().flatten().unwrap_or(own);
        let numbers: Vec<f64> = runs.iter().map(number).collect();
        dict.set_item(format!("{HAND}{}", entry.name), PyArray1::from_vec(py, numbers))?;
    }
    Ok(dict)
}

/// The given numbers of a run, in the form that [`given`] takes; none if none are given.
pub(crate) fn given_arrays<'py>(py: Python<'py>, given: &Given) -> PyResult<Option<Bound<'py, PyDict>>> {
    if *given == Given::default() {
        return Ok(None);
    }
    let dict = PyDict::new(py);
    for (name, factors) in FACTORS.iter().zip([&given.mass, &given.friction, &given.size]) {
        if let Some(factors) = factors {
            dict.set_item(*name, PyArray1::from_slice(py, factors).reshape([1, factors.len()])?)?;
        }
    }
    if let Some(gravity) = &given.gravity {
        dict.set_item(GRAVITY, PyArray1::from_slice(py, gravity).reshape([1, 3])?)?;
    }
    if let Some(factors) = &given.link_mass {
        dict.set_item(LINK_MASS, PyArray1::from_slice(py, factors).reshape([1, factors.len()])?)?;
    }
    for (name, number) in &given.hand {
        dict.set_item(format!("{HAND}{name}"), PyArray1::from_slice(py, &[*number]))?;
    }
    Ok(Some(dict))
}
