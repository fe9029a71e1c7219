//! Quality of a grasp as a set of wrenches (Ferrari and Canny 1992): ε, the largest wrench that it resists in every direction, and
//! the volume of the set.
//!
//! The set has the wrenches of contact forces inside their friction cones, with the sum of the normal forces at most 1 N
//! ([`Norm::Total`], the convex hull of all cones) or each of them at most 1 N ([`Norm::Each`], their Minkowski sum). Its norm is
//! `‖w‖² = ‖force‖² + (‖moment‖/length)²`.

use crate::contact::{Contact, ContactModel};
use crate::hull::{Hull, NoHull};
use nalgebra::{DMatrix, DVector};
use std::f64::consts::TAU;

/// The bound on the normal forces.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Norm {
    /// Their sum is at most 1 N (L1).
    Total,
    /// Each is at most 1 N (L∞).
    Each,
}

/// ε is found when its bounds are this near to each other, N.
const GAP: f64 = 1e-9;
/// Largest number of wrenches that refine ε.
const REFINEMENTS: usize = 2000;

/// Settings of the measures.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct QualitySettings {
    /// Bound on the normal forces.
    pub norm: Norm,
    /// Edges of the pyramid that replaces each friction cone, inside it; 0 keeps the round cone.
    pub edges: usize,
    /// Length that turns a moment into a force, m.
    pub length: f64,
}

/// The measures, of wrenches with the moment divided by the length.
#[derive(Clone, Debug, PartialEq)]
pub struct Quality {
    /// ε, N: the radius of the largest ball about the origin inside the set. 0 if the grasp does not resist all wrenches.
    pub epsilon: f64,
    /// An upper bound of ε, N; it is larger than ε by more than 1e-9 only if the cones are round and the search was ended.
    pub epsilon_bound: f64,
    /// The weakest wrench: its unit direction, of the size ε at most. Force, N, then moment over length, N.
    pub weakest: DVector<f64>,
    /// Volume of the set, N⁶; in the plane N³. `None` for [`Norm::Each`] and for round cones, whose ε needs only a part of the set.
    pub volume: Option<f64>,
}

/// Wrenches with which a contact answers, for directions in which it is pushed.
struct Cones<'a> {
    contacts: &'a [Contact],
    /// Columns of G of each contact, moments over length, the rows that count.
    columns: Vec<DMatrix<f64>>,
    settings: QualitySettings,
}

impl Cones<'_> {
    /// The extreme wrench of a contact with normal force 1 N along `direction`, and its reach.
    fn extreme(&self, index: usize, direction: &DVector<f64>) -> (DVector<f64>, f64) {
        let (contact, columns) = (&self.contacts[index], &self.columns[index]);
        let along = columns.transpose() * direction;
        let mut forces = DVector::zeros(columns.ncols());
        forces[0] = 1.0;
        let friction = |forces: &mut DVector<f64>| {
            let mut part = along.clone();
            part[0] = 0.0;
            if part.len() > 3 {
                part[3] *= contact.arm;
            }
            let size = part.norm();
            if size > 0.0 {
                for k in 1..part.len() {
                    let arm = if k == 3 { contact.arm } else { 1.0 };
                    forces[k] = contact.friction * arm * part[k] / size;
                }
            }
        };
        if contact.model != ContactModel::Frictionless {
            if self.settings.edges == 0 {
                friction(&mut forces);
            } else {
                let best = self
                    .edge_forces(contact)
                    .into_iter()
                    .max_by(|a, b| a.dot(&along).total_cmp(&b.dot(&along)));
                forces = best.unwrap_or(forces);
            }
        }
        let reach = forces.dot(&along);
        (columns * forces, reach)
    }

    /// Contact forces on the edges of a contact's pyramid.
    fn edge_forces(&self, contact: &Contact) -> Vec<DVector<f64>> {
        let n = contact.model.components();
        let mut all = Vec::new();
        if n == 1 {
            return vec![DVector::from_element(1, 1.0)];
        }
        for edge in 0..self.settings.edges {
            let angle = TAU * edge as f64 / self.settings.edges as f64;
            let mut forces = DVector::zeros(n);
            forces[0] = 1.0;
            forces[1] = contact.friction * angle.cos();
            forces[2] = contact.friction * angle.sin();
            all.push(forces);
        }
        if n == 4 {
            for spin in [1.0, -1.0] {
                let mut forces = DVector::zeros(4);
                (forces[0], forces[3]) = (1.0, spin * contact.friction * contact.arm);
                all.push(forces);
            }
        }
        all
    }

    /// The wrench of the set that is farthest along a direction, and its reach.
    fn farthest(&self, direction: &DVector<f64>) -> (DVector<f64>, f64) {
        let mut total = (DVector::zeros(direction.len()), 0.0);
        for index in 0..self.contacts.len() {
            let (wrench, reach) = self.extreme(index, direction);
            match self.settings.norm {
                Norm::Total if reach > total.1 => total = (wrench, reach),
                Norm::Each if reach > 0.0 => total = (total.0 + wrench, total.1 + reach),
                _ => {}
            }
        }
        total
    }

    /// All edges of all pyramids, as wrenches, with the origin.
    fn corners(&self) -> Vec<DVector<f64>> {
        let of = |(contact, columns): (&Contact, &DMatrix<f64>)| -> Vec<DVector<f64>> {
            self.edge_forces(contact).into_iter().map(|forces| columns * forces).collect()
        };
        let mut corners = vec![DVector::zeros(self.columns[0].nrows())];
        corners.extend(self.contacts.iter().zip(&self.columns).flat_map(of));
        corners
    }
}

