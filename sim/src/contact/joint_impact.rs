//! Impulses of points that meet at one time.
//!
//! Frictionless points i approach at `uᵢ⁻ < 0`, with coefficients of restitution eᵢ. Their impulses p solve
//!
//! `0 ≤ p ⊥ G p + (1 + e) u⁻ ≥ 0`,  `Gᵢⱼ` the change of `uᵢ` per impulse `pⱼ`:
//!
//! every point ends at `−eᵢ uᵢ⁻` at least, and pushes only if it ends exactly there. With e = 1 this reflects the velocities over those
//! of a plastic impact (generalized reflections: Smith, Kaufman, Vouga, Tamstorf, Grinspun 2012). The kinetic energy changes by
//! `½ Σ pᵢ (1 − eᵢ) uᵢ⁻ ≤ 0`. G is positive semidefinite, so that the velocities after the impact are unique: they depend on no order
//! of points or bodies, and the mirror of a scene has their mirror. Of one point that approaches among several in touch, this is the
//! impact of two bodies, and the next impacts follow from its velocities.

use super::impact_candidate::{FIXED, ImpactBody, ImpactCandidate};

/// Part of its diagonal that is added to G: more points may press than bodies have freedoms, and G is singular then. A step of
/// refinement removes the effect on velocities.
const REGULAR: f64 = 1e-11;

/// Impulses and velocities of the wrong sign up to this part of the fastest are rounding.
const ROUNDING: f64 = 1e-12;

/// Number of exchanges of all wrong points without fewer of them, after which one point at a time is exchanged.
const PATIENCE: usize = 5;

/// Largest number of exchanges for each point.
const MAX_EXCHANGES: usize = 8;

/// Solver of the impulses, by block principal pivoting (Júdice and Pires 1994); its scratch memory.
#[derive(Clone, Debug, Default)]
pub(super) struct JointImpact {
    /// G by rows.
    matrix: Vec<f64>,
    /// `−(1 + e) u⁻`, m/s.
    missing: Vec<f64>,
    /// p, N s.
    impulse: Vec<f64>,
    /// Points that push.
    pushing: Vec<usize>,
    pushes: Vec<bool>,
    /// Cholesky factor of the pushing points' part of G, by rows.
    factor: Vec<f64>,
    rest: Vec<f64>,
    wrong: Vec<usize>,
}

impl JointImpact {
    /// Impulses, N s, of the `points` among `candidates`, which all meet at `time`. The computing is added to `work`; none are found
    /// beyond `allowed`.
    pub(super) fn solve(
        &mut self,
        bodies: &[ImpactBody],
        candidates: &[ImpactCandidate],
        points: &[usize],
        time: f64,
        (work, allowed): (&mut u64, u64),
    ) -> Option<&[f64]> {
        let n = points.len();
        self.missing.clear();
        self.missing.extend(points.iter().map(|&k| {
            let point = &candidates[k];
            -(1.0 + point.restitution) * point.velocity(bodies, time)
        }));
        if let [k] = points {
            let impulse = self.missing[0] / candidates[*k].inverse_effective_mass;
            self.impulse.clear();
            self.impulse.push(impulse.max(0.0));
            return Some(&self.impulse);
        }
        *work += 20 * (n * n) as u64;
        if *work > allowed {
            return None;
        }
        self.matrix.clear();
        for &i in points {
            self.matrix.extend(points.iter().map(|&j| coupling(bodies, &candidates[i], &candidates[j])));
        }
        self.pushes.clear();
        self.pushes.resize(n, true);
        let fastest = self.missing.iter().copied().fold(0.0, f64::max);
        let (mut fewest, mut patience) = (usize::MAX, PATIENCE);
        for _ in 0..MAX_EXCHANGES * n {
            *work += (n * n * (n + 6) / 6) as u64;
            if *work > allowed {
                return None;
            }
            self.push()?;
            self.find_wrong(ROUNDING * fastest);
            let Some(&last) = self.wrong.last() else {
                self.refine();
                return Some(&self.impulse);
            };
            if self.wrong.len() < fewest {
                (fewest, patience) = (self.wrong.len(), PATIENCE);
            } else {
                patience = patience.saturating_sub(1);
            }
            if patience == 0 {
                self.wrong.clear();
                self.wrong.push(last);
            }
            for &i in &self.wrong {
                self.pushes[i] = !self.pushes[i];
            }
        }
        None
    }

