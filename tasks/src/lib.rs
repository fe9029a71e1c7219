//! Runs: scene, rules, referee and score. No sockets, no clocks, no files at run time.

pub mod action;
pub mod build;
pub mod hand_draw;
pub mod hand_observation;
pub mod identity;
pub mod image;
pub mod inspect;
pub mod observation;
pub mod overlap;
pub mod place;
pub mod referee;
pub mod run;
pub mod scene;
pub mod seed;
pub mod sensing;
pub mod settle;
pub mod start;
pub mod table;
pub mod task;
pub mod training;

pub use palmares_sim::Fault;

pub use action::{Action, ActionError, ActionLimits, BaseTarget};
pub use hand_draw::HandDraw;
pub use hand_observation::HandObservation;
pub use observation::{Event, Observation};
pub use run::{Outcome, Reason, Run};
pub use scene::Scene;
pub use seed::{Scenes, Seed};
pub use sensing::{Noise, Sensing};
pub use settle::SceneError;
pub use task::Task;
