//! A hand: its matrices, equilibria, grasps and motions.

use super::arrays::{Matrix, Seven, array, matrix, numbers, pose, rows, seven, value_error, vector};
use super::contacts::Given;
use super::design::{Goals, Variables};
use crate::interrupt::interruptible;
use crate::lookup;
use crate::workers::Workers;
use nalgebra::{DMatrix, DVector};
use numpy::{PyArray1, PyArray2, PyArrayMethods};
use palmares_analysis::closing::close;
use palmares_analysis::design::{Design, optimise};
use palmares_analysis::ejection::{Fate, Outcome, Trial, play};
use palmares_analysis::equilibrium::{Rest, link_poses, rest};
use palmares_analysis::grasp::Grasp;
use palmares_analysis::hand::{CompliantHand, Posture, Tendons, moment_arms, spring_stiffness, winding};
use palmares_analysis::inverse::{Along, Inverse, LinkPoint};
use palmares_models::hand::Hand;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use palmares_sim::statics::energy::PointConstraint;
use palmares_sim::statics::rest::Method;
use palmares_sim::{Config, Push};
use pyo3::prelude::*;
use pyo3::types::PyDict;
use std::sync::Arc;

/// A vector and a matrix for Python.
type VectorAndMatrix<'py> = (Bound<'py, PyArray1<f64>>, Bound<'py, PyArray2<f64>>);

/// A hand, by name or path.
#[pyclass(module = "palmares._native", frozen)]
pub(crate) struct HandModel {
    hand: Arc<Hand>,
    config: Config,
}

/// An equilibrium, or why there is none; nothing before it is computed.
type Found = Option<Result<Rest, String>>;

/// A point of a link with a force on it or its place in the world.
type PointOnLink = (String, [f64; 3], [f64; 3]);

#[pymethods]
impl HandModel {
    #[new]
    fn new(name: &str) -> PyResult<Self> {
        Ok(HandModel { hand: lookup::hand(name)?, config: Config::default() })
    }

    #[getter]
    fn name(&self) -> &str {
        &self.hand.name
    }

    #[getter]
    fn links(&self) -> Vec<&str> {
        self.hand.links.iter().map(|link| link.name.as_str()).collect()
    }

    #[getter]
    fn coordinates(&self) -> Vec<&str> {
        self.hand.coordinates.iter().map(|c| c.name.as_str()).collect()
    }

    #[getter]
    fn tendons(&self) -> Vec<&str> {
        self.hand.tendons.iter().map(|tendon| tendon.name.as_str()).collect()
    }

    #[getter]
    fn motors(&self) -> Vec<&str> {
        self.hand.motors.iter().map(|motor| motor.name.as_str()).collect()
    }

