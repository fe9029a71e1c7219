//! The replays that a server keeps: who records, who plays them again, which are deleted, and which are alike.

mod auditor;
mod folder;
mod retention;
mod similar_runs;

#[cfg(test)]
mod tests;

pub(crate) use auditor::audit;
pub(crate) use folder::{Archive, KEY_FILE, Recording, stored_path};
#[cfg(test)]
pub(crate) use similar_runs::Mark;
pub(crate) use similar_runs::{Marks, is_told};
