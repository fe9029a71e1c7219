//! Equilibrium of an unobstructed hand: the closed form of adaptive synergies, and Newton's method where
//! there is none.
//!
//! With constant moment arms and tendons taut, `f = A_s (s − R q₀) + B_s τ_c` and `q = q₀ + C_s (s − R q₀) + D_s τ_c` where
//! `P = (R E⁻¹ Rᵀ + K⁻¹)⁻¹`, `A_s = P`, `B_s = −P R E⁻¹`, `C_s = E⁻¹ Rᵀ P`, `D_s = E⁻¹ − E⁻¹ Rᵀ P R E⁻¹`
//! (Rocchi & Hauser 2016, eqs 4 and 5; K is the tendons' stiffness). E is a matrix: springs across joints add `k r rᵀ` to its diagonal.

use nalgebra::{DMatrix, DVector};
use palmares_models::hand::Hand;

/// The matrices of the closed form for n coordinates and m tendons. Coordinates without springs are refused.
#[derive(Clone, Debug)]
pub struct ClosedForm {
    /// P, m x m.
    pub p: DMatrix<f64>,
    /// C_s, n x m.
    pub c: DMatrix<f64>,
    /// D_s, n x n.
    pub d: DMatrix<f64>,
    /// R, m x n.
    pub r: DMatrix<f64>,
    /// q₀: the joints without tendons and torques.
    pub rest: DVector<f64>,
    /// E⁻¹, n x n.
    pub compliance: DMatrix<f64>,
}

/// Reason why a hand has no closed form.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NoClosedForm {
    /// A coordinate has no spring, so that no unique equilibrium exists.
    #[error("coordinate `{coordinate}` has stiffness {stiffness}; the closed form needs a positive one")]
    NoSpring {
        /// Name of the coordinate.
        coordinate: String,
        /// Stiffness of the coordinate.
        stiffness: f64,
    },
    /// A tendon's moment arms depend on the configuration; [`solve_free`] finds the equilibrium.
    #[error("tendon `{tendon}` has no constant moment arms, which the closed form needs")]
    VaryingArms {
        /// Name of the tendon.
        tendon: String,
    },
    /// A pin closes a chain of links; [`solve_free`] finds the equilibrium.
    #[error("linkage `{linkage}` closes a chain of links, for which there is no closed form")]
    ClosedChain {
        /// Name of the linkage.
        linkage: String,
    },
}

impl ClosedForm {
    /// Largest computing of [`ClosedForm::new`], in the unit of [`crate::bounds`].
    pub(super) fn work(hand: &Hand) -> u64 {
        let (n, m) = (hand.coordinates.len() as u64, hand.tendons.len() as u64);
        let springs = if hand.springs.is_empty() { 0 } else { n * n * n };
        n * n * (2 * m + 2) + n * m * m + m * m * m + springs
    }

    /// Builds the matrices of a hand.
    ///
    /// # Errors
    /// A coordinate without a spring, a tendon whose moment arms are not constant, or a closed chain.
    pub fn new(hand: &Hand) -> Result<Self, NoClosedForm> {
        let (n, m) = (hand.coordinates.len(), hand.tendons.len());
        if let Some(tendon) = hand.tendons.iter().find(|tendon| !tendon.elements.is_empty()) {
            return Err(NoClosedForm::VaryingArms { tendon: tendon.name.clone() });
        }
        if let Some(pin) = hand.linkages.first() {
            return Err(NoClosedForm::ClosedChain { linkage: pin.name.clone() });
        }
        let (compliance, rest) = if hand.springs.is_empty() { diagonal(hand)? } else { coupled(hand)? };
        let mut r = DMatrix::zeros(m, n);
        for (t, tendon) in hand.tendons.iter().enumerate() {
            for &(c, arm) in &tendon.moment_arms {
                r[(t, c)] += arm;
            }
        }
        let mut s = &r * &compliance * r.transpose();
        for (t, tendon) in hand.tendons.iter().enumerate() {
            s[(t, t)] += 1.0 / tendon.stiffness;
        }
        // Positive definite: E⁻¹ is, and every tendon adds its own compliance.
        let p = s.clone().cholesky().map_or_else(|| DMatrix::zeros(m, m), |l| l.inverse());
        let c = &compliance * r.transpose() * &p;
        let d = &compliance - &c * &r * &compliance;
        Ok(ClosedForm { p, c, d, r, rest, compliance })
    }

