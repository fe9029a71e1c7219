//! Length of a tendon over its joints: exact, and as a sum of functions of one joint each.

use nalgebra::{DMatrix, DVector};
use palmares_models::{Pose, Vec3};

use super::model::{GeomShape, JointKind, Model, Path, Tendon, Way};
use super::motions::{Motion, Motions};
use super::wrap::{Round, length as wrapped};

/// Poses at which a spatial tendon is measured.
const SAMPLES: usize = 300;
/// Highest power of a joint in a fitted length.
const DEGREE: usize = 7;
/// Error of a fit that counts as exact, m.
const EXACT: f64 = 1e-6;
/// Range of a joint that has no limits, rad or m.
const UNLIMITED: f64 = 1.5;

/// A tendon's length as a constant and a polynomial of each joint's position from its reference.
#[derive(Clone, Debug, PartialEq)]
pub(crate) struct Fit {
    pub(crate) constant: f64,
    /// Joint and coefficients of x, x², …
    pub(crate) terms: Vec<(usize, Vec<f64>)>,
    /// Largest difference at the measured poses.
    pub(crate) error: f64,
    /// Largest minus smallest measured length.
    pub(crate) stroke: f64,
}

impl Fit {
    /// Whether each joint has a constant moment arm.
    pub(crate) fn is_linear(&self) -> bool {
        self.terms.iter().all(|(_, c)| c.len() == 1)
    }
}

/// Length at joint positions from their references.
pub(crate) fn length(model: &Model, tendon: &Tendon, x: &[f64]) -> f64 {
    match &tendon.path {
        Path::Fixed(joints) => joints.iter().map(|&(j, c)| c * (x[j] + model.joints[j].reference)).sum(),
        Path::Spatial(ways) => spatial(model, ways, &model.world_from_bodies(x)),
    }
}

/// Moment arms on hinges and slides, each by itself, in the start pose.
pub(crate) fn arms_at_start(model: &Model, tendon: &Tendon) -> Vec<(usize, f64)> {
    const STEP: f64 = 1e-6;
    let mut x = vec![0.0; model.joints.len()];
    let moves = |joint: &usize| matches!(model.joints[*joint].kind, JointKind::Hinge | JointKind::Slide);
    let mut joints: Vec<usize> = match &tendon.path {
        Path::Fixed(joints) => return joints.clone(),
        Path::Spatial(ways) => passed(model, ways).into_iter().filter(moves).collect(),
    };
    joints.dedup();
    let mut arm = |joint: usize| {
        let mut at = |step: f64| {
            x[joint] = step;
            length(model, tendon, &x)
        };
        let arm = (at(STEP) - at(-STEP)) / (2.0 * STEP);
        x[joint] = 0.0;
        (joint, arm)
    };
    joints.into_iter().map(&mut arm).collect()
}

fn spatial(model: &Model, ways: &[Way], poses: &[Pose]) -> f64 {
    let site = |s: usize| poses[model.sites[s].body] * model.sites[s].pose.translation;
    let (mut sum, mut divisor) = (0.0, 1.0);
    let mut last: Option<Vec3> = None;
    let mut around: Option<(usize, Option<usize>)> = None;
    for way in ways {
        match *way {
            Way::Pulley(by) => (divisor, last, around) = (by, None, None),
            Way::Wrap(geom, side) => around = Some((geom, side)),
            Way::Site(s) => {
                let at = site(s);
                if let Some(from) = last {
                    let geom = around.map(|(geom, side)| (&model.geoms[geom], side.map(site)));
                    let round = geom.and_then(|(geom, side)| {
                        let round = match geom.shape {
                            GeomShape::Sphere(r) => Round::Ball(r),
                            GeomShape::Cylinder(r, _) => Round::Cylinder(r),
                            _ => return None,
                        };
                        Some((round, poses[geom.body] * geom.pose, side))
                    });
                    sum += match round {
                        Some((round, pose, side)) => wrapped(from, at, round, &pose, side),
                        None => (at - from).length(),
                    } / divisor;
                }
                (last, around) = (Some(at), None);
            }
        }
    }
    sum
}

/// Joints that change the length, ascending.
fn passed(model: &Model, ways: &[Way]) -> Vec<usize> {
    let body = |way: &Way| match *way {
        Way::Site(s) => Some(model.sites[s].body),
        Way::Wrap(g, _) => Some(model.geoms[g].body),
        Way::Pulley(_) => None,
    };
    let mut found: Vec<usize> = Vec::new();
    for pair in ways.windows(2) {
        let (Some(a), Some(b)) = (body(&pair[0]), body(&pair[1])) else { continue };
        let (a, b) = (model.chain(a), model.chain(b));
        // Joints that move both do not change the distance.
        found.extend(a.iter().filter(|j| !b.contains(j)).chain(b.iter().filter(|j| !a.contains(j))));
    }
    found.sort_unstable();
    found.dedup();
    found
}

/// Joints that change the length and move by themselves.
fn joints(model: &Model, motions: &Motions, ways: &[Way]) -> Vec<usize> {
    let own = |joint: &usize| match motions.joint(*joint) {
        Motion::Own => Some(*joint),
        Motion::Held(_) => None,
        Motion::Follows(leader, _) => Some(*leader),
    };
    let mut found: Vec<usize> = passed(model, ways).iter().filter_map(own).collect();
    found.sort_unstable();
    found.dedup();
    found
}

