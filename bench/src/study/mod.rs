//! What a scene needs: its parts, the laws that act in it, the time of a step, and what is worse without each law. The page is
//! docs/report/model.md.

mod command;
mod findings;
mod finished;
mod page;
mod played;
mod scenes;
mod subject;
mod watched;

pub use command::StudyOptions;
