//! A hand near an equilibrium: what small inputs and small torques do to its coordinates and tendons.
//!
//! With springs E, tendons R and K, inputs σ that wind W and torques τ from outside, the linear balance is
//!
//! `E dq − Rᵀ df = dτ        R dq + K⁻¹ df = W dσ`
//!
//! (Rocchi and Hauser 2016, eqs 2 to 5, differentiated). A fixed tendon has K⁻¹ = 0; one that is slack or at its limit has no row. Soft
//! synergies `dq_ref = S dz` (Malvezzi et al. 2015, eqs 2 and 3) are the other kind of hand with the same two maps.

use nalgebra::DMatrix;
use palmares_models::hand::Hand;
use palmares_sim::statics::drives::wound_lengths;

/// Compliance of the tendons.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Tendons {
    /// Each with its stiffness K.
    Compliant,
    /// Its length is constant.
    Fixed,
}

/// The part of a state that decides on stiffness.
#[derive(Clone, Copy, Debug)]
pub struct Posture<'a> {
    /// Coordinates q.
    pub q: &'a [f64],
    /// Tension of every tendon, in its own unit.
    pub tension: &'a [f64],
}

/// The linear behaviour of a hand: n coordinates, k inputs.
#[derive(Clone, Debug)]
pub struct CompliantHand {
    /// Joint stiffness E in this posture with everything but tendons: springs, limits that joints are beyond, and the
    /// curvature of tendons under tension, n × n.
    pub springs: DMatrix<f64>,
    /// R of the tendons that act, m × n.
    pub r: DMatrix<f64>,
    /// Indices of these tendons in the hand.
    pub acting: Vec<usize>,
    /// Joint compliance ∂q/∂τ at constant inputs, n × n.
    pub compliance: DMatrix<f64>,
    /// ∂q/∂input of the free hand, n × k.
    pub motion: DMatrix<f64>,
    /// ∂f/∂input of the free hand, m × k.
    pub tension: DMatrix<f64>,
    /// ∂f/∂τ at constant inputs, m × n.
    pub tension_per_torque: DMatrix<f64>,
    /// Wound length of the acting tendons per input, m × k.
    pub winding: DMatrix<f64>,
    /// Stiffness of the tendons against winding, `(R E⁻¹ Rᵀ + K⁻¹)⁻¹`, m × m.
    pub tendon_stiffness: DMatrix<f64>,
}

/// A hand without a unique equilibrium near its posture.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotCompliant {
    /// Neither springs nor tendons determine all coordinates.
    #[error(
        "springs and tendons leave a joint free or are redundant: the posture does not determine how the hand gives way"
    )]
    Singular,
    /// A matrix of the wrong size.
    #[error("{what} is {rows} × {columns}; valid: {wanted}")]
    Size {
        /// Name of the matrix.
        what: &'static str,
        /// Its rows.
        rows: usize,
        /// Its columns.
        columns: usize,
        /// The valid size.
        wanted: String,
    },
}

/// E: stiffness of the springs alone, n × n: `diag(E_i) + Σ k r rᵀ` with springs across joints.
pub fn spring_stiffness(hand: &Hand) -> DMatrix<f64> {
    let n = hand.coordinates.len();
    let mut e = DMatrix::from_fn(n, n, |i, k| if i == k { hand.coordinates[i].stiffness } else { 0.0 });
    for spring in &hand.springs {
        for &(i, a) in &spring.arms {
            for &(k, b) in &spring.arms {
                e[(i, k)] += spring.stiffness * a * b;
            }
        }
    }
    e
}

/// R(q) of all tendons, m × n.
pub fn moment_arms(hand: &Hand, q: &[f64]) -> DMatrix<f64> {
    let mut r = DMatrix::zeros(hand.tendons.len(), hand.coordinates.len());
    for (t, tendon) in hand.tendons.iter().enumerate() {
        tendon.gradient(q, |c, arm| r[(t, c)] += arm);
    }
    r
}

