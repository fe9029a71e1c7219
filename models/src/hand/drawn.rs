//! A hand with numbers drawn from the ranges of its uncertain ones.

use super::uncertain::{HandQuantity, Owner, Uncertain};
use super::{Hand, Tendon};
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
            entry.apply(number, &mut hand);
        }
        hand.keep_taut(self);
        hand.validate()?;
        Ok(hand)
    }

    /// Indices of all links, joints, motors or tendons that have a quantity.
    pub(crate) fn that_have(&self, of: HandQuantity) -> Vec<usize> {
        let which = |has: &dyn Fn(usize) -> bool, count: usize| (0..count).filter(|k| has(*k)).collect();
        let (links, joints) = (self.links.len(), self.coordinates.len());
        match of {
            HandQuantity::Friction => which(&|k| self.links[k].geoms.iter().any(|g| g.friction > 0.0), links),
            HandQuantity::Stiffness => which(&|k| self.coordinates[k].stiffness > 0.0, joints),
            HandQuantity::Damping => which(&|k| self.coordinates[k].damping > 0.0, joints),
            HandQuantity::MomentArms => {
                which(&|k| self.tendons.iter().any(|tendon| tendon.coordinates().contains(&k)), joints)
            }
            HandQuantity::SpeedLimit => (0..self.motors.len()).collect(),
            HandQuantity::ForceLimit | HandQuantity::TendonStiffness => (0..self.tendons.len()).collect(),
            HandQuantity::TendonFriction => {
                which(&|k| self.tendons[k].rubbing().next().is_some(), self.tendons.len())
            }
        }
    }

    /// The names of all links, joints, motors or tendons.
    pub(crate) fn names_of(&self, owner: Owner) -> Vec<&str> {
        match owner {
            Owner::Link => self.links.iter().map(|link| link.name.as_str()).collect(),
            Owner::Joint => self.coordinates.iter().map(|c| c.name.as_str()).collect(),
            Owner::Motor => self.motors.iter().map(|motor| motor.name.as_str()).collect(),
            Owner::Tendon => self.tendons.iter().map(|tendon| tendon.name.as_str()).collect(),
        }
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

impl Uncertain {
    fn apply(&self, number: f64, hand: &mut Hand) {
        let mut stronger = Vec::new();
        for &k in &self.on {
            let new = |own: &mut f64| *own = self.range.applied(number, *own);
            match self.of {
                HandQuantity::Friction => {
                    // A surface without friction has none by design.
                    let geoms = hand.links[k].geoms.iter_mut().filter(|g| g.friction > 0.0);
                    geoms.for_each(|geom| new(&mut geom.friction));
                }
                HandQuantity::Stiffness => new(&mut hand.coordinates[k].stiffness),
                HandQuantity::Damping => new(&mut hand.coordinates[k].damping),
                HandQuantity::MomentArms => hand.tendons.iter_mut().for_each(|t| t.scale_arms(k, number)),
                HandQuantity::SpeedLimit => new(&mut hand.motors[k].speed_limit),
                HandQuantity::ForceLimit => {
                    let tendon = &mut hand.tendons[k];
                    let before = tendon.force_limit;
                    new(&mut tendon.force_limit);
                    let ratio = tendon.force_limit / before;
                    tendon.hold_limit = tendon.hold_limit.map(|hold| hold * ratio);
                    stronger.extend(tendon.motors.iter().map(|&(motor, _)| (motor, ratio)));
                }
                HandQuantity::TendonStiffness => {
                    let tendon = &mut hand.tendons[k];
                    let before = tendon.stiffness;
                    new(&mut tendon.stiffness);
                    tendon.damping *= tendon.stiffness / before;
                }
                HandQuantity::TendonFriction => {
                    let rubbing = hand.tendons[k].guides.iter_mut().filter(|guide| guide.exponent() > 0.0);
                    rubbing.for_each(|guide| new(&mut guide.friction));
                }
            }
        }
        // A motor of several tendons is as strong as the first of them.
        stronger.sort_by_key(|&(motor, _)| motor);
        stronger.dedup_by_key(|&mut (motor, _)| motor);
        for (motor, ratio) in stronger {
            let stall = &mut hand.motors[motor].stall_force;
            *stall = stall.map(|force| force * ratio);
        }
    }
}

impl Tendon {
    /// Multiplies the part of its length that a coordinate makes.
    fn scale_arms(&mut self, coordinate: usize, factor: f64) {
        for (c, arm) in &mut self.moment_arms {
            if *c == coordinate {
                *arm *= factor;
            }
        }
        for element in self.elements.iter_mut().filter(|element| element.coordinate == coordinate) {
            element.path = element.path.scaled(factor);
        }
    }
}
