//! Errors of a push.

/// Most pushes at once.
pub(super) const MAX_PUSHES: usize = 32;

/// Error of a refused push, which changes nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PushError {
    /// No such link.
    #[error("hand `{hand}` has no link `{link}`; links: {known}")]
    UnknownLink {
        /// Name of the hand.
        hand: String,
        /// What was asked for.
        link: String,
        /// The names there are.
        known: String,
    },
    /// As many as there may be.
    #[error("{} pushes act already; wait until one has ended", MAX_PUSHES)]
    TooMany,
    /// A number that cannot be used.
    #[error("{field}: expected {expected}")]
    BadNumber {
        /// Path of the field.
        field: &'static str,
        /// What would be valid.
        expected: &'static str,
    },
}
