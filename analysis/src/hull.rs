//! The convex hull of points in any dimension, one point after the other (Barber, Dobkin and Huhdanpaa 1996, "Quickhull": the
//! facets that a new point sees are replaced by the cone from it to their horizon).

use nalgebra::{DMatrix, DVector};
use std::collections::HashMap;

/// Largest number of facets that are computed, with those that later points replace: some seconds in six dimensions.
pub const MAX_FACETS: usize = 300_000;
/// A point this far outside a facet, in units of the points' largest coordinate, sees it. Points nearer to a facet
/// count as on it, so that the many facets that lie in one hyperplane make no thin ones.
const SIGHT: f64 = 1e-9;

/// A simplicial facet: `normal · x ≤ offset` for all points.
#[derive(Clone, Debug)]
pub struct Facet {
    /// Indices of its points.
    pub points: Vec<usize>,
    /// Outward unit normal.
    pub normal: DVector<f64>,
    /// Distance of its hyperplane from the origin.
    pub offset: f64,
    /// Facet across from each point.
    neighbours: Vec<usize>,
    gone: bool,
}

/// A hull that grows.
#[derive(Clone, Debug)]
pub struct Hull {
    points: Vec<DVector<f64>>,
    inside: DVector<f64>,
    facets: Vec<Facet>,
    /// Places of facets that are gone.
    free: Vec<usize>,
    /// Number of facets computed yet.
    computed: usize,
    /// Largest number of them.
    most: usize,
    sight: f64,
}

/// A hull that was not computed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
pub enum NoHull {
    /// All points are in a hyperplane.
    #[error("the points span no volume")]
    Flat,
    /// The set of wrenches with each normal force at most 1 N, in space.
    #[error("each normal force at most 1 N is for objects in the plane")]
    EachInSpace,
    /// It has too many facets.
    #[error(
        "the hull of the wrenches needs more than {MAX_FACETS} facets: take fewer edges of the friction cones, or fewer contacts"
    )]
    TooLarge,
}

impl Hull {
    /// The hull of points, which must span the space.
    ///
    /// # Errors
    /// Points in a hyperplane, or too many facets.
    pub fn new(points: &[DVector<f64>]) -> Result<Self, NoHull> {
        Self::within(points, MAX_FACETS)
    }

    /// The hull, if no more facets than `most` are computed for it.
    fn within(points: &[DVector<f64>], most: usize) -> Result<Self, NoHull> {
        let size = points.iter().map(|point| point.amax()).fold(0.0, f64::max);
        let corners = simplex(points, size).ok_or(NoHull::Flat)?;
        let dimension = corners.len() - 1;
        let inside = corners.iter().map(|&i| &points[i]).sum::<DVector<f64>>() / corners.len() as f64;
        let mut hull = Hull {
            points: points.to_vec(),
            inside,
            facets: Vec::new(),
            free: Vec::new(),
            computed: 0,
            most,
            sight: SIGHT * size,
        };
        for across in 0..=dimension {
            let own: Vec<usize> = (0..=dimension).filter(|&k| k != across).map(|k| corners[k]).collect();
            // The facet across from corner k is facet k.
            let neighbours = (0..=dimension).filter(|&k| k != across).collect();
            hull.insert(own, neighbours).ok_or(NoHull::Flat)?;
        }
        // The farthest points first: they cover the others.
        let mut order: Vec<usize> = (0..points.len()).filter(|i| !corners.contains(i)).collect();
        let far = |i: usize| (&points[i] - &hull.inside).norm_squared();
        let far: Vec<f64> = (0..points.len()).map(far).collect();
        order.sort_by(|&a, &b| far[b].total_cmp(&far[a]).then(a.cmp(&b)));
        for point in order {
            hull.cover(point)?;
        }
        Ok(hull)
    }

    /// Adds a point. Returns whether it was outside.
    ///
    /// # Errors
    /// Too many facets.
    pub fn add(&mut self, point: DVector<f64>) -> Result<bool, NoHull> {
        self.points.push(point);
        self.cover(self.points.len() - 1)
    }

    /// Its facets.
    pub fn facets(&self) -> impl Iterator<Item = &Facet> {
        self.facets.iter().filter(|facet| !facet.gone)
    }

    /// Its volume.
    pub fn volume(&self) -> f64 {
        let mut factorial = 1.0;
        (1..=self.inside.len()).for_each(|k| factorial *= k as f64);
        let of = |facet: &Facet| {
            let edges: Vec<DVector<f64>> =
                facet.points.iter().map(|&i| &self.points[i] - &self.inside).collect();
            DMatrix::from_columns(&edges).determinant().abs() / factorial
        };
        self.facets().map(of).sum()
    }

    fn sees(&self, point: usize, facet: &Facet) -> bool {
        !facet.gone && facet.normal.dot(&self.points[point]) > facet.offset + self.sight
    }