/// W: wound length of every tendon per σ of every motor.
pub fn winding(hand: &Hand) -> DMatrix<f64> {
    let open = vec![0.0; hand.motors.len()];
    let at_open = wound_lengths(hand, &open);
    let mut winding = DMatrix::zeros(hand.tendons.len(), open.len());
    for k in 0..open.len() {
        let mut one = open.clone();
        one[k] = 1.0;
        for (t, (wound, open)) in wound_lengths(hand, &one).iter().zip(&at_open).enumerate() {
            winding[(t, k)] = wound - open;
        }
    }
    winding
}

/// Stiffness of E, of limits that joints are beyond, of the curvature of tendons under tension, −f ∂²s/∂q², and of the pins that close
/// chains.
fn stiffness_without_tendons(hand: &Hand, posture: Posture<'_>, limit_stiffness: f64) -> DMatrix<f64> {
    let mut e = spring_stiffness(hand);
    for (i, (c, q)) in hand.coordinates.iter().zip(posture.q).enumerate() {
        if !(c.lower..=c.upper).contains(q) {
            e[(i, i)] += limit_stiffness;
        }
    }
    for (tendon, f) in hand.tendons.iter().zip(posture.tension) {
        for element in &tendon.elements {
            let c = element.coordinate;
            e[(c, c)] -= f * element.path.length(posture.q[c]).curvature;
        }
    }
    for pin in &hand.linkages {
        let at = pin.at(hand, posture.q);
        for (i, a) in &at.gradient {
            for (k, b) in &at.gradient {
                e[(*i, *k)] += pin.stiffness * a.dot(*b);
            }
        }
        at.curvature(at.gap * pin.stiffness, |i, k, second| e[(i, k)] += second);
    }
    e
}

impl CompliantHand {
    /// A hand with its tendons, inputs σ. Tendons that are slack or at their limit in this posture do not act.
    /// `geometric` is a further joint stiffness, such as [`crate::grasp::Grasp::hand_geometric_stiffness`].
    ///
    /// # Errors
    /// The posture does not determine how the hand gives way.
    pub fn tendon_driven(
        hand: &Hand,
        posture: Posture<'_>,
        tendons: Tendons,
        limit_stiffness: f64,
        geometric: Option<&DMatrix<f64>>,
    ) -> Result<Self, NotCompliant> {
        let mut e = stiffness_without_tendons(hand, posture, limit_stiffness);
        if let Some(geometric) = geometric {
            e += geometric;
        }
        let acts = |t: &usize| {
            let (tendon, f) = (&hand.tendons[*t], posture.tension[*t]);
            f > tendon.least_force() && f < tendon.most_held()
        };
        let acting: Vec<usize> = (0..hand.tendons.len()).filter(acts).collect();
        let give = |t: &usize| match tendons {
            Tendons::Compliant => 1.0 / hand.tendons[*t].stiffness,
            Tendons::Fixed => 0.0,
        };
        let give: Vec<f64> = acting.iter().map(give).collect();
        let r = moment_arms(hand, posture.q).select_rows(&acting);
        let winding = winding(hand).select_rows(&acting);
        Self::solve(e, r, &give, winding, acting)
    }

    /// A hand with springs E, tendons R of compliance `give`, and inputs that wind `winding`.
    fn solve(
        e: DMatrix<f64>,
        r: DMatrix<f64>,
        give: &[f64],
        winding: DMatrix<f64>,
        acting: Vec<usize>,
    ) -> Result<Self, NotCompliant> {
        let (n, m) = (e.nrows(), r.nrows());
        let inverse = balanced_inverse(balance(&e, &r, give, 0)).ok_or(NotCompliant::Singular)?;
        let compliance = inverse.view((0, 0), (n, n)).into_owned();
        let pulled = inverse.view((0, n), (n, m)).into_owned();
        let tendon_stiffness = -inverse.view((n, n), (m, m)).into_owned();
        Ok(CompliantHand {
            springs: e,
            motion: &pulled * &winding,
            tension: &tendon_stiffness * &winding,
            tension_per_torque: -pulled.transpose(),
            r,
            acting,
            compliance,
            winding,
            tendon_stiffness,
        })
    }

