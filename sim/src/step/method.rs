//! The integrators of a step, and the one that an island begins with.

use crate::law::Law;
use crate::model::Model;
use crate::solver::island::Island;

/// An integrator.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Method {
    /// Runge–Kutta of fifth order ([`super::cash_karp`]).
    CashKarp,
    /// Backward differentiation of second order ([`super::bdf2`]).
    Bdf2,
    /// Implicit Euler ([`super::euler`]), which takes every step; that of an object alone on a rim is offered to
    /// [`super::rolling`] first.
    Euler,
}

/// Result of an integrator that takes smooth motion alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[must_use]
pub(super) enum Attempt {
    /// The state is that of the end of the step.
    Taken,
    /// The state is that of the start of the step: another integrator takes it.
    Declined,
}

impl Method {
    /// The integrator of the highest order for an island. A hand alone may move smoothly: without dampers and contact by
    /// Cash–Karp, with dampers by BDF2. Objects press and hit, and dry friction jumps: implicit
    /// Euler, which corrects a hand alone ([`super::second_order`]).
    pub(super) fn of(model: &Model, island: &Island) -> Self {
        let alone = island.hand && island.objects.is_empty() && model.has(Law::HandOrder);
        if alone && model.undamped_hand() && island.pairs.is_empty() {
            Method::CashKarp
        } else if alone && !model.undamped_hand() && model.friction_rows() == 0 {
            Method::Bdf2
        } else {
            Method::Euler
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use palmares_models::hand::Hand;

    #[test]
    fn a_hand_alone_has_a_higher_order_unless_something_jumps() {
        let model = |change: fn(&mut Hand)| {
            let mut hand = Hand::clone(&Hand::builtin("softhand").expect("built in"));
            change(&mut hand);
            Model::new(Config::default(), Some(hand.into())).expect("a hand")
        };
        let damped = model(|_| {});
        let undamped = model(|hand| {
            hand.coordinates.iter_mut().for_each(|coordinate| coordinate.damping = 0.0);
            hand.tendons.iter_mut().for_each(|tendon| tendon.damping = 0.0);
        });
        let rubs = model(|hand| hand.coordinates[0].friction = 0.01);
        let hand = Island { hand: true, ..Island::default() };
        let touches_itself = Island { pairs: vec![0], ..hand.clone() };
        let holds = Island { objects: vec![0], ..touches_itself.clone() };
        let object = Island { objects: vec![0], pairs: vec![0], ..Island::default() };
        for (model, islands) in [
            (&damped, [Method::Bdf2, Method::Bdf2, Method::Euler, Method::Euler]),
            (&undamped, [Method::CashKarp, Method::Euler, Method::Euler, Method::Euler]),
            (&rubs, [Method::Euler; 4]),
        ] {
            let found = [&hand, &touches_itself, &holds, &object].map(|island| Method::of(model, island));
            assert_eq!(found, islands);
        }
    }
}
