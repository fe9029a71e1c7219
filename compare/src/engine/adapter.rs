//! What the adapters pass on to their engines. A scene that needs anything else is not played, which says nothing about the
//! engine.

use palmares_models::hand::Hand;
use palmares_sim::model::Collider;
use palmares_sim::{Command, Model};

/// An adapter does not pass on what a scene needs.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("not played: {0}")]
pub struct NotPlayed(pub String);

/// The parts of a scene that an adapter may pass on to its engine.
pub struct Adapter {
    /// Name of the engine.
    pub engine: &'static str,
    /// Friction against spin and rolling resistance.
    levers: bool,
    /// Dry friction of joints.
    joint_friction: bool,
}

impl Adapter {
    /// rapier's.
    pub const RAPIER: Adapter = Adapter { engine: "rapier", levers: false, joint_friction: false };
    /// MuJoCo's.
    pub const MUJOCO: Adapter = Adapter { engine: "mujoco", levers: true, joint_friction: true };
    /// All.
    pub const ALL: [Adapter; 2] = [Adapter::RAPIER, Adapter::MUJOCO];

    /// Whether it passes on a scene.
    ///
    /// # Errors
    /// The first part that it does not pass on.
    pub fn takes(&self, model: &Model) -> Result<(), NotPlayed> {
        let hand = |has: fn(&Hand) -> bool| model.hand().is_some_and(|hand| has(hand));
        let rubs = |it: &Collider| it.rolling_friction > 0.0 || it.spin.lever > 0.0;
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
            (hand(|it| it.tendons.iter().any(|it| !it.guides.is_empty())), "friction of cables at guides"),
            (
                hand(|it| it.tendons.iter().any(|it| it.hold_limit.is_some())),
                "drives that no load turns back",
            ),
            (hand(|it| !it.pads.is_empty()), "soft pads"),
            (
                hand(|it| it.coordinates.iter().any(|it| it.friction > 0.0)) && !self.joint_friction,
                "dry friction of joints",
            ),
            (
                model.colliders().iter().any(rubs) && !self.levers,
                "friction against spin and rolling resistance",
            ),
        ])
    }

    /// Whether it passes on a command.
    ///
    /// # Errors
    /// The first part that it does not pass on.
    pub fn obeys(&self, command: &Command) -> Result<(), NotPlayed> {
        self.all_but(&[(command.effort.iter().any(|it| *it < 1.0), "motors with a part of their force")])
    }

    fn all_but(&self, needed: &[(bool, &str)]) -> Result<(), NotPlayed> {
        match needed.iter().find(|(lacks, _)| *lacks) {
            Some((_, what)) => Err(NotPlayed(format!("its adapter does not pass on {what}"))),
            None => Ok(()),
        }
    }
}
