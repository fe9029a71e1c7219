//! The replays that a server keeps: who records, who plays them again, which are deleted, and which are alike.

mod auditor;
mod folder;
mod retention;

#[cfg(test)]
mod tests;

pub(crate) use auditor::audit;
pub(crate) use folder::{Archive, Recording, stored_path};
