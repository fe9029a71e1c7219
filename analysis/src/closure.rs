//! Form and force closure, by linear and second-order cone programs.
//!
//! A grasp has first-order form closure if contacts without friction hold the object: `rank G_n = 6` and `G_n λ = 0` for some
//! λ > 0. With friction, it has frictional form closure if `rank G = 6` and `G λ = 0` for some λ inside all friction cones. It has
//! force closure if, further, the hand controls all inner forces: `N(G) ∩ N(Jᵀ) = 0` (Prattichizzo and Trinkle, section "Restraint
//! analysis"). As there, the margin d is the largest distance to the bounds for normal forces whose sum is at most the number of
//! contacts; but the cones here are round.

use crate::contact::{Contact, ContactModel, first_components};
use crate::linear::{intersection, null_space, rank};
use nalgebra::{DMatrix, DVector};

/// Margins below this are zero, N.
const MARGIN: f64 = 1e-6;

/// Rows of G that belong to motions of an object in a plane: force along x and y, moment about z.
pub const PLANAR: [usize; 3] = [0, 1, 5];

/// The result of a test.
#[derive(Clone, Debug, PartialEq)]
pub struct Closure {
    /// Whether the grasp has this closure.
    pub closed: bool,
    /// Rank of G, of as many as the object has degrees of freedom.
    pub rank: usize,
    /// The margin d; 0 if no forces balance.
    pub margin: f64,
    /// The balanced forces λ with the largest margin.
    pub forces: DVector<f64>,
}

/// Force closure of a grasp, and what it consists of.
#[derive(Clone, Debug, PartialEq)]
pub struct ForceClosure {
    /// Closure with the contacts' friction.
    pub frictional: Closure,
    /// Inner forces that the joints do not control, `N(G) ∩ N(Jᵀ)`, in columns.
    pub uncontrolled: DMatrix<f64>,
    /// Whether the grasp has force closure.
    pub closed: bool,
}

/// First-order form closure: the contacts' normals alone hold the object. `rows` are those of G that count:
/// all six, or [`PLANAR`].
pub fn form_closure(contacts: &[Contact], g: &DMatrix<f64>, rows: &[usize]) -> Closure {
    let normals: Vec<usize> = first_components(contacts).collect();
    let rigid: Vec<Contact> =
        contacts.iter().map(|c| Contact { model: ContactModel::Frictionless, ..*c }).collect();
    largest_margin(&rigid, &g.select_rows(rows).select_columns(&normals))
}

/// Closure with the contacts' own models and friction.
pub fn frictional_closure(contacts: &[Contact], g: &DMatrix<f64>, rows: &[usize]) -> Closure {
    largest_margin(contacts, &g.select_rows(rows))
}

/// Force closure of a hand.
pub fn force_closure(
    contacts: &[Contact],
    g: &DMatrix<f64>,
    j: &DMatrix<f64>,
    rows: &[usize],
) -> ForceClosure {
    let frictional = frictional_closure(contacts, g, rows);
    let uncontrolled = intersection(&null_space(&g.select_rows(rows)), &null_space(&j.transpose()));
    let closed = frictional.closed && uncontrolled.ncols() == 0;
    ForceClosure { frictional, uncontrolled, closed }
}

/// max d with G λ = 0, `μ f_n − ‖(f_t, f_o, m/arm)‖ ≥ d` (without friction `f_n ≥ d`), Σ f_n ≤ number of contacts.
///
/// The interior-point method in the null space of G: Newton's method on `weight · d + Σ log` of the cones, for ever larger weights (Boyd and
/// Vandenberghe, *Convex Optimization*, 2004, sections 11.3 and 11.6). λ = 0 with d < 0 is inside all cones.
fn largest_margin(contacts: &[Contact], g: &DMatrix<f64>) -> Closure {
    let null = null_space(g);
    let (columns, free) = null.shape();
    let cones = cones(contacts, &null);
    let mut x = DVector::zeros(free + 1);
    x[free] = -1.0;
    let mut weight = 1.0;
    // Each cone of order two has the barrier parameter 2: the gap of d is below 2 · cones / weight.
    while free > 0 && weight < 4.0 * cones.len() as f64 / TOLERANCE {
        weight *= 8.0;
        for _ in 0..NEWTON_STEPS {
            if newton_step(&cones, weight, &mut x) < 1e-10 {
                break;
            }
        }
    }
    let margin = if free > 0 { x[free].max(0.0) } else { 0.0 };
    let forces = if margin > 0.0 { null * x.rows(0, free) } else { DVector::zeros(columns) };
    let rank = rank(g);
    Closure { closed: rank == g.nrows() && margin > MARGIN, rank, margin, forces }
}