    /// Impulses of the points that push, each of which ends at its velocity.
    fn push(&mut self) -> Option<()> {
        let n = self.missing.len();
        let JointImpact { matrix, missing, impulse, pushing, pushes, factor, rest, .. } = self;
        pushing.clear();
        pushing.extend((0..n).filter(|&i| pushes[i]));
        rest.clear();
        rest.extend(pushing.iter().map(|&i| missing[i]));
        factor.clear();
        for (row, &i) in pushing.iter().enumerate() {
            for (column, &j) in pushing[..=row].iter().enumerate() {
                let of = if i == j { matrix[i * n + i] * (1.0 + REGULAR) } else { matrix[i * n + j] };
                let (above, own) = (at(column), at(row));
                let known: f64 = (0..column).map(|k| factor[own + k] * factor[above + k]).sum();
                let left = of - known;
                let entry = if column < row { left / factor[above + column] } else { left.sqrt() };
                // A diagonal that is not positive.
                if !(column < row || entry > 0.0) {
                    return None;
                }
                factor.push(entry);
            }
        }
        substitute(factor, rest);
        impulse.clear();
        impulse.resize(n, 0.0);
        for (&i, p) in pushing.iter().zip(rest) {
            impulse[i] = *p;
        }
        Some(())
    }

    /// Velocity that a point still misses with the present impulses, m/s.
    fn missed(&self, i: usize) -> f64 {
        let n = self.missing.len();
        let row = &self.matrix[i * n..][..n];
        self.missing[i] - row.iter().zip(&self.impulse).map(|(g, p)| g * p).sum::<f64>()
    }

    /// Points that would pull, or do not push but end too slowly.
    fn find_wrong(&mut self, rounding: f64) {
        let n = self.missing.len();
        let mut wrong = std::mem::take(&mut self.wrong);
        wrong.clear();
        wrong.extend((0..n).filter(|&i| match self.pushes[i] {
            true => self.impulse[i] * self.matrix[i * n + i] < -rounding,
            false => self.missed(i) > rounding,
        }));
        self.wrong = wrong;
    }

    /// A step of refinement, without what was added to G.
    fn refine(&mut self) {
        let mut rest = std::mem::take(&mut self.rest);
        rest.clear();
        rest.extend(self.pushing.iter().map(|&i| self.missed(i)));
        substitute(&self.factor, &mut rest);
        for (&i, p) in self.pushing.iter().zip(&rest) {
            self.impulse[i] = (self.impulse[i] + p).max(0.0);
        }
        self.rest = rest;
    }
}

/// Start of a row of a packed lower triangle.
fn at(row: usize) -> usize {
    row * (row + 1) / 2
}

/// Solves `L Lᵀ x = b` in place of b, with L packed by rows.
fn substitute(factor: &[f64], b: &mut [f64]) {
    let n = b.len();
    for i in 0..n {
        let known: f64 = (0..i).map(|k| factor[at(i) + k] * b[k]).sum();
        b[i] = (b[i] - known) / factor[at(i) + i];
    }
    for i in (0..n).rev() {
        let known: f64 = (i + 1..n).map(|k| factor[at(k) + i] * b[k]).sum();
        b[i] = (b[i] - known) / factor[at(i) + i];
    }
}

