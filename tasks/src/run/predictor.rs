//! Equilibrium of the free hand: a function of the tendons' wound lengths alone, which another thread than the world's can compute.

use palmares_models::hand::Hand;
use palmares_sim::statics::equilibrium::{ClosedForm, solve_free};
use std::sync::Arc;

/// Predicts the equilibrium of a hand.
#[derive(Clone, Debug)]
pub(crate) struct Predictor {
    hand: Arc<Hand>,
    closed_form: Option<ClosedForm>,
}

impl Predictor {
    pub(crate) fn new(hand: Arc<Hand>) -> Self {
        Predictor { closed_form: ClosedForm::new(&hand).ok(), hand }
    }

    /// Equilibrium of the free hand at these wound lengths, one per tendon, kept within the joint limits: the closed form
    /// where there is one. Empty if it is not defined.
    pub(crate) fn predict(&self, s: &[f64]) -> Vec<f64> {
        let free = vec![0.0; self.hand.coordinates.len()];
        let q = match &self.closed_form {
            Some(form) => form.solve(s, &free).0,
            None => {
                let open: Vec<f64> = self.hand.coordinates.iter().map(|c| c.rest).collect();
                match solve_free(&self.hand, s, &free, &open) {
                    Ok(rest) => rest.q,
                    Err(_) => return Vec::new(),
                }
            }
        };
        if q.iter().any(|q| q.is_nan()) {
            return Vec::new();
        }
        q.iter().zip(&self.hand.coordinates).map(|(q, c)| q.clamp(c.lower, c.upper)).collect()
    }
}