/// Precision of d, N.
const TOLERANCE: f64 = 1e-9;
/// Largest number of Newton steps for a weight; a handful is enough.
const NEWTON_STEPS: usize = 60;

/// A second-order cone `‖A x‖ ≤ bᵀ x + c`; without rows, a half space.
struct Cone {
    a: DMatrix<f64>,
    b: DVector<f64>,
    c: f64,
}

/// The cones of contacts, for x = (y, d) with λ = N y; the bound of the sum comes last.
fn cones(contacts: &[Contact], null: &DMatrix<f64>) -> Vec<Cone> {
    let free = null.ncols();
    let row = |k: usize, by: f64, d: f64| {
        DVector::from_fn(free + 1, |i, _| if i < free { by * null[(k, i)] } else { d })
    };
    let mut all = Vec::with_capacity(contacts.len() + 1);
    let mut sum = DVector::zeros(free + 1);
    for (contact, first) in contacts.iter().zip(first_components(contacts)) {
        let n = contact.model.components();
        sum -= row(first, 1.0, 0.0);
        let friction = if n == 1 { 1.0 } else { contact.friction };
        // Without an arm, a soft contact transmits no moment.
        let scale = |k: usize| if k < 3 { 1.0 } else { 1.0 / contact.arm.max(1e-9) };
        let rows: Vec<_> = (1..n).map(|k| row(first + k, scale(k), 0.0).transpose()).collect();
        let a = if rows.is_empty() { DMatrix::zeros(0, free + 1) } else { DMatrix::from_rows(&rows) };
        all.push(Cone { a, b: row(first, friction, -1.0), c: 0.0 });
    }
    all.push(Cone { a: DMatrix::zeros(0, free + 1), b: sum, c: contacts.len() as f64 });
    all
}

impl Cone {
    /// Distance to the bound, s − ‖v‖, where s = bᵀ x + c and v = A x.
    fn inside(&self, x: &DVector<f64>) -> f64 {
        self.b.dot(x) + self.c - (&self.a * x).norm()
    }

    /// `log(s² − ‖v‖²)`
    fn barrier(&self, x: &DVector<f64>) -> f64 {
        let s = self.b.dot(x) + self.c;
        let v = (&self.a * x).norm();
        (s - v).ln() + (s + v).ln()
    }
}

/// A Newton step with step halving. Returns half the squared decrement.
fn newton_step(cones: &[Cone], weight: f64, x: &mut DVector<f64>) -> f64 {
    let n = x.len();
    let mut gradient = DVector::zeros(n);
    gradient[n - 1] = weight;
    let mut curvature = DMatrix::identity(n, n) * 1e-12;
    for cone in cones {
        let s = cone.b.dot(x) + cone.c;
        let v = &cone.a * &*x;
        let u = s * s - v.norm_squared();
        let along = &cone.b * s - cone.a.transpose() * v;
        gradient.axpy(2.0 / u, &along, 1.0);
        curvature += &along * along.transpose() * (4.0 / (u * u));
        curvature += (cone.a.transpose() * &cone.a - &cone.b * cone.b.transpose()) * (2.0 / u);
    }
    let Some(factor) = curvature.cholesky() else { return 0.0 };
    let step = factor.solve(&gradient);
    let decrement = 0.5 * step.dot(&gradient);
    let value = |x: &DVector<f64>| weight * x[n - 1] + cones.iter().map(|cone| cone.barrier(x)).sum::<f64>();
    let before = value(x);
    let mut part = 1.0;
    while part > 1e-12 {
        let next = &*x + &step * part;
        if cones.iter().all(|cone| cone.inside(&next) > 0.0)
            && value(&next) >= before + 0.2 * part * decrement
        {
            *x = next;
            return decrement;
        }
        part *= 0.5;
    }
    0.0
}