    /// Coordinates and tensions at wound lengths s (m) under joint torques τ_c (n) of contacts.
    ///
    /// Holds while every tendon is taut and below its limit, and no joint is at its limit.
    pub fn solve(&self, s: &[f64], tau: &[f64]) -> (Vec<f64>, Vec<f64>) {
        let tau = DVector::from_column_slice(tau);
        let stretch = DVector::from_column_slice(s) - &self.r * &self.rest;
        let q = &self.rest + &self.c * &stretch + &self.d * &tau;
        let f = &self.p * (&stretch - &self.r * (&self.compliance * &tau));
        (q.as_slice().to_vec(), f.as_slice().to_vec())
    }
}

/// E⁻¹ and q₀ of joints with springs of their own.
fn diagonal(hand: &Hand) -> Result<(DMatrix<f64>, DVector<f64>), NoClosedForm> {
    let mut compliance = DVector::zeros(hand.coordinates.len());
    for (i, c) in hand.coordinates.iter().enumerate() {
        if c.stiffness.is_nan() || c.stiffness <= 0.0 {
            return Err(NoClosedForm::NoSpring { coordinate: c.name.clone(), stiffness: c.stiffness });
        }
        compliance[i] = 1.0 / c.stiffness;
    }
    let rest = DVector::from_iterator(compliance.len(), hand.coordinates.iter().map(|c| c.rest));
    Ok((DMatrix::from_diagonal(&compliance), rest))
}

/// E⁻¹ and q₀ of joints that springs couple: `E = diag(E_i) + Σ k r rᵀ`, `E q₀ = E_i q₀_i + Σ k s₀ r`.
fn coupled(hand: &Hand) -> Result<(DMatrix<f64>, DVector<f64>), NoClosedForm> {
    let e = stiffness(hand);
    let n = hand.coordinates.len();
    let mut torque = DVector::from_iterator(n, hand.coordinates.iter().map(|c| c.stiffness * c.rest));
    for spring in &hand.springs {
        spring.arms.iter().for_each(|&(c, r)| torque[c] += r * spring.stiffness * spring.rest);
    }
    let Some(factor) = e.cholesky() else {
        let loose = hand.coordinates.iter().min_by(|a, b| a.stiffness.total_cmp(&b.stiffness));
        let (coordinate, stiffness) = loose.map_or((String::new(), 0.0), |c| (c.name.clone(), c.stiffness));
        return Err(NoClosedForm::NoSpring { coordinate, stiffness });
    };
    let rest = factor.solve(&torque);
    Ok((factor.inverse(), rest))
}

/// E: stiffness of joints, and of springs across them, n x n.
pub fn stiffness(hand: &Hand) -> DMatrix<f64> {
    let n = hand.coordinates.len();
    let mut e =
        DMatrix::from_diagonal(&DVector::from_iterator(n, hand.coordinates.iter().map(|c| c.stiffness)));
    for spring in &hand.springs {
        for &(i, a) in &spring.arms {
            for &(j, b) in &spring.arms {
                e[(i, j)] += a * spring.stiffness * b;
            }
        }
    }
    e
}

/// An equilibrium of a free hand.
#[derive(Clone, Debug, PartialEq)]
pub struct FreeEquilibrium {
    /// Coordinates q.
    pub q: Vec<f64>,
    /// Tension of every tendon.
    pub tension: Vec<f64>,
    /// Largest unbalanced torque `|R(q)ᵀ f + τ_c − E (q − q₀)|`.
    pub residual: f64,
    /// Coordinates beyond their limits: the equilibrium ignores limits, and is not valid for these.
    pub beyond_limits: Vec<usize>,
}

/// Error: no equilibrium was found from a starting point.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("no equilibrium found: {residual} N·m are left unbalanced")]
pub struct NoEquilibrium {
    /// Largest unbalanced torque where the search ended.
    pub residual: f64,
}

/// Largest computing of a search, in the unit of [`crate::bounds`]; the built-in hands need a thousandth of
/// it.
const MAX_WORK: u64 = 50_000_000;

