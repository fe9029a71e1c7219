//! Inverse kinematics: where base and fingers are, for points of links to be at places.
//!
//! Levenberg (1944) and Marquardt (1963): each step solves `(JᵀJ + μ diag(JᵀJ)) δ = Jᵀ (p* − p)`, keeps what stays within its range, and
//! is taken if it brings the points nearer; μ shrinks after a step that does and grows after one that does not. What is at the end of
//! its range and would leave it is held there, and the step solved without it (Bertsekas 1982).
//!
//! A method of slopes can stop beside the best. So postures all over the motors' ranges (Halton 1960) are tried after the start: each
//! with the base that brings its points nearest (Kabsch 1976), the nearest first.

use crate::equilibrium::own_frame;
use nalgebra::{DMatrix, DVector, Matrix3};
use palmares_models::hand::Hand;
use palmares_models::{Mat3, Pose, Rotation, Vec3};
use palmares_sim::Config;
use palmares_sim::dynamics::tree::Kinematics;
use palmares_sim::statics::prediction::solve_loaded;

/// A point of a link, in the frame of its URDF link, m.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct LinkPoint {
    /// Index of the link.
    pub link: usize,
    /// The point.
    pub point: Vec3,
}

/// The parts that move to bring the points to their places.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Along {
    /// Every joint within its range: what fingers reach that are moved from outside.
    Joints,
    /// The motors, with the free hand at rest: what it reaches by itself.
    Motors,
}

/// A problem of inverse kinematics.
#[derive(Clone, Debug)]
pub struct Inverse {
    /// The points.
    pub points: Vec<LinkPoint>,
    /// The parts that move beside the base.
    pub along: Along,
    /// Whether the base moves.
    pub base_moves: bool,
}

/// Where base and fingers are.
#[derive(Clone, Debug, PartialEq)]
pub struct Reached {
    /// Pose of the base.
    pub base: Pose,
    /// Joint coordinates.
    pub q: Vec<f64>,
    /// σ of every motor; as at the start with [`Along::Joints`].
    pub sigma: Vec<f64>,
    /// Distance of each point from its place, m; infinite if the hand has no equilibrium at any posture that was tried.
    pub gaps: Vec<f64>,
}

impl Reached {
    /// Whether every point is at its place.
    fn is_there(&self) -> bool {
        self.gaps.iter().all(|gap| *gap < THERE_M)
    }

    fn error(&self) -> f64 {
        self.gaps.iter().map(|gap| gap * gap).sum()
    }
}

/// Most steps from a start.
const STEPS: usize = 100;
/// A point is at its place within this, m.
const THERE_M: f64 = 1e-7;
/// It ends where a step changes the root mean square of the gaps by less, m.
const STILL_M: f64 = 1e-12;
/// It is stuck where this number of steps in a row gain less than this part of what is left.
const STUCK: (usize, f64) = (4, 0.01);
/// Difference of coordinates, rad or m, and of σ, for derivatives.
const DIFFERENCE: f64 = 1e-6;
/// First, least and largest μ.
const DAMPING: [f64; 3] = [1e-3, 1e-12, 1e12];
/// Rounds for a goal that the start does not reach, the postures that each looks at, and those of them from which it solves.
const ROUNDS: (usize, usize, usize) = (5, 12, 4);
/// Bases of Halton's sequence; motors beyond these repeat them.
const PRIMES: [u32; 12] = [2, 3, 5, 7, 11, 13, 17, 19, 23, 29, 31, 37];