    /// Replaces the facets that a point sees.
    fn cover(&mut self, point: usize) -> Result<bool, NoHull> {
        // The facet that the point is farthest above; its visible neighbours are connected to it.
        let above = |facet: &Facet| facet.normal.dot(&self.points[point]) - facet.offset;
        let live = self.facets.iter().enumerate().filter(|(_, facet)| !facet.gone);
        let heights = live.map(|(index, facet)| (index, above(facet)));
        let Some((first, _)) = heights.max_by(|a, b| a.1.total_cmp(&b.1)) else {
            return Ok(false);
        };
        if !self.sees(point, &self.facets[first]) {
            return Ok(false);
        }
        let mut visible = vec![first];
        let mut is_visible: HashMap<usize, ()> = HashMap::from([(first, ())]);
        // Each piece of the horizon: its points, the facet beyond.
        let mut horizon: Vec<(Vec<usize>, usize)> = Vec::new();
        let mut next = 0;
        while let Some(&at) = visible.get(next) {
            next += 1;
            for k in 0..self.facets[at].points.len() {
                let neighbour = self.facets[at].neighbours[k];
                if is_visible.contains_key(&neighbour) {
                    continue;
                }
                if self.sees(point, &self.facets[neighbour]) {
                    is_visible.insert(neighbour, ());
                    visible.push(neighbour);
                }
            }
        }
        for &at in &visible {
            let facet = &self.facets[at];
            for k in 0..facet.points.len() {
                if !is_visible.contains_key(&facet.neighbours[k]) {
                    let ridge = facet.points.iter().enumerate().filter(|(i, _)| *i != k).map(|(_, p)| *p);
                    horizon.push((ridge.collect(), facet.neighbours[k]));
                }
            }
        }
        let mut added = Vec::with_capacity(horizon.len());
        let mut open: HashMap<Vec<usize>, (usize, usize)> = HashMap::new();
        for (ridge, beyond) in &horizon {
            let mut points = ridge.clone();
            points.push(point);
            let count = points.len();
            let mut neighbours = vec![usize::MAX; count];
            neighbours[count - 1] = *beyond;
            if self.computed >= self.most {
                return Err(NoHull::TooLarge);
            }
            let Some(index) = self.insert(points, neighbours) else { return Err(NoHull::Flat) };
            added.push((index, *beyond));
            for k in 0..count - 1 {
                let mut edge: Vec<usize> = self.facets[index]
                    .points
                    .iter()
                    .enumerate()
                    .filter(|(i, _)| *i != k)
                    .map(|(_, p)| *p)
                    .collect();
                edge.sort_unstable();
                if let Some((other, across)) = open.remove(&edge) {
                    self.facets[index].neighbours[k] = other;
                    self.facets[other].neighbours[across] = index;
                } else {
                    open.insert(edge, (index, k));
                }
            }
        }
        for (index, beyond) in added {
            let across = self.facets[beyond].neighbours.iter().enumerate().find(|(k, neighbour)| {
                is_visible.contains_key(neighbour) && {
                    let facet = &self.facets[beyond];
                    let new = &self.facets[index];
                    facet.points.iter().enumerate().all(|(i, p)| i == *k || new.points.contains(p))
                }
            });
            if let Some((across, _)) = across {
                self.facets[beyond].neighbours[across] = index;
            }
        }
        for at in visible {
            self.facets[at].gone = true;
            self.free.push(at);
        }
        Ok(true)
    }

    /// A new facet through points, outward of the hull's inside.
    fn insert(&mut self, points: Vec<usize>, neighbours: Vec<usize>) -> Option<usize> {
        let (mut normal, mut offset) = self.plane(&points)?;
        if normal.dot(&self.inside) > offset {
            normal.neg_mut();
            offset = -offset;
        }
        let facet = Facet { points, normal, offset, neighbours, gone: false };
        self.computed += 1;
        if let Some(place) = self.free.pop() {
            self.facets[place] = facet;
            return Some(place);
        }
        self.facets.push(facet);
        Some(self.facets.len() - 1)
    }

    /// The unit normal of the hyperplane through points, and its distance from the origin.
    fn plane(&self, points: &[usize]) -> Option<(DVector<f64>, f64)> {
        let origin = &self.points[points[0]];
        let n = origin.len();
        // Orthogonal directions within the plane (modified Gram and Schmidt, twice), then the axis that is left.
        let mut directions: Vec<DVector<f64>> = Vec::with_capacity(n - 1);
        for &point in &points[1..] {
            let mut edge = &self.points[point] - origin;
            let length = edge.norm();
            if length == 0.0 {
                return None;
            }
            edge /= length;
            for _ in 0..2 {
                for direction in &directions {
                    edge.axpy(-direction.dot(&edge), direction, 1.0);
                }
            }
            let left = edge.norm();
            // A sliver: any direction that completes it is as good.
            if left > 1e-14 {
                edge /= left;
                directions.push(edge);
            }
        }
        let mut best = DVector::zeros(n);
        for axis in 0..n {
            let mut normal = DVector::zeros(n);
            normal[axis] = 1.0;
            for _ in 0..2 {
                for direction in &directions {
                    normal.axpy(-direction.dot(&normal), direction, 1.0);
                }
            }
            if normal.norm() > best.norm() {
                best = normal;
            }
        }
        let normal = best.normalize();
        let offset = normal.dot(origin);
        Some((normal, offset))
    }
}