/// Newton's method ends when the torques balance to this part of their magnitudes.
const BALANCE: f64 = 1e-13;

/// Rounding of the gap of a pin between links of the size of a hand, m.
const GAP_ROUNDING: f64 = 1e-15;

/// Role of a tendon in a balance of torques.
#[derive(Clone, Copy, Debug, PartialEq)]
enum Pull {
    /// `f = clamp(K (s − s(q)), …)`: a parabola of energy, continued linearly.
    Clamped,
    /// Its length is prescribed: `f = K (s − s(q))`.
    Taut,
    /// Its tension is prescribed: zero, or the motor's limit.
    Held(f64),
}

/// The equilibrium next to `start` at wound lengths s (one per tendon) under joint torques τ_c of contacts:
/// `E (q − q₀) = R(q)ᵀ f + τ_c` with `f = clamp(K (s − s(q)), 0, f_max)`, for any moment arms, tendons slack
/// or at their limit. Joint limits are ignored and reported.
///
/// The search guesses which tendons are taut, and corrects the guess; if the guesses lead in a circle, it minimises the energy with
/// clamped tensions, which is convex but has corners in its gradient. For each guess the equilibrium is the
/// minimum of the elastic energy `½ Σ E (q − q₀)² + Σ ½ K (s − s(q))² − τ_cᵀ q`, found by Newton's method
/// with step halving; directions in which the energy is not convex are stiffened until it is.
///
/// # Errors
/// No balance within the computing budget, for instance for a coordinate with a torque but neither spring nor
/// taut tendon.
pub fn solve_free(
    hand: &Hand,
    s: &[f64],
    tau: &[f64],
    start: &[f64],
) -> Result<FreeEquilibrium, NoEquilibrium> {
    solve_free_within(hand, s, tau, start, &mut { MAX_WORK })
}

/// The same within the remaining computing, from which its own is subtracted.
pub(super) fn solve_free_within(
    hand: &Hand,
    s: &[f64],
    tau: &[f64],
    start: &[f64],
    budget: &mut u64,
) -> Result<FreeEquilibrium, NoEquilibrium> {
    let mut left = MAX_WORK.min(*budget);
    let before = left;
    let found = search(hand, s, tau, start, &mut left);
    *budget -= before - left;
    found
}

fn search(
    hand: &Hand,
    s: &[f64],
    tau: &[f64],
    start: &[f64],
    left: &mut u64,
) -> Result<FreeEquilibrium, NoEquilibrium> {
    let mut pulls = vec![Pull::Taut; hand.tendons.len()];
    let mut q = start.to_vec();
    // Each tendon may come loose, saturate and tighten again; more than that is a cycle.
    for _ in 0..4 * (1 + pulls.len()) {
        let found = minimise(hand, s, tau, &pulls, &mut q, left);
        let mut right = true;
        for (t, tendon) in hand.tendons.iter().enumerate() {
            let f = tendon.stiffness * (s[t] - tendon.length(&q));
            let clamped = f.clamp(tendon.least_force(), tendon.most_held());
            let now = if f == clamped { Pull::Taut } else { Pull::Held(clamped) };
            right &= now == pulls[t];
            pulls[t] = now;
        }
        if !right && *left == 0 {
            break;
        }
        if right {
            return rest(hand, q, found);
        }
    }
    let clamped = vec![Pull::Clamped; hand.tendons.len()];
    q.copy_from_slice(start);
    let found = minimise(hand, s, tau, &clamped, &mut q, left);
    rest(hand, q, found)
}

/// The equilibrium, if the torques balance.
fn rest(hand: &Hand, q: Vec<f64>, found: Balance) -> Result<FreeEquilibrium, NoEquilibrium> {
    if found.residual > 1e-9 * found.size.max(1e-3) + found.rounding || q.iter().any(|q| q.is_nan()) {
        return Err(NoEquilibrium { residual: found.residual });
    }
    let coordinates = hand.coordinates.iter().zip(&q).enumerate();
    let beyond_limits =
        coordinates.filter(|(_, (c, q))| **q < c.lower || **q > c.upper).map(|(i, _)| i).collect();
    Ok(FreeEquilibrium { q, tension: found.tension, residual: found.residual, beyond_limits })
}