impl Inverse {
    /// Brings the points as near to `places`, in the world, as it can: from `base` and `sigma`, then from other postures.
    pub fn solve(&self, config: &Config, hand: &Hand, places: &[Vec3], base: Pose, sigma: &[f64]) -> Reached {
        let ranges: Vec<[f64; 2]> = match self.along {
            Along::Joints => hand.coordinates.iter().map(|c| [c.lower, c.upper]).collect(),
            Along::Motors => vec![[0.0, 1.0]; sigma.len()],
        };
        let goal = Goal { inverse: self, config, hand, places, ranges: &ranges };
        let start = goal.posture(base, sigma);
        let mut best = Reached {
            base,
            q: start
                .as_ref()
                .map_or_else(|| hand.coordinates.iter().map(|c| c.rest).collect(), |now| now.q.clone()),
            sigma: sigma.to_vec(),
            gaps: vec![f64::INFINITY; places.len()],
        };
        let mut try_from = |now: Now| {
            let found = goal.descend(now, sigma);
            if found.error() < best.error() {
                best = found;
            }
            best.is_there()
        };
        // From where it is, so that a goal nearby is reached by a small motion.
        if start.as_ref().is_some_and(|start| try_from(goal.centred(start))) {
            return best;
        }
        for round in 0..ROUNDS.0 {
            let draws = (round * ROUNDS.1..(round + 1) * ROUNDS.1).map(|k| spread(k, sigma.len()));
            let drawn = draws.filter_map(|sigma| goal.posture(base, &sigma));
            let mut others: Vec<(f64, Now)> = drawn
                .map(|now| goal.aligned(&now))
                .map(|now| (goal.errors(&now).norm_squared(), now))
                .collect();
            others.sort_by(|(a, _), (b, _)| a.total_cmp(b));
            if others.into_iter().take(ROUNDS.2).any(|(_, now)| try_from(now)) {
                break;
            }
        }
        best
    }
}

/// A posture somewhere in the motors' ranges: the k-th of Halton's sequence, the first two at the ends.
fn spread(k: usize, motors: usize) -> Vec<f64> {
    let digit = |prime: u32| {
        let (mut rest, mut scale, mut sum) = (k as u32 - 1, 1.0, 0.0);
        while rest > 0 {
            scale /= f64::from(prime);
            sum += scale * f64::from(rest % prime);
            rest /= prime;
        }
        sum
    };
    match k {
        0 => vec![0.0; motors],
        1 => vec![1.0; motors],
        _ => (0..motors).map(|m| digit(PRIMES[m % PRIMES.len()])).collect(),
    }
}

/// A goal of a hand.
struct Goal<'a> {
    inverse: &'a Inverse,
    config: &'a Config,
    hand: &'a Hand,
    places: &'a [Vec3],
    ranges: &'a [[f64; 2]],
}

/// An iterate: the base, what moves beside it, the joint coordinates, and the points in the base's frame.
#[derive(Clone)]
struct Now {
    base: Pose,
    moved: Vec<f64>,
    q: Vec<f64>,
    points: Vec<Vec3>,
}

impl Now {
    fn in_world(&self) -> Vec<Vec3> {
        self.points.iter().map(|point| self.base.transform_point(*point)).collect()
    }
}

