//! The option with the reason of an action.

use clap::Args;

/// The reason of an action.
#[derive(Args, Debug)]
pub(super) struct Reason {
    /// The reason, for the audit
    #[arg(long, allow_hyphen_values = true)]
    pub(super) reason: Option<String>,
}