/// Elastic energy of a free hand, J: springs, and tendons with prescribed wound lengths s.
pub fn elastic_energy(hand: &Hand, s: &[f64], q: &[f64]) -> f64 {
    let mut energy = 0.0;
    for (c, q) in hand.coordinates.iter().zip(q) {
        energy += 0.5 * c.stiffness * (q - c.rest) * (q - c.rest);
    }
    for spring in &hand.springs {
        energy += 0.5 * spring.stiffness * spring.stretch(q).powi(2);
    }
    for pin in &hand.linkages {
        energy += 0.5 * pin.stiffness * pin.at(hand, q).gap.length_squared();
    }
    for (tendon, s) in hand.tendons.iter().zip(s) {
        let stretch = s - tendon.length(q);
        let f = (tendon.stiffness * stretch).clamp(tendon.least_force(), tendon.most_held());
        // ∫f: a parabola, continued linearly where f is clamped.
        energy += f * stretch - 0.5 * f * f / tendon.stiffness;
    }
    energy
}

/// Moves q to the nearest minimum of the energy and returns the balance there, as good as the remaining
/// computing allows.
fn minimise(
    hand: &Hand,
    s: &[f64],
    tau: &[f64],
    pulls: &[Pull],
    q: &mut Vec<f64>,
    left: &mut u64,
) -> Balance {
    let n = q.len() as u64;
    let (balance_work, factor_work) = (n * n * (1 + pulls.len() as u64), n * n * n / 6);
    let mut here = Balance::at(hand, s, tau, pulls, q);
    *left = left.saturating_sub(balance_work);
    for _ in 0..200 {
        if here.residual <= BALANCE * here.size || *left == 0 {
            break;
        }
        let gradient = DVector::from_column_slice(&here.gradient);
        let (step, factors) = downhill(&here.hessian, &gradient);
        *left = left.saturating_sub(factors * factor_work);
        let Some(step) = step else { break };
        let slope = -gradient.dot(&step);
        let mut part = 1.0;
        loop {
            let moved: Vec<f64> = q.iter().zip(step.iter()).map(|(q, d)| q - part * d).collect();
            let there = Balance::at(hand, s, tau, pulls, &moved);
            *left = left.saturating_sub(balance_work);
            // Near the minimum the energy is all rounding; the torques still decide.
            if there.energy <= here.energy + 1e-4 * part * slope
                || (part == 1.0 && there.residual < 0.5 * here.residual)
            {
                *q = moved;
                here = there;
                break;
            }
            part *= 0.5;
            if part < 1e-12 || *left == 0 {
                return here;
            }
        }
    }
    here
}

/// Energy, its gradient and its second derivative at a configuration.
struct Balance {
    energy: f64,
    gradient: Vec<f64>,
    hessian: DMatrix<f64>,
    tension: Vec<f64>,
    /// Largest |gradient|.
    residual: f64,
    /// Largest torque in it.
    size: f64,
    /// Torque of pins whose gaps are at the rounding of the links' poses.
    rounding: f64,
}

