//! A compliant hand that holds an object: stiffness, and the small motions and forces that its inputs and loads cause.
//!
//! With `λ` the forces on the object, u its displacement and K_c the stiffness of the contacts, the linear balance is
//!
//! `dλ = K_c (J dq − Gᵀ du)      dq = Q dσ − C_q Jᵀ dλ      G dλ + K_g du = −dw`
//!
//! where `C_q` and Q are compliance and motion of the hand, and `K_g = ∂(G λ)/∂u`. The contacts and the hand in series have the
//! stiffness `K = (K_c⁻¹ + J C_q Jᵀ)⁻¹`, and the object `G K Gᵀ − K_g` (Malvezzi and Prattichizzo 2013, eq. 12, with their
//! `C_q = K_q⁻¹ + S K_z⁻¹ Sᵀ`; Prattichizzo et al. 2013, eqs 15 to 24).

use crate::contact::Contact;
use crate::hand::{CompliantHand, NotCompliant, balanced_inverse, sized};
use crate::linear::{intersection, null_space, pseudo_inverse, range, rank};
use nalgebra::DMatrix;

/// A grasp whose stiffness is not determined.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum NotStiff {
    /// Contacts and hand in series.
    #[error("contact_stiffness is singular, or does not go together with the hand's compliance")]
    Singular,
    /// A number that is not valid.
    #[error(
        "contact_stiffness: found {0}; wanted a number above 0 (N/m), or normal above 0 and tangential (N/m) and spin (N·m/rad) not negative"
    )]
    Number(ContactStiffness),
    /// A matrix of the wrong size.
    #[error(transparent)]
    Size(#[from] NotCompliant),
}

/// A grasp near its equilibrium: n coordinates, k inputs, c components of contact forces.
#[derive(Clone, Debug)]
pub struct QuasiStatic {
    /// G, 6 × c.
    pub g: DMatrix<f64>,
    /// J, c × n.
    pub j: DMatrix<f64>,
    /// Stiffness of contacts and hand in series, c × c.
    pub contact_stiffness: DMatrix<f64>,
    /// Stiffness of the object, ∂w/∂u at constant inputs, 6 × 6.
    pub object_stiffness: DMatrix<f64>,
    /// Object motion per input, 6 × k.
    pub object_per_input: DMatrix<f64>,
    /// Contact forces per input, c × k.
    pub forces_per_input: DMatrix<f64>,
    /// Joint motion per input, n × k.
    pub joints_per_input: DMatrix<f64>,
    /// Tensions per input, m × k.
    pub tension_per_input: DMatrix<f64>,
    /// Stiffness of the inputs in the grasp, `∂(Wᵀ f)/∂σ`, k × k.
    pub input_stiffness: DMatrix<f64>,
    /// Object motion per wrench on it, 6 × 6.
    pub object_per_wrench: DMatrix<f64>,
    /// Contact forces per wrench on the object, c × 6.
    pub forces_per_wrench: DMatrix<f64>,
    /// Joint motion per wrench on the object, n × 6.
    pub joints_per_wrench: DMatrix<f64>,
    /// Number of independent directions in which the grasp holds the object, 0 to 6.
    pub held: usize,
}

