//! What the adapters pass on to their engines. A scene that needs anything else is not played, which says nothing about the
//! engine.

use palmares_models::hand::Hand;
use palmares_sim::{BaseCommand, Command, Model};

/// An adapter does not pass on what a scene needs.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("not played: {0}")]
pub struct NotPlayed(pub String);

/// The parts of a scene that an adapter may pass on to its engine.
pub struct Adapter {
    /// Name of the engine.
    pub engine: &'static str,
    /// Surfaces that rebound.
    restitution: bool,
    /// A hand whose base nothing holds any more.
    free_base: bool,
    /// Forces on a hand from outside.
    pushes: bool,
}

impl Adapter {
    /// rapier's.
    pub const RAPIER: Adapter =
        Adapter { engine: "rapier", restitution: true, free_base: true, pushes: true };
    /// MuJoCo's.
    pub const MUJOCO: Adapter =
        Adapter { engine: "mujoco", restitution: false, free_base: false, pushes: false };
    /// All.
    pub const ALL: [Adapter; 2] = [Adapter::RAPIER, Adapter::MUJOCO];

    /// Whether it passes on a scene.
    ///
    /// # Errors
    /// The first part that it does not pass on.
    pub fn takes(&self, model: &Model) -> Result<(), NotPlayed> {
        let hand = |has: fn(&Hand) -> bool| model.hand().is_some_and(|hand| has(hand));
        let rebounds = model.colliders().iter().any(|collider| collider.restitution > 0.0);
        self.all_but(&[
            (
                hand(|it| it.tendons.iter().any(|tendon| !tendon.elements.is_empty())),
                "tendons whose R depends on q",
            ),
            (
                hand(|it| !(it.springs.is_empty() && it.linkages.is_empty())),
                "springs across joints and closed chains",
            ),
            (hand(|it| it.motors.iter().any(|motor| motor.slows())), "motors that a load slows"),
            (rebounds && !self.restitution, "restitution"),
        ])
    }

    /// Whether it passes on a command in a scene.
    ///
    /// # Errors
    /// The first part that it does not pass on.
    pub fn obeys(&self, model: &Model, command: &Command) -> Result<(), NotPlayed> {
        let base = &model.config().base;
        let servo = model.hand().is_some() && !base.bolted && base.stiffness != 0.0;
        let freed = servo && command.base == BaseCommand::Free;
        self.all_but(&[
            (!command.pushes.is_empty() && !self.pushes, "forces from outside"),
            (freed && !self.free_base, "a base servo that is switched off"),
        ])
    }

    fn all_but(&self, needed: &[(bool, &str)]) -> Result<(), NotPlayed> {
        match needed.iter().find(|(lacks, _)| *lacks) {
            Some((_, what)) => Err(NotPlayed(format!("its adapter does not pass on {what}"))),
            None => Ok(()),
        }
    }
}