impl Balance {
    fn at(hand: &Hand, s: &[f64], tau: &[f64], pulls: &[Pull], q: &[f64]) -> Self {
        let n = q.len();
        let mut energy = 0.0;
        let (mut gradient, mut size) = (vec![0.0; n], f64::MIN_POSITIVE);
        let mut hessian = DMatrix::zeros(n, n);
        for (i, c) in hand.coordinates.iter().enumerate() {
            let bend = q[i] - c.rest;
            energy += 0.5 * c.stiffness * bend * bend - tau[i] * q[i];
            gradient[i] = c.stiffness * bend - tau[i];
            size = size.max((c.stiffness * bend).abs()).max(tau[i].abs());
            hessian[(i, i)] += c.stiffness;
        }
        for spring in &hand.springs {
            let (stretch, k) = (spring.stretch(q), spring.stiffness);
            energy += 0.5 * k * stretch * stretch;
            for &(i, a) in &spring.arms {
                gradient[i] += k * stretch * a;
                size = size.max((k * stretch * a).abs());
                for &(j, b) in &spring.arms {
                    hessian[(i, j)] += k * a * b;
                }
            }
        }
        let mut rounding = 0.0;
        for pin in &hand.linkages {
            let (at, k) = (pin.at(hand, q), pin.stiffness);
            let lever = at.gradient.iter().map(|(_, a)| a.length()).fold(0.0, f64::max);
            rounding = f64::max(rounding, k * lever * GAP_ROUNDING);
            energy += 0.5 * k * at.gap.length_squared();
            for &(i, a) in &at.gradient {
                let torque = k * a.dot(at.gap);
                gradient[i] += torque;
                size = size.max(torque.abs());
                for &(j, b) in &at.gradient {
                    hessian[(i, j)] += k * a.dot(b);
                }
            }
            at.curvature(at.gap * k, |i, j, stiffness| hessian[(i, j)] += stiffness);
        }
        let mut tension = Vec::with_capacity(pulls.len());
        for (t, tendon) in hand.tendons.iter().enumerate() {
            let stretch = s[t] - tendon.length(q);
            let mut row: DVector<f64> = DVector::zeros(n);
            tendon.gradient(q, |c, r| row[c] += r);
            let linear = tendon.stiffness * stretch;
            let within = linear.clamp(tendon.least_force(), tendon.most_held());
            let pull = match pulls[t] {
                Pull::Clamped if within == linear => Pull::Taut,
                Pull::Clamped => {
                    // The parabola meets the line where it is clamped.
                    energy -= 0.5 * within * within / tendon.stiffness;
                    Pull::Held(within)
                }
                given => given,
            };
            let f = match pull {
                Pull::Clamped | Pull::Taut => {
                    hessian.ger(tendon.stiffness, &row, &row, 1.0);
                    energy += 0.5 * tendon.stiffness * stretch * stretch;
                    tendon.stiffness * stretch
                }
                Pull::Held(f) => {
                    energy += f * stretch;
                    f
                }
            };
            for i in 0..n {
                gradient[i] -= f * row[i];
                size = size.max((f * row[i]).abs());
            }
            for element in &tendon.elements {
                let c = element.coordinate;
                hessian[(c, c)] -= f * element.path.length(q[c]).curvature;
            }
            tension.push(f);
        }
        let residual = gradient.iter().fold(0.0, |most, g| g.abs().max(most));
        Balance { energy, gradient, hessian, tension, residual, size, rounding }
    }
}

/// `H⁻¹ g`, with H stiffened until it is positive definite, and the number of factorisations; `None` when no
/// stiffening helps.
pub(super) fn downhill(hessian: &DMatrix<f64>, gradient: &DVector<f64>) -> (Option<DVector<f64>>, u64) {
    let (mut stiffening, mut factors) = (0.0, 0);
    while stiffening < 1e9 {
        factors += 1;
        let mut h = hessian.clone();
        for i in 0..h.nrows() {
            h[(i, i)] += stiffening;
        }
        if let Some(l) = h.cholesky() {
            return (Some(l.solve(gradient)), factors);
        }
        stiffening = f64::max(4.0 * stiffening, 1e-3);
    }
    (None, factors)
}

#[cfg(test)]
mod tests {
    use super::*;

    /// The numeric check of the adaptive-synergy model: E = diag(0.5, 0.4, 0.3), R = [1 1 1], rigid tendon.
    #[test]
    fn reproduces_the_worked_example() {
        let compliance = DVector::from_column_slice(&[2.0, 2.5, 1.0 / 0.3]);
        let r = DMatrix::from_row_slice(1, 3, &[1.0, 1.0, 1.0]);
        let e_inverse = DMatrix::from_diagonal(&compliance);
        let p = DMatrix::from_element(1, 1, 1.0 / compliance.sum());
        let c = &e_inverse * r.transpose() * &p;
        let d = &e_inverse - &c * &r * &e_inverse;
        let form = ClosedForm { p, c, d, r, rest: DVector::zeros(3), compliance: e_inverse };
        let (q, f) = form.solve(&[0.7], &[0.1, -0.05, 0.02]);
        for (q, expected) in q.iter().zip([0.34255319, 0.05319149, 0.30425532]) {
            assert!((q - expected).abs() < 5e-9);
        }
        assert!((f[0] - 0.0712766).abs() < 5e-8);
    }
}