    /// A hand whose joints follow `q_ref = S z` through springs, with springs between z and its command: SynGrasp's soft synergies.
    /// Its inputs are the commands of z; its tensions are the forces of z's springs.
    ///
    /// # Errors
    /// Matrices of wrong sizes, or that are singular.
    pub fn soft_synergies(
        synergies: &DMatrix<f64>,
        joint_stiffness: &DMatrix<f64>,
        synergy_stiffness: &DMatrix<f64>,
    ) -> Result<Self, NotCompliant> {
        let (n, k) = synergies.shape();
        sized("joint_stiffness", joint_stiffness, (n, n))?;
        sized("synergy_stiffness", synergy_stiffness, (k, k))?;
        let invert = |matrix: &DMatrix<f64>| matrix.clone().try_inverse().ok_or(NotCompliant::Singular);
        let (joints, inputs) = (invert(joint_stiffness)?, invert(synergy_stiffness)?);
        // From τ + K_q (S z − q) = 0 and Sᵀ K_q (S z − q) = K_z (z_ref − z).
        let compliance = joints + synergies * inputs * synergies.transpose();
        Ok(CompliantHand {
            springs: joint_stiffness.clone(),
            r: synergies.transpose(),
            acting: (0..k).collect(),
            motion: synergies.clone(),
            tension: DMatrix::zeros(k, k),
            tension_per_torque: -synergies.transpose(),
            compliance,
            winding: DMatrix::identity(k, k),
            tendon_stiffness: DMatrix::zeros(k, k),
        })
    }

    /// Joint stiffness ∂τ/∂q at constant inputs, n × n: the inverse of the compliance. `None` if fixed tendons leave directions in
    /// which it is infinite.
    pub fn joint_stiffness(&self) -> Option<DMatrix<f64>> {
        balanced_inverse(self.compliance.clone())
    }

    /// Stiffness of the inputs, `∂(Wᵀ f)/∂σ` for a hand that nothing touches, k × k.
    pub fn input_stiffness(&self) -> DMatrix<f64> {
        self.winding.transpose() * &self.tension
    }
}

/// Checks the size of a matrix.
pub(crate) fn sized(
    what: &'static str,
    matrix: &DMatrix<f64>,
    wanted: (usize, usize),
) -> Result<(), NotCompliant> {
    let (rows, columns) = matrix.shape();
    if (rows, columns) == wanted {
        return Ok(());
    }
    Err(NotCompliant::Size { what, rows, columns, wanted: format!("{} × {}", wanted.0, wanted.1) })
}

/// `[E Rᵀ; R −K⁻¹]`, with zeros for c more rows and columns.
pub(crate) fn balance(e: &DMatrix<f64>, r: &DMatrix<f64>, give: &[f64], c: usize) -> DMatrix<f64> {
    let (m, n) = r.shape();
    let mut all = DMatrix::zeros(n + m + c, n + m + c);
    all.view_mut((0, 0), (n, n)).copy_from(e);
    all.view_mut((0, n), (n, m)).copy_from(&r.transpose());
    all.view_mut((n, 0), (m, n)).copy_from(r);
    for (t, give) in give.iter().enumerate() {
        all[(n + t, n + t)] = -give;
    }
    all
}

/// The inverse of a symmetric matrix, computed with rows and columns scaled to largest entries of 1; `None` if it is singular.
pub(crate) fn balanced_inverse(mut matrix: DMatrix<f64>) -> Option<DMatrix<f64>> {
    let n = matrix.nrows();
    if n == 0 {
        return Some(matrix);
    }
    let mut scale = vec![1.0; n];
    // Each pass takes the square root off the spread of the entries.
    for _ in 0..4 {
        for i in 0..n {
            let largest = matrix.row(i).amax();
            if largest == 0.0 {
                return None;
            }
            let by = 1.0 / largest.sqrt();
            scale[i] *= by;
            matrix.row_mut(i).scale_mut(by);
            matrix.column_mut(i).scale_mut(by);
        }
    }
    let lu = matrix.clone().full_piv_lu();
    let pivots = lu.u().diagonal();
    if pivots.iter().any(|pivot| pivot.abs() < crate::linear::RANK_TOLERANCE * 1e-2) {
        return None;
    }
    let mut inverse = lu.try_inverse()?;
    for i in 0..n {
        inverse.row_mut(i).scale_mut(scale[i]);
        inverse.column_mut(i).scale_mut(scale[i]);
    }
    Some(inverse)
}