impl QuasiStatic {
    /// A grasp. `contacts` is K_c: a component whose row and column are 0 transmits nothing.
    ///  `object_geometric` is K_g for a grasp with contact forces. Directions in which
    /// nothing holds the object have no motion: the smallest of all solutions.
    ///
    /// # Errors
    /// Matrices of the wrong size, or a K_c that is singular in the components that it transmits.
    pub fn new(
        hand: &CompliantHand,
        g: &DMatrix<f64>,
        j: &DMatrix<f64>,
        contacts: &DMatrix<f64>,
        object_geometric: Option<&DMatrix<f64>>,
    ) -> Result<Self, NotStiff> {
        let c = j.nrows();
        sized("G", g, (g.nrows(), c))?;
        sized("J", j, (c, hand.compliance.nrows()))?;
        sized("contact_stiffness", contacts, (c, c))?;
        let transmits = |k: &usize| contacts.row(*k).amax().max(contacts.column(*k).amax()) > 0.0;
        let acting: Vec<usize> = (0..c).filter(transmits).collect();
        let give = balanced_inverse(contacts.select_rows(&acting).select_columns(&acting));
        let moving = j.select_rows(&acting);
        let acting_series = give.ok_or(NotStiff::Singular)? + &moving * &hand.compliance * moving.transpose();
        let acting_series = balanced_inverse(acting_series).ok_or(NotStiff::Singular)?;
        let mut series = DMatrix::zeros(c, c);
        for (i, &row) in acting.iter().enumerate() {
            for (k, &column) in acting.iter().enumerate() {
                series[(row, column)] = acting_series[(i, k)];
            }
        }
        let mut object_stiffness = g * &series * g.transpose();
        if let Some(geometric) = object_geometric {
            sized("object_geometric", geometric, (g.nrows(), g.nrows()))?;
            object_stiffness -= geometric;
        }
        let yielding = pseudo_inverse(&object_stiffness);
        let drive = &series * j * &hand.motion;
        let object_per_input = &yielding * g * &drive;
        let forces_per_input = drive - &series * g.transpose() * &object_per_input;
        let object_per_wrench = yielding;
        let forces_per_wrench = -(&series * g.transpose() * &object_per_wrench);
        let back = &hand.compliance * j.transpose();
        let joints_per_input = &hand.motion - &back * &forces_per_input;
        let torque_per_input = -(j.transpose() * &forces_per_input);
        let tension_per_input = &hand.tension + &hand.tension_per_torque * torque_per_input;
        Ok(QuasiStatic {
            input_stiffness: hand.winding.transpose() * &tension_per_input,
            held: rank(&object_stiffness),
            g: g.clone(),
            j: j.clone(),
            contact_stiffness: series,
            object_stiffness,
            object_per_input,
            forces_per_input,
            joints_per_input,
            tension_per_input,
            object_per_wrench,
            joints_per_wrench: -(&back * &forces_per_wrench),
            forces_per_wrench,
        })
    }

    /// Basis of the internal forces, `G λ = 0`, c × its dimension.
    pub fn internal_forces(&self) -> DMatrix<f64> {
        null_space(&self.g)
    }

    /// Basis of the internal forces that the inputs control: the contact forces that they cause (Prattichizzo et al. 2013, eq. 24).
    pub fn controllable_internal_forces(&self) -> DMatrix<f64> {
        intersection(&range(&self.forces_per_input), &self.internal_forces())
    }

    /// Inputs whose object motion changes no contact force, k × their dimension, and the motions, 6 × the same: the
    /// rigid-body motions of the grasp that the inputs control.
    pub fn rigid_motions(&self) -> (DMatrix<f64>, DMatrix<f64>) {
        let inputs = null_space(&self.forces_per_input);
        let motions = &self.object_per_input * &inputs;
        (inputs, motions)
    }
}

/// Stiffness of every contact, K_c. A soft finger also resists a turn about its normal.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum ContactStiffness {
    /// k along every direction, N/m; about the normal k · arm², N·m/rad, with the arm of the contact's friction moment: springs of
    /// k at the distance arm from the normal.
    Equal(f64),
    /// Each of them.
    Parts {
        /// Along the normal, N/m.
        normal: f64,
        /// Along t and o, N/m.
        tangential: f64,
        /// About the normal, N·m/rad.
        spin: f64,
    },
}

impl std::fmt::Display for ContactStiffness {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            ContactStiffness::Equal(k) => write!(f, "{k}"),
            ContactStiffness::Parts { normal, tangential, spin } => {
                write!(f, "[{normal}, {tangential}, {spin}]")
            }
        }
    }
}

impl ContactStiffness {
    /// K_c, a diagonal c × c matrix.
    ///
    /// # Errors
    /// A stiffness that is not valid.
    pub fn of(self, contacts: &[Contact]) -> Result<DMatrix<f64>, NotStiff> {
        let valid = match self {
            ContactStiffness::Equal(k) => k > 0.0 && k.is_finite(),
            ContactStiffness::Parts { normal, tangential, spin } => {
                normal > 0.0 && [normal, tangential, spin].iter().all(|k| *k >= 0.0 && k.is_finite())
            }
        };
        if !valid {
            return Err(NotStiff::Number(self));
        }
        let each = |contact: &Contact| match self {
            ContactStiffness::Equal(k) => [k, k, k, k * contact.arm * contact.arm],
            ContactStiffness::Parts { normal, tangential, spin } => [normal, tangential, tangential, spin],
        };
        let diagonal: Vec<f64> = contacts
            .iter()
            .flat_map(|contact| each(contact).into_iter().take(contact.model.components()))
            .collect();
        Ok(DMatrix::from_diagonal(&nalgebra::DVector::from_vec(diagonal)))
    }
}
