//! A hand: its matrices, equilibria, grasps and motions.

use super::arrays::{
    Answer, Matrix, Part, Seven, answer, matrix, numbers, place_of, pose, rows, seven, shaped, value_error,
};
use super::contacts::Given;
use super::design::{Goals, Variables};
use crate::interrupt::interruptible;
use crate::lookup;
use crate::workers::Workers;
use nalgebra::{DMatrix, DVector};
use palmares_analysis::closing::{ClosingOrder, close};
use palmares_analysis::design::{Design, optimise};
use palmares_analysis::ejection::{Fate, Outcome, Trial, play};
use palmares_analysis::equilibrium::{link_poses, rest};
use palmares_analysis::grasp::Grasp;
use palmares_analysis::hand::{CompliantHand, Posture, Tendons, moment_arms, spring_stiffness, winding};
use palmares_analysis::inverse::{Along, Inverse, LinkPoint};
use palmares_models::hand::Hand;
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};
use palmares_sim::statics::energy::PointConstraint;
use palmares_sim::statics::rest::{Method, NoPrediction};
use palmares_sim::{Config, Push};
use pyo3::prelude::*;
use std::sync::Arc;

/// A hand, by name or path.
#[pyclass(module = "palmares._native", frozen)]
pub(crate) struct HandModel {
    hand: Arc<Hand>,
    config: Config,
}

/// A point of a link with a force on it or its place in the world.
type PointOnLink = (String, [f64; 3], [f64; 3]);