/// Change of the normal velocity of a point per impulse of another, 1/kg.
fn coupling(bodies: &[ImpactBody], of: &ImpactCandidate, by: &ImpactCandidate) -> f64 {
    let mut sum = 0.0;
    for (i, &body) in of.bodies.iter().enumerate() {
        for (j, &other) in by.bodies.iter().enumerate() {
            if body != other || body == FIXED {
                continue;
            }
            if let Some(body) = bodies.get(body) {
                let change = of.normal.dot(by.normal) * body.inverse_mass
                    + of.arms[i].cross(of.normal).dot(by.turns[j]);
                sum += if i == j { change } else { -change };
            }
        }
    }
    sum
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_models::{Mat3, Vec3};

    /// Balls of 1 kg with velocities, and pairs of them with normals from the first to the second.
    fn impulses(velocities: &[Vec3], pairs: &[(usize, usize, Vec3)], e: f64) -> (Vec<f64>, Vec<Vec3>) {
        let ball = |v: &Vec3| ImpactBody::new(Vec3::ZERO, 1.0, Mat3::ZERO, [*v, Vec3::ZERO]);
        let mut bodies: Vec<ImpactBody> = velocities.iter().map(ball).collect();
        let candidate = |&(a, b, normal): &(usize, usize, Vec3)| {
            let mut candidate = ImpactCandidate::new([a, b], normal, [Vec3::ZERO; 2], 0.0, 0);
            candidate.restitution = e;
            let free = [a, b].into_iter().filter(|&body| body != FIXED).count();
            candidate.inverse_effective_mass = free as f64;
            candidate
        };
        let candidates: Vec<ImpactCandidate> = pairs.iter().map(candidate).collect();
        let points: Vec<usize> = (0..candidates.len()).collect();
        let (mut joint, mut work) = (JointImpact::default(), 0);
        let found =
            joint.solve(&bodies, &candidates, &points, 0.0, (&mut work, 1_000_000)).expect("solved").to_vec();
        for (candidate, impulse) in candidates.iter().zip(&found) {
            candidate.push(&mut bodies, *impulse);
        }
        (found, bodies.iter().map(|body| body.now[0]).collect())
    }

    /// One ball between two of its mass that touch: it returns with a fifth of its speed, they leave with √12/5.
    #[test]
    fn a_ball_between_two_returns_with_a_fifth() {
        let [up, down] = [0.5, -0.5].map(|y| Vec3::new(0.75f64.sqrt(), y, 0.0));
        for pairs in [[(0, 1, up), (0, 2, down)], [(0, 2, down), (0, 1, up)]] {
            let (_, after) = impulses(&[Vec3::X, Vec3::ZERO, Vec3::ZERO], &pairs, 1.0);
            let exact = [Vec3::X * -0.2, up * (12f64.sqrt() / 5.0), down * (12f64.sqrt() / 5.0)];
            for (found, exact) in after.iter().zip(exact) {
                assert!(found.distance(exact) < 1e-14, "{found} instead of {exact}");
            }
        }
    }

    /// More points than freedoms: three walls that meet in a ridge give a ball the rebound of one.
    #[test]
    fn points_beyond_the_freedoms_share_an_impulse() {
        let walls = [(FIXED, 0, Vec3::Z); 3];
        let (found, after) = impulses(&[Vec3::Z * -1.0], &walls, 0.5);
        assert!((found.iter().sum::<f64>() - 1.5).abs() < 1e-12, "{found:?}");
        assert!(after[0].distance(Vec3::Z * 0.5) < 1e-12, "{}", after[0]);
    }

    /// A point that others push open does not pull.
    #[test]
    fn a_point_that_would_pull_is_left_open() {
        // A ball falls beside a wall that leans over it by little: the floor alone throws it away from the wall.
        let floor = Vec3::new(0.6, 0.0, 0.8);
        let wall = Vec3::new(0.8, 0.0, 0.6);
        let before = Vec3::new(0.7, 0.0, -1.0);
        assert!(before.dot(wall) < 0.0 && before.dot(floor) < 0.0);
        let (found, after) = impulses(&[before], &[(FIXED, 0, wall), (FIXED, 0, floor)], 1.0);
        assert_eq!(found[0], 0.0);
        assert!((after[0].length() - before.length()).abs() < 1e-14, "energy is kept");
        assert!(after[0].dot(wall) > -before.dot(wall), "it leaves the wall faster than by its own rebound");
    }
}