/// The measures of a grasp. `rows` are those of G that count: all six, or [`crate::closure::PLANAR`].
///
/// ε is exact for its set: the polytope of wrenches found so far grows at its nearest facet until the set reaches no farther there.
///
/// # Errors
/// A hull with too many facets.
pub fn quality(
    contacts: &[Contact],
    g: &DMatrix<f64>,
    rows: &[usize],
    settings: QualitySettings,
) -> Result<Quality, NoHull> {
    let mut scaled = g.select_rows(rows);
    for (k, &row) in rows.iter().enumerate() {
        if row >= 3 {
            scaled.row_mut(k).scale_mut(1.0 / settings.length);
        }
    }
    let mut columns = Vec::new();
    let mut first = 0;
    for contact in contacts {
        let n = contact.model.components();
        columns.push(scaled.columns(first, n).into_owned());
        first += n;
    }
    let cones = Cones { contacts, columns, settings };
    let dimension = rows.len();
    let nothing = |volume| {
        let weakest = DVector::zeros(dimension);
        Ok(Quality { epsilon: 0.0, epsilon_bound: 0.0, weakest, volume })
    };
    let polytope = settings.edges > 0 && settings.norm == Norm::Total;
    if contacts.is_empty() {
        return nothing(polytope.then_some(0.0));
    }
    let start = if polytope {
        cones.corners()
    } else {
        // Along the axes, and along the directions that are left, until the wrenches span the space.
        let mut found = vec![DVector::zeros(dimension)];
        for axis in 0..dimension {
            for side in [1.0, -1.0] {
                let mut direction = DVector::zeros(dimension);
                direction[axis] = side;
                found.push(cones.farthest(&direction).0);
            }
        }
        // Some corners of the cones themselves, for sets that are flat along the axes.
        let settings = QualitySettings { edges: 4, ..settings };
        found.extend(Cones { contacts, columns: cones.columns.clone(), settings }.corners());
        found
    };
    let mut hull = match Hull::new(&start) {
        Ok(hull) => hull,
        Err(NoHull::Flat) => return nothing(polytope.then_some(0.0)),
        Err(error) => return Err(error),
    };
    let volume = polytope.then(|| hull.volume());
    let mut bound = f64::INFINITY;
    for _ in 0..REFINEMENTS {
        let nearest = hull.facets().min_by(|a, b| a.offset.total_cmp(&b.offset));
        let Some(nearest) = nearest else { break };
        let (normal, offset) = (nearest.normal.clone(), nearest.offset);
        let (wrench, reach) = cones.farthest(&normal);
        if reach <= GAP {
            return nothing(volume);
        }
        bound = bound.min(reach);
        if polytope || reach - offset <= GAP || !hull.add(wrench)? {
            break;
        }
    }
    let nearest = hull.facets().min_by(|a, b| a.offset.total_cmp(&b.offset));
    let Some(nearest) = nearest else { return nothing(volume) };
    if nearest.offset <= GAP {
        return nothing(volume);
    }
    Ok(Quality {
        epsilon: nearest.offset,
        epsilon_bound: bound.max(nearest.offset),
        weakest: -nearest.normal.clone(),
        volume,
    })
}
