//! Quality of a grasp as a set of wrenches (Ferrari and Canny 1992): ε, the largest wrench that it resists in every direction, and
//! the volume of the set.
//!
//! The set has the wrenches of contact forces inside their friction cones, with the sum of the normal forces at most 1 N
//! ([`Norm::Total`], the convex hull of all cones) or each of them at most 1 N ([`Norm::Each`], their Minkowski sum). Its norm is
//! `‖w‖² = ‖force‖² + (‖moment‖/length)²`.

use crate::contact::{Contact, first_components};
use crate::hull::{Facet, Hull, NoHull};
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
    /// Edges of the pyramid that replaces each friction cone, inside it; at least 3. For a soft finger also the number of points on
    /// every great circle of the sphere (f_t, f_o, m/arm), about edges²/π in all.
    pub edges: usize,
    /// Length that turns a moment into a force, m.
    pub length: f64,
}

/// The measures, of wrenches with the moment divided by the length.
#[derive(Clone, Debug, PartialEq)]
pub struct Quality {
    /// ε, N: the radius of the largest ball about the origin inside the set. 0 if the grasp does not resist all wrenches.
    pub epsilon: f64,
    /// An upper bound, N, of the ε of round cones; ε itself is a lower one.
    pub epsilon_bound: f64,
    /// The weakest wrench: its unit direction, of the size ε at most. Force, N, then moment over length, N.
    pub weakest: DVector<f64>,
    /// Volume of the set, N⁶; in the plane N³. `None` for [`Norm::Each`], whose ε needs
    /// only a part of the set.
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
    /// The extreme wrench of a contact's pyramid with the normal force 1 N along `direction`, and its reach.
    fn extreme(&self, index: usize, direction: &DVector<f64>) -> (DVector<f64>, f64) {
        let along = self.columns[index].transpose() * direction;
        let edges = self.edge_forces(&self.contacts[index]).into_iter().map(|forces| {
            let reach = forces.dot(&along);
            (forces, reach)
        });
        let best = edges.max_by(|a, b| a.1.total_cmp(&b.1));
        best.map_or_else(|| (direction * 0.0, 0.0), |(forces, reach)| (&self.columns[index] * forces, reach))
    }

    /// The reach of a contact's round cone with the normal force 1 N along `direction`.
    fn round_reach(&self, index: usize, direction: &DVector<f64>) -> f64 {
        let contact = &self.contacts[index];
        let mut along = self.columns[index].transpose() * direction;
        let normal = std::mem::take(&mut along[0]);
        if along.len() > 3 {
            along[3] *= contact.arm;
        }
        normal + contact.friction * along.norm()
    }

    /// The reach of the set with round cones along a direction.
    fn farthest_round(&self, direction: &DVector<f64>) -> f64 {
        let reaches = (0..self.contacts.len()).map(|index| self.round_reach(index, direction).max(0.0));
        match self.settings.norm {
            Norm::Total => reaches.fold(0.0, f64::max),
            Norm::Each => reaches.sum(),
        }
    }

    /// Contact forces on the edges of a contact's pyramid.
    fn edge_forces(&self, contact: &Contact) -> Vec<DVector<f64>> {
        let n = contact.model.components();
        let mut all = Vec::new();
        if n == 1 {
            return vec![DVector::from_element(1, 1.0)];
        }
        let edges = self.settings.edges as f64;
        // Circles of equal spin, from pole to pole; a hard finger has the equator alone.
        let circles = if n == 4 { (edges / 4.0).round().max(1.0) as i32 } else { 0 };
        for circle in -circles..=circles {
            let (sin, cos) = (0.25 * TAU * f64::from(circle) / f64::from(circles.max(1))).sin_cos();
            let pole = n == 4 && circle.abs() == circles;
            let count = if pole { 1.0 } else { (edges * cos).round().max(3.0) };
            let reach = contact.friction * if pole { 0.0 } else { cos };
            for edge in 0..count as usize {
                let angle = TAU * edge as f64 / count;
                let mut forces = DVector::zeros(n);
                (forces[0], forces[1], forces[2]) = (1.0, reach * angle.cos(), reach * angle.sin());
                if n == 4 {
                    forces[3] = contact.friction * contact.arm * sin;
                }
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
/// ε is exact for the pyramids: the least reach of the set along the normals of its facets. For [`Norm::Each`], which is for objects in
/// the plane, the polytope of wrenches found so far grows at its nearest facet until the set reaches no farther there.
///
/// # Errors
/// A hull with too many facets, or [`Norm::Each`] in space.
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
    let of =
        |(contact, first): (&Contact, usize)| scaled.columns(first, contact.model.components()).into_owned();
    let columns = contacts.iter().zip(first_components(contacts)).map(of).collect();
    let cones = Cones { contacts, columns, settings };
    let dimension = rows.len();
    let nothing = |volume| {
        let weakest = DVector::zeros(dimension);
        Ok(Quality { epsilon: 0.0, epsilon_bound: 0.0, weakest, volume })
    };
    let total = settings.norm == Norm::Total;
    if contacts.is_empty() {
        return nothing(total.then_some(0.0));
    }
    if !total && dimension > 3 {
        return Err(NoHull::EachInSpace);
    }
    let mut start = cones.corners();
    if !total {
        for axis in 0..dimension {
            for side in [1.0, -1.0] {
                let mut direction = DVector::zeros(dimension);
                direction[axis] = side;
                start.push(cones.farthest(&direction).0);
            }
        }
    }
    let mut hull = match Hull::new(&start) {
        Ok(hull) => hull,
        Err(NoHull::Flat) => return nothing(total.then_some(0.0)),
        Err(error) => return Err(error),
    };
    let volume = total.then(|| hull.volume());
    for _ in 0..if total { 0 } else { REFINEMENTS } {
        let nearest = hull.facets().min_by(|a, b| a.offset.total_cmp(&b.offset));
        let Some((normal, offset)) = nearest.map(|facet| (facet.normal.clone(), facet.offset)) else { break };
        let (wrench, reach) = cones.farthest(&normal);
        if reach <= GAP {
            return nothing(volume);
        }
        if reach - offset <= GAP || !hull.add(wrench)? {
            break;
        }
    }
    // The reach of the set, not the offset of the facet: a thin facet may have any normal, but no reach is below ε.
    let reach = |facet: &Facet| cones.farthest(&facet.normal).1;
    let nearest = hull.facets().map(|facet| (reach(facet), facet)).min_by(|a, b| a.0.total_cmp(&b.0));
    let Some((epsilon, facet)) = nearest.filter(|(epsilon, _)| *epsilon > GAP) else {
        return nothing(volume);
    };
    let round = hull.facets().map(|facet| cones.farthest_round(&facet.normal)).fold(f64::INFINITY, f64::min);
    Ok(Quality { epsilon, epsilon_bound: round.max(epsilon), weakest: -facet.normal.clone(), volume })
}
