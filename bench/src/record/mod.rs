//! The record of a measured page: the engine, the models, the commit, the day and the machine that it is of.
//!
//! A page has it as one line, a JSON as fields. [`pages`] declares the pages, [`list`] says which are of another engine.

mod line;
pub mod list;
mod models;
pub mod pages;
mod stamp;

pub use line::{BadLine, Line};
pub(crate) use models::root;
pub use stamp::{Record, today};