    /// q₀, lower and upper limits: 3 × n.
    fn ranges<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        let all = &self.hand.coordinates;
        let columns = DMatrix::from_fn(3, all.len(), |i, k| [all[k].rest, all[k].lower, all[k].upper][i]);
        array(py, &columns)
    }

    fn springs<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array(py, &spring_stiffness(&self.hand))
    }

    fn arms<'py>(&self, py: Python<'py>, q: Vec<f64>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.coordinates_of("q", &q)?;
        array(py, &moment_arms(&self.hand, &q))
    }

    fn winding<'py>(&self, py: Python<'py>) -> PyResult<Bound<'py, PyArray2<f64>>> {
        array(py, &winding(&self.hand))
    }

    fn tendon_stiffness(&self) -> Vec<f64> {
        self.hand.tendons.iter().map(|tendon| tendon.stiffness).collect()
    }

    /// Poses of all links, links × 7.
    fn link_poses<'py>(
        &self,
        py: Python<'py>,
        base: Seven,
        q: Vec<f64>,
    ) -> PyResult<Bound<'py, PyArray2<f64>>> {
        self.coordinates_of("q", &q)?;
        rows(py, link_poses(&self.hand, pose("base", base)?, &q).iter().map(seven))
    }

    /// The equilibrium at σ under forces, with some points held.
    fn rest<'py>(
        &self,
        py: Python<'py>,
        sigma: Vec<f64>,
        base: Seven,
        forces: Vec<PointOnLink>,
        held: Vec<PointOnLink>,
    ) -> PyResult<Bound<'py, PyDict>> {
        self.sigma_of("sigma", &sigma)?;
        let pushes = forces.iter().map(|given| {
            let (link, point, force) = self.on_link("forces", given)?;
            Ok(Push { link, point, force })
        });
        let pushes = pushes.collect::<PyResult<Vec<_>>>()?;
        let points = held.iter().map(|given| {
            let (link, point, place) = self.on_link("held", given)?;
            Ok(PointConstraint { link, point, place })
        });
        let points = points.collect::<PyResult<Vec<_>>>()?;
        let base = pose("base", base)?;
        let found = py.detach(|| rest(&self.config, &self.hand, base, &sigma, &pushes, &points));
        let found = found.map_err(value_error)?;
        let told = PyDict::new(py);
        told.set_item("q", PyArray1::from_slice(py, &found.equilibrium.q))?;
        told.set_item("tension", PyArray1::from_slice(py, &found.equilibrium.tension))?;
        let method = match found.equilibrium.method {
            Method::ClosedForm => "closed_form",
            Method::Newton => "newton",
        };
        told.set_item("method", method)?;
        told.set_item("beyond_closed_form", &found.equilibrium.beyond_closed_form)?;
        told.set_item("links", rows(py, found.links.iter().map(seven))?)?;
        told.set_item("reactions", rows(py, found.reactions.iter().map(|r| r.force.to_array()))?)?;
        told.set_item("gaps", found.reactions.iter().map(|r| r.gap).collect::<Vec<_>>())?;
        Ok(told)
    }

    /// Equilibria at many σ, without forces: of each its coordinates, tensions and link poses, or why there is none.
    fn rests<'py>(&self, py: Python<'py>, sigma: Matrix<'py>, base: Seven) -> PyResult<Bound<'py, PyDict>> {
        let (sigma, base) = (matrix("sigma", &sigma)?, pose("base", base)?);
        let rows = sigma.row_iter().map(|row| (row.iter().copied().collect(), None));
        let mut all: Vec<(Vec<f64>, Found)> = rows.collect();
        all.iter().try_for_each(|(sigma, _)| self.sigma_of("sigma", sigma))?;
        let mut workers = Workers::new(0)?;
        let workers = workers.started()?;
        py.detach(|| {
            workers.each(&mut all, |(sigma, found)| {
                let at = rest(&self.config, &self.hand, base, sigma, &[], &[]);
                *found = Some(at.map_err(|error| error.to_string()));
            });
        });
        let (mut q, mut tension, mut links) = (Vec::new(), Vec::new(), Vec::new());
        for (k, (_, found)) in all.into_iter().enumerate() {
            let none = || value_error(format!("sigma[{k}] was not computed"));
            let found = found.ok_or_else(none)?;
            let found = found.map_err(|error| value_error(format!("sigma[{k}]: {error}")))?;
            q.extend(found.equilibrium.q);
            tension.extend(found.equilibrium.tension);
            links.extend(found.links.iter().flat_map(seven));
        }
        let (count, hand) = (sigma.nrows(), &self.hand);
        let told = PyDict::new(py);
        told.set_item("q", PyArray1::from_vec(py, q).reshape([count, hand.coordinates.len()])?)?;
        told.set_item("tension", PyArray1::from_vec(py, tension).reshape([count, hand.tendons.len()])?)?;
        told.set_item("links", PyArray1::from_vec(py, links).reshape([count, hand.links.len(), 7])?)?;
        Ok(told)
    }

    /// Brings points of links to places, count × points of them, from each its base and σ.
    #[allow(clippy::too_many_arguments)]
    fn inverse<'py>(
        &self,
        py: Python<'py>,
        points: Vec<(String, [f64; 3])>,
        places: Vec<Vec<[f64; 3]>>,
        bases: Vec<Seven>,
        sigma: Vec<Vec<f64>>,
        along: &str,
        base_moves: bool,
    ) -> PyResult<Bound<'py, PyDict>> {
        let points = points.iter().map(|(name, point)| {
            let (link, point, _) = self.on_link("points", &(name.clone(), *point, [0.0; 3]))?;
            Ok(LinkPoint { link, point })
        });
        let points = points.collect::<PyResult<Vec<_>>>()?;
        let along = if along == "joints" { Along::Joints } else { Along::Motors };
        let inverse = Inverse { points, along, base_moves };
        let mut all = Vec::new();
        for ((places, base), sigma) in places.iter().zip(bases).zip(sigma) {
            self.sigma_of("sigma", &sigma)?;
            let places: Vec<Vec3> = places.iter().map(|place| Vec3::from_array(*place)).collect();
            all.push((places, pose("base", base)?, sigma, None));
        }
        let mut workers = Workers::new(0)?;
        let workers = workers.started()?;
        py.detach(|| {
            workers.each(&mut all, |(places, base, sigma, found)| {
                *found = Some(inverse.solve(&self.config, &self.hand, places, *base, sigma));
            });
        });
        let (mut bases, mut q, mut sigma, mut gaps) = (Vec::new(), Vec::new(), Vec::new(), Vec::new());
        let count = all.len();
        for (k, (_, _, _, found)) in all.into_iter().enumerate() {
            let found = found.ok_or_else(|| value_error(format!("goal {k} was not computed")))?;
            let found = found.map_err(|error| value_error(format!("goal {k}: {error}")))?;
            bases.extend(seven(&found.base));
            q.extend(found.q);
            sigma.extend(found.sigma);
            gaps.extend(found.gaps);
        }
        let hand = &self.hand;
        let told = PyDict::new(py);
        told.set_item("base", PyArray1::from_vec(py, bases).reshape([count, 7])?)?;
        told.set_item("q", PyArray1::from_vec(py, q).reshape([count, hand.coordinates.len()])?)?;
        told.set_item("sigma", PyArray1::from_vec(py, sigma).reshape([count, hand.motors.len()])?)?;
        told.set_item("gaps", PyArray1::from_vec(py, gaps).reshape([count, inverse.points.len()])?)?;
        Ok(told)
    }

    /// G, J and the contacts in the world; for forces λ, also the geometric stiffness of hand and object.
    fn grasp<'py>(
        &self,
        py: Python<'py>,
        base: Seven,
        q: Vec<f64>,
        contacts: Vec<Given>,
        object: Seven,
        forces: Option<Vec<f64>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        self.coordinates_of("q", &q)?;
        let on = contacts.iter().enumerate().map(|(index, contact)| contact.on(index, &self.hand));
        let on = on.collect::<PyResult<Vec<_>>>()?;
        let grasp = Grasp::new(&self.hand, pose("base", base)?, &q, &on, pose("object", object)?);
        let grasp = grasp.map_err(value_error)?;
        let told = PyDict::new(py);
        told.set_item("G", array(py, &grasp.g)?)?;
        told.set_item("J", array(py, &grasp.j)?)?;
        told.set_item("points", rows(py, grasp.contacts.iter().map(|c| c.point.to_array()))?)?;
        told.set_item("normals", rows(py, grasp.contacts.iter().map(|c| c.normal.to_array()))?)?;
        told.set_item("tangents", rows(py, grasp.contacts.iter().map(|c| c.tangent.to_array()))?)?;
        if let Some(forces) = forces {
            numbers("forces", &forces, grasp.g.ncols())?;
            let forces = DVector::from_vec(forces);
            told.set_item(
                "hand_geometric",
                array(py, &grasp.hand_geometric_stiffness(&self.hand, &forces))?,
            )?;
            told.set_item("object_geometric", array(py, &grasp.object_geometric_stiffness(&forces))?)?;
        }
        Ok(told)
    }

    /// The hand's linear behaviour in a posture.
    fn compliant<'py>(
        &self,
        py: Python<'py>,
        q: Vec<f64>,
        tension: Vec<f64>,
        fixed: bool,
        geometric: Option<Matrix<'py>>,
    ) -> PyResult<Bound<'py, PyDict>> {
        let geometric = geometric.map(|given| matrix("geometric", &given)).transpose()?;
        let found = self.compliant_hand(&q, &tension, fixed, geometric.as_ref())?;
        let told = PyDict::new(py);
        told.set_item("springs", array(py, &found.springs)?)?;
        told.set_item("R", array(py, &found.r)?)?;
        told.set_item("acting", &found.acting)?;
        told.set_item("compliance", array(py, &found.compliance)?)?;
        let stiffness = found.joint_stiffness().map(|stiffness| array(py, &stiffness)).transpose()?;
        told.set_item("stiffness", stiffness)?;
        told.set_item("motion", array(py, &found.motion)?)?;
        told.set_item("tension", array(py, &found.tension)?)?;
        told.set_item("tension_per_torque", array(py, &found.tension_per_torque)?)?;
        told.set_item("winding", array(py, &found.winding)?)?;
        told.set_item("tendon_stiffness", array(py, &found.tendon_stiffness)?)?;
        told.set_item("input_stiffness", array(py, &found.input_stiffness())?)?;
        Ok(told)
    }

    /// Equilibria of the free hand from σ to σ: σ, q and tensions, one row a sample.
    fn close<'py>(
        &self,
        py: Python<'py>,
        base: Seven,
        from: Vec<f64>,
        to: Vec<f64>,
        steps: usize,
        fractions: Vec<f64>,
    ) -> PyResult<Bound<'py, PyDict>> {
        self.sigma_of("start", &from)?;
        self.sigma_of("end", &to)?;
        let base = pose("base", base)?;
        let found =
            py.detach(|| close(&self.config, &self.hand, base, &from, &to, steps)).map_err(value_error)?;
        let told = PyDict::new(py);
        let table = |rows: &[Vec<f64>]| {
            let columns = rows.first().map_or(0, Vec::len);
            DMatrix::from_row_iterator(rows.len(), columns, rows.iter().flatten().copied())
        };
        told.set_item("sigma", array(py, &table(&found.sigma))?)?;
        told.set_item("q", array(py, &table(&found.q))?)?;
        told.set_item("tension", array(py, &table(&found.tension))?)?;
        let order = found.order(&fractions);
        told.set_item("order", order.iter().map(|joint| joint.coordinate).collect::<Vec<_>>())?;
        told.set_item("travel", order.iter().map(|joint| joint.travel).collect::<Vec<_>>())?;
        told.set_item("reached", order.into_iter().map(|joint| joint.reached).collect::<Vec<_>>())?;
        Ok(told)
    }

    /// Plays an object at each place: its fate, its way, the links that touch it.
    #[allow(clippy::too_many_arguments)]
    fn eject(
        &self,
        py: Python<'_>,
        places: Vec<(String, [f64; 3], Seven)>,
        mass: f64,
        friction: f64,
        close_s: f64,
        hold_s: f64,
        sigma: Vec<f64>,
        loads: Vec<[f64; 3]>,
    ) -> PyResult<Vec<(&'static str, f64, usize)>> {
        self.sigma_of("sigma", &sigma)?;
        let shapes =
            places.iter().map(|(kind, sizes, place)| Ok((shape(kind, *sizes)?, pose("place", *place)?)));
        let shapes = shapes.collect::<PyResult<Vec<(Shape, Pose)>>>()?;
        let loads = loads.into_iter().map(Vec3::from_array).collect();
        let trial = Trial { mass, friction, close_s, hold_s, sigma, loads };
        let (hand, config) = (Arc::clone(&self.hand), self.config.clone());
        let workers = Workers::new(0)?;
        let played = interruptible(py, move || {
            let one = |(shape, place): &(Shape, Pose)| {
                play(&config, &hand, shape, *place, &trial).map_err(|error| error.to_string())
            };
            let mut all: Vec<_> = shapes.iter().map(|shape| (shape, None)).collect();
            workers.each(&mut all, |(shape, played)| *played = Some(one(shape)));
            all.into_iter().filter_map(|(_, played)| played).collect::<Result<Vec<Outcome>, String>>()
        })?;
        let word = |fate| match fate {
            Fate::Overlaps => "overlaps",
            Fate::Missed => "missed",
            Fate::Ejected => "ejected",
            Fate::Dropped => "dropped",
            Fate::Held => "held",
            Fate::Fault => "fault",
        };
        let told = |outcome: Outcome| (word(outcome.fate), outcome.moved, outcome.links);
        Ok(played.map_err(value_error)?.into_iter().map(told).collect())
    }

    /// Lowers the differences from goals within the bounds of variables.
    fn optimise<'py>(
        &self,
        py: Python<'py>,
        variables: Variables,
        goals: Goals<'py>,
        steps: usize,
    ) -> PyResult<Bound<'py, PyDict>> {
        let variables = variables.of(&self.hand)?;
        let goals = goals.of()?;
        let mut design = Design::of(&self.hand).map_err(value_error)?;
        let found = py.detach(|| optimise(&mut design, &variables, &goals, steps)).map_err(value_error)?;
        let told = PyDict::new(py);
        told.set_item("values", vector(py, &found.values))?;
        told.set_item("cost", found.cost)?;
        told.set_item("history", PyArray1::from_slice(py, &found.history))?;
        told.set_item("converged", found.converged)?;
        told.set_item("R", array(py, &design.r)?)?;
        told.set_item("E", array(py, &design.e)?)?;
        told.set_item("q0", vector(py, &design.rest))?;
        Ok(told)
    }

    /// Differences from goals at the present numbers, and their gradients by the variables.
    fn differences<'py>(
        &self,
        py: Python<'py>,
        variables: Variables,
        goals: Goals<'py>,
    ) -> PyResult<VectorAndMatrix<'py>> {
        let variables = variables.of(&self.hand)?;
        let design = Design::of(&self.hand).map_err(value_error)?;
        let (values, slopes) = design.differences(&goals.of()?, &variables).map_err(value_error)?;
        Ok((vector(py, &values), array(py, &slopes)?))
    }
}