/// The results of `work` for all items, on all cores; an error names the item.
fn each<T: Sync, R: Send>(
    py: Python<'_>,
    items: &[T],
    name: impl Fn(usize) -> String,
    work: impl Fn(&T) -> Result<R, NoPrediction> + Sync,
) -> PyResult<Vec<R>> {
    let mut workers = Workers::new(0)?;
    let workers = workers.started()?;
    let mut all: Vec<_> = items.iter().map(|item| (item, None)).collect();
    py.detach(|| workers.each(&mut all, |(item, found)| *found = Some(work(item))));
    all.into_iter()
        .enumerate()
        .map(|(k, (_, found))| {
            let found = found.ok_or_else(|| value_error(format!("{} was not computed", name(k))))?;
            found.map_err(|error| value_error(format!("{}: {error}", name(k))))
        })
        .collect()
}

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

    /// Of links, coordinates, tendons and motors.
    fn names(&self) -> [Vec<&String>; 4] {
        let Hand { links, coordinates, tendons, motors, .. } = &*self.hand;
        [
            links.iter().map(|link| &link.name).collect(),
            coordinates.iter().map(|c| &c.name).collect(),
            tendons.iter().map(|tendon| &tendon.name).collect(),
            motors.iter().map(|motor| &motor.name).collect(),
        ]
    }

    /// q₀, lower and upper limits: 3 × n.
    fn ranges<'py>(&self, py: Python<'py>) -> Answer<'py> {
        let all = &self.hand.coordinates;
        DMatrix::from_fn(3, all.len(), |i, k| [all[k].rest, all[k].lower, all[k].upper][i]).part(py)
    }

    fn springs<'py>(&self, py: Python<'py>) -> Answer<'py> {
        spring_stiffness(&self.hand).part(py)
    }

    fn arms<'py>(&self, py: Python<'py>, q: Vec<f64>) -> Answer<'py> {
        self.coordinates_of("q", &q)?;
        moment_arms(&self.hand, &q).part(py)
    }

    fn winding<'py>(&self, py: Python<'py>) -> Answer<'py> {
        winding(&self.hand).part(py)
    }

    fn tendon_stiffness<'py>(&self, py: Python<'py>) -> Answer<'py> {
        self.hand.tendons.iter().map(|tendon| tendon.stiffness).collect::<Vec<_>>().part(py)
    }

    /// Poses of all links, links × 7.
    fn link_poses<'py>(&self, py: Python<'py>, base: Seven, q: Vec<f64>) -> Answer<'py> {
        self.coordinates_of("q", &q)?;
        link_poses(&self.hand, pose("base", base)?, &q).part(py)
    }

    /// The equilibrium at σ under forces, with some points held.
    fn rest<'py>(
        &self,
        py: Python<'py>,
        sigma: Vec<f64>,
        base: Seven,
        forces: Vec<PointOnLink>,
        held: Vec<PointOnLink>,
    ) -> Answer<'py> {
        self.sigma_of("sigma", &sigma)?;
        let pushes = forces.iter().map(|(link, point, force)| {
            let (link, [point, force]) = self.on_link("forces", link, [point, force])?;
            Ok(Push { link, point, force })
        });
        let pushes = pushes.collect::<PyResult<Vec<_>>>()?;
        let points = held.iter().map(|(link, point, place)| {
            let (link, [point, place]) = self.on_link("held", link, [point, place])?;
            Ok(PointConstraint { link, point, place })
        });
        let points = points.collect::<PyResult<Vec<_>>>()?;
        let base = pose("base", base)?;
        let found = py.detach(|| rest(&self.config, &self.hand, base, &sigma, &pushes, &points));
        let found = found.map_err(value_error)?;
        let at = &found.equilibrium;
        let method = match at.method {
            Method::ClosedForm => "closed_form",
            Method::Newton => "newton",
        };
        answer!(
            py,
            at: {q, tension, beyond_closed_form},
            "method": method,
            "links": found.links.part(py)?,
            "reactions": rows(py, found.reactions.iter().map(|r| r.force.to_array()))?,
            "gaps": found.reactions.iter().map(|r| r.gap).collect::<Vec<_>>().part(py)?,
        )
    }

    /// Equilibria at many σ, without forces: of each its coordinates, tensions and link poses, or why there is none.
    fn rests<'py>(&self, py: Python<'py>, sigma: Matrix<'py>, base: Seven) -> Answer<'py> {
        let (sigma, base) = (matrix("sigma", &sigma)?, pose("base", base)?);
        let all: Vec<Vec<f64>> = sigma.row_iter().map(|row| row.iter().copied().collect()).collect();
        all.iter().try_for_each(|sigma| self.sigma_of("sigma", sigma))?;
        let at = |sigma: &Vec<f64>| rest(&self.config, &self.hand, base, sigma, &[], &[]);
        let found = each(py, &all, |k| format!("sigma[{k}]"), at)?;
        let (count, hand) = (all.len(), &self.hand);
        let q = found.iter().flat_map(|at| &at.equilibrium.q).copied().collect();
        let tension = found.iter().flat_map(|at| &at.equilibrium.tension).copied().collect();
        let links = found.iter().flat_map(|at| &at.links).flat_map(seven).collect();
        answer!(
            py,
            "q": shaped(py, q, [count, hand.coordinates.len()])?,
            "tension": shaped(py, tension, [count, hand.tendons.len()])?,
            "links": shaped(py, links, [count, hand.links.len(), 7])?,
        )
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
    ) -> Answer<'py> {
        let points = points.iter().map(|(name, point)| {
            let (link, [point]) = self.on_link("points", name, [point])?;
            Ok(LinkPoint { link, point })
        });
        let points = points.collect::<PyResult<Vec<_>>>()?;
        let along = if along == "joints" { Along::Joints } else { Along::Motors };
        let inverse = Inverse { points, along, base_moves };
        let mut all = Vec::new();
        for ((places, base), sigma) in places.iter().zip(bases).zip(sigma) {
            self.sigma_of("sigma", &sigma)?;
            let places: Vec<Vec3> = places.iter().map(|place| Vec3::from_array(*place)).collect();
            all.push((places, pose("base", base)?, sigma));
        }
        let found = each(
            py,
            &all,
            |k| format!("goal {k}"),
            |(places, base, sigma)| Ok(inverse.solve(&self.config, &self.hand, places, *base, sigma)),
        )?;
        let (count, hand) = (all.len(), &self.hand);
        let q = found.iter().flat_map(|at| &at.q).copied().collect();
        let sigma = found.iter().flat_map(|at| &at.sigma).copied().collect();
        let gaps = found.iter().flat_map(|at| &at.gaps).copied().collect();
        answer!(
            py,
            "base": rows(py, found.iter().map(|at| seven(&at.base)))?,
            "q": shaped(py, q, [count, hand.coordinates.len()])?,
            "sigma": shaped(py, sigma, [count, hand.motors.len()])?,
            "gaps": shaped(py, gaps, [count, inverse.points.len()])?,
        )
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
    ) -> Answer<'py> {
        self.coordinates_of("q", &q)?;
        let on = contacts.iter().enumerate().map(|(index, contact)| contact.on(index, &self.hand));
        let on = on.collect::<PyResult<Vec<_>>>()?;
        let grasp = Grasp::new(&self.hand, pose("base", base)?, &q, &on, pose("object", object)?);
        let grasp = grasp.map_err(value_error)?;
        let forces = forces.map(|forces| numbers("forces", &forces, grasp.g.ncols()).map(|()| forces));
        let forces = forces.transpose()?.map(DVector::from_vec);
        let of_hand = forces.as_ref().map(|forces| grasp.hand_geometric_stiffness(&self.hand, forces));
        let of_object = forces.as_ref().map(|forces| grasp.object_geometric_stiffness(forces));
        answer!(
            py,
            "G": grasp.g.part(py)?,
            "J": grasp.j.part(py)?,
            "points": rows(py, grasp.contacts.iter().map(|c| c.point.to_array()))?,
            "normals": rows(py, grasp.contacts.iter().map(|c| c.normal.to_array()))?,
            "tangents": rows(py, grasp.contacts.iter().map(|c| c.tangent.to_array()))?,
            "hand_geometric": of_hand.part(py)?,
            "object_geometric": of_object.part(py)?,
        )
    }

    /// The hand's linear behaviour in a posture.
    fn compliant<'py>(
        &self,
        py: Python<'py>,
        q: Vec<f64>,
        tension: Vec<f64>,
        fixed: bool,
        geometric: Option<Matrix<'py>>,
    ) -> Answer<'py> {
        let geometric = geometric.map(|given| matrix("geometric", &given)).transpose()?;
        self.coordinates_of("q", &q)?;
        numbers("tension", &tension, self.hand.tendons.len())?;
        let n = q.len();
        if let Some(given) = geometric.as_ref().filter(|given| given.shape() != (n, n)) {
            let (rows, columns) = given.shape();
            return Err(value_error(format!("geometric: found {rows} × {columns}; wanted {n} × {n}")));
        }
        let tendons = if fixed { Tendons::Fixed } else { Tendons::Compliant };
        let (posture, limit) = (Posture { q: &q, tension: &tension }, self.config.limit_stiffness);
        let found = CompliantHand::tendon_driven(&self.hand, posture, tendons, limit, geometric.as_ref());
        let found = found.map_err(value_error)?;
        answer!(
            py,
            found: {acting, compliance, motion, tension, tension_per_torque, winding, tendon_stiffness},
            "E": found.springs.part(py)?,
            "R": found.r.part(py)?,
            "stiffness": found.joint_stiffness().part(py)?,
            "input_stiffness": found.input_stiffness().part(py)?,
        )
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
    ) -> Answer<'py> {
        self.sigma_of("start", &from)?;
        self.sigma_of("end", &to)?;
        let base = pose("base", base)?;
        let found = py.detach(|| close(&self.config, &self.hand, base, &from, &to, steps));
        let found = found.map_err(value_error)?;
        let table = |rows: &[Vec<f64>], columns| shaped(py, rows.concat(), [rows.len(), columns]);
        let hand = &self.hand;
        // From the order of closing to that of the coordinates.
        let order = found.order(&fractions);
        let mut places: Vec<&ClosingOrder> = order.iter().collect();
        places.sort_by_key(|joint| joint.coordinate);
        let reached =
            |joint: &&ClosingOrder| joint.reached.iter().map(|x| x.unwrap_or(f64::NAN)).collect::<Vec<f64>>();
        let name = |joint: &ClosingOrder| hand.coordinates[joint.coordinate].name.clone();
        answer!(
            py,
            "sigma": table(&found.sigma, hand.motors.len())?,
            "q": table(&found.q, hand.coordinates.len())?,
            "tension": table(&found.tension, hand.tendons.len())?,
            "order": order.iter().map(name).collect::<Vec<_>>().part(py)?,
            "travel": places.iter().map(|joint| joint.travel).collect::<Vec<_>>().part(py)?,
            "reached": table(&places.iter().map(reached).collect::<Vec<_>>(), fractions.len())?,
        )
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
        let row = |outcome: Outcome| (word(outcome.fate), outcome.moved, outcome.links);
        Ok(played.map_err(value_error)?.into_iter().map(row).collect())
    }

    /// Lowers the differences from goals within the bounds of variables.
    fn optimise<'py>(
        &self,
        py: Python<'py>,
        variables: Variables,
        goals: Goals<'py>,
        steps: usize,
    ) -> Answer<'py> {
        let variables = variables.of(&self.hand)?;
        let goals = goals.of()?;
        let mut design = Design::of(&self.hand).map_err(value_error)?;
        let found = py.detach(|| optimise(&mut design, &variables, &goals, steps)).map_err(value_error)?;
        answer!(
            py,
            found: {values, cost, history, converged},
            "R": design.r.part(py)?,
            "E": design.e.part(py)?,
            "q0": design.rest.part(py)?,
        )
    }

    /// Differences from goals at the present numbers, and their gradients by the variables.
    fn differences<'py>(
        &self,
        py: Python<'py>,
        variables: Variables,
        goals: Goals<'py>,
    ) -> PyResult<(Bound<'py, PyAny>, Bound<'py, PyAny>)> {
        let variables = variables.of(&self.hand)?;
        let design = Design::of(&self.hand).map_err(value_error)?;
        let (values, slopes) = design.differences(&goals.of()?, &variables).map_err(value_error)?;
        Ok((values.part(py)?, slopes.part(py)?))
    }
}

impl HandModel {
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

    fn on_link<const N: usize>(
        &self,
        name: &str,
        link: &str,
        vectors: [&[f64; 3]; N],
    ) -> PyResult<(usize, [Vec3; N])> {
        let links = self.hand.links.iter().map(|link| &link.name);
        let index = place_of(&format!("{name}: link"), link, links)?;
        vectors.iter().try_for_each(|vector| numbers(name, *vector, 3))?;
        Ok((index, vectors.map(|vector| Vec3::from_array(*vector))))
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