impl Goal<'_> {
    /// Where the free hand rests; none if it has no equilibrium.
    fn rest(&self, base: Pose, sigma: &[f64]) -> Option<Vec<f64>> {
        Some(solve_loaded(self.config, self.hand, base, sigma, &[]).ok()?.q)
    }

    fn posture(&self, base: Pose, sigma: &[f64]) -> Option<Now> {
        let q = self.rest(base, sigma)?;
        let moved = if self.inverse.along == Along::Joints { q.clone() } else { sigma.to_vec() };
        Some(self.at(base, moved, q))
    }

    fn at(&self, base: Pose, moved: Vec<f64>, q: Vec<f64>) -> Now {
        let mut kin = Kinematics::default();
        kin.update(self.hand, Pose::IDENTITY, &q);
        let point = |it: &LinkPoint| own_frame(self.hand, &kin, it.link).transform_point(it.point);
        let points = self.inverse.points.iter().map(point).collect();
        Now { base, moved, q, points }
    }

    fn q_of(&self, base: Pose, moved: &[f64]) -> Option<Vec<f64>> {
        match self.inverse.along {
            Along::Joints => Some(moved.to_vec()),
            Along::Motors => self.rest(base, moved),
        }
    }

    /// The same with the middle of the points at that of the places, if the base moves.
    fn centred(&self, now: &Now) -> Now {
        let mut next = now.clone();
        if self.inverse.base_moves {
            next.base.translation += middle(self.places) - middle(&now.in_world());
        }
        next
    }

    /// The same with the base that brings the points nearest to their places, if it moves.
    fn aligned(&self, now: &Now) -> Now {
        let mut next = now.clone();
        if self.inverse.base_moves {
            let points = now.in_world();
            let turn = turn(&points, self.places);
            next.base.rotation = (turn * now.base.rotation).normalize();
            next.base.translation = middle(self.places) + turn * (now.base.translation - middle(&points));
        }
        next
    }

    /// The steps from one start. What the points do as the motors move is measured at the start, and corrected by what each step
    /// does (Broyden 1965); it is measured again where no step brings them nearer.
    fn descend(&self, mut now: Now, sigma: &[f64]) -> Reached {
        let mut errors = self.errors(&now);
        let mut damping = DAMPING[0];
        let mut idle = 0;
        let mut slopes = self.slopes(&now);
        let mut measured = true;
        for _ in 0..STEPS {
            let Some(known) = &mut slopes else { break };
            let mut nearer = None;
            loop {
                let step = self.step(&now, &self.jacobian(&now, known), &errors, damping);
                // A posture without an equilibrium is no way.
                let next =
                    step.and_then(|step| self.moved(&now, &step)).map(|next| (self.errors(&next), next));
                if let Some((after, next)) = next {
                    correct(known, &now, &next);
                    if after.norm_squared() < errors.norm_squared() {
                        nearer = Some((after, next));
                        break;
                    }
                }
                if !measured {
                    break;
                }
                damping *= 5.0;
                if damping > DAMPING[2] {
                    break;
                }
            }
            let Some((after, next)) = nearer else {
                if measured {
                    break;
                }
                (slopes, measured) = (self.slopes(&now), true);
                continue;
            };
            damping = (0.2 * damping).max(DAMPING[1]);
            let gain = errors.norm() - after.norm();
            idle = if gain < STUCK.1 * errors.norm() { idle + 1 } else { 0 };
            (now, errors, measured) = (next, after, false);
            let count = self.places.len().max(1) as f64;
            if errors.norm() < STILL_M * count.sqrt()
                || (gain < STILL_M * count.sqrt() && measured)
                || idle >= STUCK.0
            {
                break;
            }
        }
        let gaps = errors.as_slice().chunks(3).map(|e| Vec3::new(e[0], e[1], e[2]).length()).collect();
        let sigma = if self.inverse.along == Along::Motors { now.moved } else { sigma.to_vec() };
        Reached { base: now.base, q: now.q, sigma, gaps }
    }

    /// A damped step, in which nothing leaves the end of its range.
    fn step(
        &self,
        now: &Now,
        jacobian: &DMatrix<f64>,
        errors: &DVector<f64>,
        damping: f64,
    ) -> Option<DVector<f64>> {
        let first = jacobian.ncols() - now.moved.len();
        let mut jacobian = jacobian.clone();
        loop {
            let (mut square, slope) = (jacobian.transpose() * &jacobian, jacobian.transpose() * errors);
            for k in 0..square.nrows() {
                // Columns of nothing stay where they are.
                square[(k, k)] += damping * square[(k, k)] + 1e-12;
            }
            let step = square.cholesky()?.solve(&slope);
            let leaves = |k: &usize| {
                let ([low, high], x, dx) = (self.ranges[*k], now.moved[*k], step[first + k]);
                (x <= low && dx < 0.0) || (x >= high && dx > 0.0)
            };
            let outward: Vec<usize> = (0..now.moved.len()).filter(leaves).collect();
            if outward.is_empty() {
                return Some(step);
            }
            outward.iter().for_each(|k| jacobian.column_mut(first + k).fill(0.0));
        }
    }

    /// From each point to its place.
    fn errors(&self, now: &Now) -> DVector<f64> {
        let all = now
            .in_world()
            .into_iter()
            .zip(self.places)
            .flat_map(|(point, place)| (*place - point).to_array());
        DVector::from_iterator(3 * self.places.len(), all)
    }

    /// Change of the points in the base's frame with what moves beside the base.
    fn slopes(&self, now: &Now) -> Option<DMatrix<f64>> {
        let mut slopes = DMatrix::zeros(3 * now.points.len(), now.moved.len());
        for (k, [low, high]) in self.ranges.iter().enumerate() {
            let mut moved = now.moved.clone();
            // Inward at the upper end.
            moved[k] += if now.moved[k] + DIFFERENCE > *high { -DIFFERENCE } else { DIFFERENCE };
            if moved[k] < *low {
                continue;
            }
            let by = moved[k] - now.moved[k];
            let q = self.q_of(now.base, &moved)?;
            let there = self.at(now.base, moved, q);
            for (row, change) in changes(now, &there).enumerate() {
                slopes[(row, k)] = change / by;
            }
        }
        Some(slopes)
    }

    /// Change of the points with the base's place and turn, if it moves, then with what else moves.
    fn jacobian(&self, now: &Now, slopes: &DMatrix<f64>) -> DMatrix<f64> {
        let first = if self.inverse.base_moves { 6 } else { 0 };
        let mut jacobian = DMatrix::zeros(slopes.nrows(), first + slopes.ncols());
        if self.inverse.base_moves {
            for (k, point) in now.in_world().iter().enumerate() {
                for (column, axis) in [Vec3::X, Vec3::Y, Vec3::Z].into_iter().enumerate() {
                    let turned = axis.cross(*point - now.base.translation);
                    for row in 0..3 {
                        jacobian[(3 * k + row, column)] = axis[row];
                        jacobian[(3 * k + row, 3 + column)] = turned[row];
                    }
                }
            }
        }
        for k in 0..slopes.ncols() {
            for point in 0..now.points.len() {
                let of = |row: usize| slopes[(3 * point + row, k)];
                let turned = now.base.rotation * Vec3::new(of(0), of(1), of(2));
                for row in 0..3 {
                    jacobian[(3 * point + row, first + k)] = turned[row];
                }
            }
        }
        jacobian
    }

    fn moved(&self, now: &Now, step: &DVector<f64>) -> Option<Now> {
        let first = step.len() - now.moved.len();
        let mut base = now.base;
        if self.inverse.base_moves {
            base.translation += Vec3::new(step[0], step[1], step[2]);
            let turn = Rotation::from_scaled_axis(Vec3::new(step[3], step[4], step[5]));
            base.rotation = (turn * base.rotation).normalize();
        }
        let within =
            |(k, (x, [low, high])): (usize, (&f64, &[f64; 2]))| (x + step[first + k]).clamp(*low, *high);
        let moved: Vec<f64> = now.moved.iter().zip(self.ranges).enumerate().map(within).collect();
        let q = self.q_of(base, &moved)?;
        Some(self.at(base, moved, q))
    }
}

