//! Runs: scene, rules, referee and score. No sockets, no clocks, no files at run time.
//!
//! | part | content |
//! |---|---|
//! | `tasks/src/task/` | a task as data; `rules/`: conditions and points, a file for each kind of rules |
//! | `tasks/src/place/`, `tasks/src/settle.rs`, `start.rs` | the objects of a run and their first poses; they settle without the hand; the hand comes in |
//! | `tasks/src/run/` | a run from tick 0 to its score: `tick.rs` steps it, `observe.rs` makes observations, `snapshot.rs` snapshots |
//! | `tasks/src/referee/` | what happened to the objects: events, counts and points |
//! | `tasks/src/training/` | shaped rewards, and runs that differ from those of the task |

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
