//! What a run *is*: scene, rules, referee and score. No sockets, no clocks, no files at run time.

pub mod action;
pub mod observation;
pub mod run;
pub mod scene;
pub mod seed;

pub use action::{Action, ActionError, BaseTarget};
pub use observation::{Event, Observation, Sensing};
pub use run::{Outcome, Reason, Run, Task};
pub use scene::Scene;
pub use seed::Seed;
