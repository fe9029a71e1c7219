//! A hand with numbers drawn from the ranges of its uncertain ones.

use super::Hand;
use crate::error::ModelError;

impl Hand {
    /// The hand with these numbers in place of its uncertain ones: for each entry of [`Hand::uncertain`] a factor or a value within
    /// its range, or none. It has no uncertain numbers of its own.
    ///
    /// With its moment arms a tendon's lengths change, measured from where the springs rest: there it stays as taut as it was.
    ///
    /// # Errors
    /// A number is missing or outside its range.
    pub fn drawn(&self, numbers: &[Option<f64>]) -> Result<Hand, ModelError> {
        let bad = |problem: String| {
            Err(ModelError::Inconsistent { name: self.name.clone(), element: "[uncertain]".into(), problem })
        };
        if numbers.len() != self.uncertain.len() {
            return bad(format!("{} numbers for {} entries", numbers.len(), self.uncertain.len()));
        }
        let mut hand = self.clone();
        hand.uncertain = Vec::new();
        for (entry, &number) in self.uncertain.iter().zip(numbers) {
            let Some(number) = number else { continue };
            let [low, high] = entry.range.ends();
            if !(low..=high).contains(&number) {
                return bad(format!("{} {number} is not from {low} to {high}", entry.name));
            }
            entry.of.change(&mut hand, &entry.on, &|own| entry.range.applied(number, own));
        }
        hand.keep_taut(self);
        hand.validate()?;
        Ok(hand)
    }

    /// Shifts the lengths of tendons whose arms changed, so that each is as taut at rest as in `before`.
    fn keep_taut(&mut self, before: &Hand) {
        let mut rest: Vec<f64> = self.coordinates.iter().map(|c| c.rest).collect();
        self.close_chains(&mut rest);
        for (tendon, before) in self.tendons.iter_mut().zip(&before.tendons) {
            let longer = tendon.length(&rest) - before.length(&rest);
            if longer != 0.0 {
                tendon.rest += longer;
            }
        }
    }
}