/// Length over the range of its joints, as a sum of polynomials of one joint each: linear where that is exact, else by least
/// squares with the error said. A joint that follows another counts for its leader.
pub(crate) fn fit(model: &Model, motions: &Motions, tendon: &Tendon) -> Fit {
    let ways = match &tendon.path {
        Path::Fixed(all) => return fixed(model, motions, tendon, all),
        Path::Spatial(ways) => ways,
    };
    let joints = joints(model, motions, ways);
    let ranges: Vec<[f64; 2]> =
        joints.iter().map(|&j| motions.range(model, j).unwrap_or([-UNLIMITED, UNLIMITED])).collect();
    let mut rows = Vec::with_capacity(SAMPLES);
    let mut x = vec![0.0; model.joints.len()];
    for k in 0..SAMPLES {
        for (d, (&j, [low, high])) in joints.iter().zip(&ranges).enumerate() {
            x[j] = low + (high - low) * fraction(k, d);
        }
        motions.fill(&mut x);
        rows.push((joints.iter().map(|&j| x[j]).collect::<Vec<f64>>(), length(model, tendon, &x)));
    }
    let (low, high) = rows.iter().fold((f64::MAX, f64::MIN), |(l, h), row| (l.min(row.1), h.max(row.1)));
    let stroke = high - low;
    let mut best: Option<Fit> = None;
    for degree in 1..=DEGREE {
        let fit = least_squares(&joints, &ranges, &rows, degree, stroke);
        let better = best.as_ref().is_none_or(|best| fit.error < 0.7 * best.error);
        if better {
            best = Some(fit);
        }
        if best.as_ref().is_some_and(|best| best.error < EXACT.max(1e-3 * stroke)) {
            break;
        }
    }
    best.unwrap_or(Fit { constant: 0.0, terms: Vec::new(), error: 0.0, stroke })
}

/// A sum of joints: exact, in the order in which it names the joints that move.
fn fixed(model: &Model, motions: &Motions, tendon: &Tendon, all: &[(usize, f64)]) -> Fit {
    let mut terms: Vec<(usize, Vec<f64>)> = Vec::new();
    for &(joint, factor) in all {
        let (joint, law) = match motions.joint(joint) {
            Motion::Own => (joint, vec![factor]),
            Motion::Follows(leader, law) if factor != 0.0 => {
                (*leader, law[1..].iter().map(|c| factor * c).collect())
            }
            _ => continue,
        };
        match terms.iter_mut().find(|(other, _)| *other == joint) {
            Some((_, sum)) => {
                sum.resize(sum.len().max(law.len()), 0.0);
                sum.iter_mut().zip(&law).for_each(|(sum, c)| *sum += c);
            }
            None => terms.push((joint, law)),
        }
    }
    let mut x = vec![0.0; model.joints.len()];
    motions.fill(&mut x);
    Fit { constant: length(model, tendon, &x), terms, error: 0.0, stroke: 0.0 }
}

/// Evenly spread numbers in 0..1, one sequence a joint (multiples of the inverses of the generalised golden ratio), and the corners
/// of the range first.
fn fraction(k: usize, joint: usize) -> f64 {
    if k < 64 && joint < 6 {
        return ((k >> joint) & 1) as f64;
    }
    // Root of x^(d+1) = x + 1 for d = 8.
    const PHI: f64 = 1.085_070_245_491_450_8;
    (0.5 + k as f64 / PHI.powi(joint as i32 + 1)).rem_euclid(1.0)
}

fn least_squares(
    joints: &[usize],
    ranges: &[[f64; 2]],
    rows: &[(Vec<f64>, f64)],
    degree: usize,
    stroke: f64,
) -> Fit {
    // Powers of a position divided by the joint's largest, so that the columns have one size.
    let unit: Vec<f64> = ranges.iter().map(|r| r[0].abs().max(r[1].abs()).max(1e-9)).collect();
    let columns = 1 + joints.len() * degree;
    let matrix = DMatrix::from_fn(rows.len(), columns, |row, column| {
        if column == 0 {
            return 1.0;
        }
        let (joint, power) = ((column - 1) / degree, (column - 1) % degree + 1);
        (rows[row].0[joint] / unit[joint]).powi(power as i32)
    });
    let wanted = DVector::from_iterator(rows.len(), rows.iter().map(|row| row.1));
    let solved = matrix.clone().svd(true, true).solve(&wanted, 1e-12);
    let Ok(solution) = solved else {
        return Fit { constant: 0.0, terms: Vec::new(), error: f64::MAX, stroke };
    };
    let error = (&matrix * &solution - &wanted).amax();
    let mut terms = Vec::new();
    for (k, &joint) in joints.iter().enumerate() {
        let of = |power: usize| solution[1 + k * degree + power - 1] / unit[k].powi(power as i32);
        let mut coefficients: Vec<f64> = (1..=degree).map(of).collect();
        // A joint whose whole part of the length is below the exactness does not move the tendon.
        let reach = |c: &f64, power: usize| (c * unit[k].powi(power as i32)).abs();
        while coefficients.last().is_some_and(|c| reach(c, coefficients.len()) < 1e-3 * EXACT) {
            coefficients.pop();
        }
        if !coefficients.is_empty() {
            terms.push((joint, coefficients));
        }
    }
    Fit { constant: solution[0], terms, error, stroke }
}