/// Indices of points that span the space, each the farthest from those before.
fn simplex(points: &[DVector<f64>], size: f64) -> Option<Vec<usize>> {
    let first = points.first()?;
    let mut corners = vec![0];
    let mut directions: Vec<DVector<f64>> = Vec::new();
    let mut left: Vec<DVector<f64>> = points.iter().map(|point| point - first).collect();
    while directions.len() < first.len() {
        let farthest =
            (0..points.len()).max_by(|&a, &b| left[a].norm_squared().total_cmp(&left[b].norm_squared()))?;
        let length = left[farthest].norm();
        if length <= 1e3 * SIGHT * size || length == 0.0 {
            return None;
        }
        let direction = &left[farthest] / length;
        for rest in &mut left {
            rest.axpy(-direction.dot(rest), &direction, 1.0);
        }
        directions.push(direction);
        corners.push(farthest);
    }
    Some(corners)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn point(x: &[f64]) -> DVector<f64> {
        DVector::from_row_slice(x)
    }

    fn all(dimension: usize, of: impl Fn(usize, usize) -> f64) -> Vec<DVector<f64>> {
        (0..1 << dimension).map(|i| DVector::from_fn(dimension, |k, _| of(i, k))).collect()
    }

    #[test]
    fn volume_and_facets_of_a_cube_and_a_cross_polytope_in_six_dimensions() {
        // All corners of a cube, its middle and the middles of its sides: many points in each hyperplane.
        let mut points = all(6, |i, k| f64::from(u8::from(i >> k & 1 == 1)) * 2.0 - 1.0);
        points.push(DVector::zeros(6));
        let hull = Hull::new(&points).expect("a hull");
        assert!((hull.volume() - 64.0).abs() < 1e-9, "{}", hull.volume());
        for facet in hull.facets() {
            assert!((facet.offset - 1.0).abs() < 1e-9 && (facet.normal.amax() - 1.0).abs() < 1e-9);
        }
        let mut points = Vec::new();
        for k in 0..6 {
            for side in [1.0, -1.0] {
                let mut axis = DVector::zeros(6);
                axis[k] = side;
                points.push(axis);
            }
        }
        let hull = Hull::new(&points).expect("a hull");
        assert_eq!(hull.facets().count(), 64);
        assert!((hull.volume() - 64.0 / 720.0).abs() < 1e-12);
        for facet in hull.facets() {
            assert!((facet.offset - 1.0 / 6f64.sqrt()).abs() < 1e-12);
        }
    }

    #[test]
    fn all_points_are_inside_and_growing_is_as_building() {
        // A spiral without any symmetry.
        let points: Vec<DVector<f64>> = (0..60)
            .map(|i| {
                DVector::from_fn(4, |k, _| {
                    ((i * (k + 2)) as f64 * 0.7 + k as f64).sin() * (1.0 + 0.01 * i as f64)
                })
            })
            .collect();
        let whole = Hull::new(&points).expect("a hull");
        let mut grown = Hull::new(&points[..20]).expect("a hull");
        for point in &points[20..] {
            grown.add(point.clone()).expect("a hull");
        }
        assert!((whole.volume() - grown.volume()).abs() < 1e-12 * whole.volume());
        for facet in whole.facets() {
            assert!(points.iter().all(|p| facet.normal.dot(p) < facet.offset + 1e-9));
        }
    }

    #[test]
    fn the_number_of_computed_facets_is_limited() {
        let cube = all(6, |i, k| f64::from(u8::from(i >> k & 1 == 1)));
        let whole = Hull::new(&cube).expect("a hull");
        assert!(whole.computed > whole.facets().count() && whole.facets.len() < whole.computed);
        assert!(Hull::within(&cube, whole.computed).is_ok());
        assert_eq!(Hull::within(&cube, whole.computed - 1).map(|_| ()), Err(NoHull::TooLarge));
    }

    #[test]
    fn points_in_a_plane_have_no_hull() {
        let flat = [
            point(&[0.0, 0.0, 1.0]),
            point(&[1.0, 0.0, 1.0]),
            point(&[0.0, 1.0, 1.0]),
            point(&[1.0, 1.0, 1.0]),
        ];
        assert_eq!(Hull::new(&flat).map(|_| ()), Err(NoHull::Flat));
    }
}