/// Change of the points in the base's frame.
fn changes(from: &Now, to: &Now) -> impl Iterator<Item = f64> {
    let all = from.points.iter().zip(&to.points).flat_map(|(from, to)| (*to - *from).to_array());
    all.collect::<Vec<_>>().into_iter()
}

/// Makes slopes give the change that was seen: `S += (Δp − S Δx) Δxᵀ / ΔxᵀΔx`.
fn correct(slopes: &mut DMatrix<f64>, from: &Now, to: &Now) {
    let by = DVector::from_iterator(
        from.moved.len(),
        from.moved.iter().zip(&to.moved).map(|(from, to)| to - from),
    );
    let square = by.norm_squared();
    if square == 0.0 {
        return;
    }
    let seen = DVector::from_iterator(slopes.nrows(), changes(from, to));
    let off = (seen - &*slopes * &by) / square;
    *slopes += off * by.transpose();
}

fn middle(points: &[Vec3]) -> Vec3 {
    points.iter().copied().sum::<Vec3>() / points.len().max(1) as f64
}

/// The rotation about the middle that brings points nearest to places; of two points the smallest one.
fn turn(points: &[Vec3], places: &[Vec3]) -> Rotation {
    let (from, to) = (middle(points), middle(places));
    if let ([a, b], [c, d]) = (points, places) {
        let directions = [*b - *a, *d - *c].map(|v| v.normalize_or_zero());
        let there = directions.iter().all(|v| *v != Vec3::ZERO);
        return if there {
            Rotation::from_rotation_arc(directions[0], directions[1])
        } else {
            Rotation::IDENTITY
        };
    }
    let mut sum = Matrix3::zeros();
    for (point, place) in points.iter().zip(places) {
        let (a, b) = (*point - from, *place - to);
        sum += nalgebra::Vector3::new(a.x, a.y, a.z) * nalgebra::RowVector3::new(b.x, b.y, b.z);
    }
    let svd = sum.svd(true, true);
    let (Some(u), Some(v_t)) = (svd.u, svd.v_t) else { return Rotation::IDENTITY };
    let v = v_t.transpose();
    let mut mirror = Matrix3::identity();
    if (v * u.transpose()).determinant() < 0.0 {
        let least = svd.singular_values.imin();
        mirror[(least, least)] = -1.0;
    }
    let r = v * mirror * u.transpose();
    let column = |k: usize| Vec3::new(r[(0, k)], r[(1, k)], r[(2, k)]);
    Rotation::from_mat3(&Mat3::from_cols(column(0), column(1), column(2))).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::sync::Arc;

    fn tips(hand: &Hand) -> Vec<LinkPoint> {
        let carries = |k: usize| hand.links.iter().any(|link| link.parent == Some(k));
        let ends = (0..hand.links.len()).filter(|k| !carries(*k));
        ends.map(|link| LinkPoint { link, point: Vec3::new(0.0, 0.005, 0.01) }).collect()
    }

    fn hands<const N: usize>(names: [&str; N]) -> Vec<Arc<Hand>> {
        names.map(|name| Hand::builtin(name).expect("built in")).into()
    }

    /// Where the points of the free hand are.
    fn places(hand: &Hand, points: &[LinkPoint], base: Pose, sigma: &[f64]) -> Vec<Vec3> {
        let q = solve_loaded(&Config::default(), hand, base, sigma, &[]).expect("at rest").q;
        let inverse = Inverse { points: points.to_vec(), along: Along::Motors, base_moves: true };
        Goal { inverse: &inverse, config: &Config::default(), hand, places: &[], ranges: &[] }
            .at(base, Vec::new(), q)
            .in_world()
    }

    #[test]
    fn the_motors_and_the_base_bring_the_tips_where_they_were() {
        let config = Config::default();
        for hand in hands(["softhand", "reflex", "yale_t42"]) {
            let inverse = Inverse { points: tips(&hand), along: Along::Motors, base_moves: true };
            let there = Pose::from_parts(
                Vec3::new(0.2, -0.1, 0.4),
                Rotation::from_scaled_axis(Vec3::new(0.3, -0.2, 0.5)),
            );
            let goal = places(&hand, &inverse.points, there, &vec![0.45; hand.motors.len()]);
            let start = vec![0.2; hand.motors.len()];
            let found = inverse.solve(&config, &hand, &goal, Pose::IDENTITY, &start);
            assert!(found.gaps.iter().all(|gap| *gap < 1e-6), "{}: {:?}", hand.name, found.gaps);
        }
    }

    #[test]
    fn what_the_free_hand_reaches_is_found_wherever_it_is() {
        let config = Config::default();
        for hand in hands(["softhand", "softhand2", "reflex", "leap", "barrett_bh282"]) {
            let (tips, motors) = (tips(&hand), hand.motors.len());
            for k in 0..12 {
                let points = vec![tips[k % tips.len()], tips[(k + 1) % tips.len()]];
                let inverse = Inverse { points, along: Along::Motors, base_moves: true };
                let sigma = spread(k, motors);
                let goal = places(&hand, &inverse.points, Pose::IDENTITY, &sigma);
                for far in [Vec3::ZERO, Vec3::new(0.1, -0.4, 0.3)] {
                    let goal: Vec<Vec3> = goal.iter().map(|place| *place + far).collect();
                    let found = inverse.solve(&config, &hand, &goal, Pose::IDENTITY, &vec![0.5; motors]);
                    assert!(
                        found.gaps.iter().all(|gap| *gap < 1e-6),
                        "{} at {sigma:?}: {:?}",
                        hand.name,
                        found.gaps
                    );
                }
            }
        }
    }

    #[test]
    fn joints_stay_in_their_ranges_and_what_is_out_of_reach_has_a_gap() {
        let config = Config::default();
        for hand in hands(["softhand", "reflex", "yale_t42"]) {
            let inverse = Inverse { points: tips(&hand), along: Along::Joints, base_moves: false };
            let q: Vec<f64> =
                hand.coordinates.iter().map(|c| (c.rest + 0.3).clamp(c.lower, c.upper)).collect();
            let reach = Goal { inverse: &inverse, config: &config, hand: &hand, places: &[], ranges: &[] };
            let goal = reach.at(Pose::IDENTITY, Vec::new(), q).in_world();
            let start = vec![0.1; hand.motors.len()];
            let found = inverse.solve(&config, &hand, &goal, Pose::IDENTITY, &start);
            assert!(found.gaps.iter().all(|gap| *gap < 1e-6), "{}: {:?}", hand.name, found.gaps);
            let far: Vec<Vec3> = goal.iter().map(|place| *place + Vec3::Z).collect();
            let found = inverse.solve(&config, &hand, &far, Pose::IDENTITY, &start);
            assert!(found.gaps.iter().all(|gap| *gap > 0.5));
            for (q, c) in found.q.iter().zip(&hand.coordinates) {
                assert!((c.lower..=c.upper).contains(q));
            }
        }
    }

    #[test]
    fn a_hand_that_never_rests_has_infinite_gaps() {
        let mut hand = (*Hand::builtin("pinch").expect("built in")).clone();
        // Nothing holds its joints.
        hand.tendons.clear();
        hand.coordinates.iter_mut().for_each(|c| c.stiffness = 0.0);
        let inverse = Inverse { points: tips(&hand), along: Along::Motors, base_moves: true };
        let goal = vec![Vec3::ZERO; inverse.points.len()];
        let start = vec![0.5; hand.motors.len()];
        let found = inverse.solve(&Config::default(), &hand, &goal, Pose::IDENTITY, &start);
        assert!(found.gaps.iter().all(|gap| gap.is_infinite()), "{:?}", found.gaps);
    }

    #[test]
    fn points_are_turned_to_their_places() {
        let points = [Vec3::ZERO, Vec3::X, Vec3::new(0.2, 0.7, 0.1), Vec3::new(-0.3, 0.1, 0.5)];
        let whole = Rotation::from_scaled_axis(Vec3::new(0.5, -2.0, 1.0));
        for count in 1..=points.len() {
            let places: Vec<Vec3> = points[..count].iter().map(|p| whole * *p + Vec3::Y).collect();
            let turn = turn(&points[..count], &places);
            let off = |(p, place): (&Vec3, &Vec3)| {
                (turn * (*p - middle(&points[..count])) - (*place - middle(&places))).length()
            };
            assert!(points.iter().zip(&places).map(off).all(|off| off < 1e-12), "{count}");
        }
    }
}