impl HandModel {
    fn compliant_hand(
        &self,
        q: &[f64],
        tension: &[f64],
        fixed: bool,
        geometric: Option<&DMatrix<f64>>,
    ) -> PyResult<CompliantHand> {
        self.coordinates_of("q", q)?;
        numbers("tension", tension, self.hand.tendons.len())?;
        let n = q.len();
        if let Some(given) = geometric.filter(|given| given.shape() != (n, n)) {
            let (rows, columns) = given.shape();
            return Err(value_error(format!("geometric: found {rows} × {columns}; wanted {n} × {n}")));
        }
        let tendons = if fixed { Tendons::Fixed } else { Tendons::Compliant };
        let posture = Posture { q, tension };
        CompliantHand::tendon_driven(&self.hand, posture, tendons, self.config.limit_stiffness, geometric)
            .map_err(value_error)
    }

    fn coordinates_of(&self, name: &str, q: &[f64]) -> PyResult<()> {
        numbers(name, q, self.hand.coordinates.len())
    }

    fn sigma_of(&self, name: &str, sigma: &[f64]) -> PyResult<()> {
        let motors = self.hand.motors.len();
        if sigma.len() == motors && sigma.iter().all(|s| (0.0..=1.0).contains(s)) {
            return Ok(());
        }
        let wanted = "from 0 (open) to 1 (closed)";
        Err(value_error(format!("{name}: found {sigma:?}; wanted {motors} numbers {wanted}, one per motor")))
    }

    fn on_link(&self, name: &str, (link, point, other): &PointOnLink) -> PyResult<(usize, Vec3, Vec3)> {
        let index = self.hand.link(link).ok_or_else(|| {
            let names = self.links().join(", ");
            value_error(format!("{name}: link: found {link:?}; wanted one of {names}"))
        })?;
        numbers(name, point, 3)?;
        numbers(name, other, 3)?;
        Ok((index, Vec3::from_array(*point), Vec3::from_array(*other)))
    }
}

fn shape(kind: &str, sizes: [f64; 3]) -> PyResult<Shape> {
    let [x, y, z] = sizes;
    match kind {
        "sphere" => Ok(Shape::Sphere { radius: x }),
        "cylinder" => Ok(Shape::Cylinder { radius: x, half_length: y }),
        "box" => Ok(Shape::Box { half_extents: [x, y, z], rounding: 0.0 }),
        _ => Err(value_error(format!("shape: found {kind:?}; wanted \"sphere\", \"cylinder\" or \"box\""))),
    }
}
