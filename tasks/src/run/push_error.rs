//! Errors of a push.

/// Maximum number of pushes at once.
pub(super) const MAX_PUSHES: usize = 32;

/// Error of a refused push, which changes nothing.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PushError {
    /// No such link.
    #[error("hand `{hand}` has no link `{link}`; links: {known}")]
    UnknownLink {
        /// Name of the hand.
        hand: String,
        /// The requested name.
        link: String,
        /// The existing names.
        known: String,
    },
    /// No such object.
    #[error("object: found {object}; the scene has {count}, from 0 on")]
    UnknownObject {
        /// The requested index.
        object: usize,
        /// Number of objects.
        count: usize,
    },
    /// The limit is reached.
    #[error("{} pushes act already; wait until one has ended", MAX_PUSHES)]
    TooMany,
    /// A number that cannot be used.
    #[error("{field}: expected {expected}")]
    BadNumber {
        /// Path of the field.
        field: &'static str,
        /// Valid values.
        expected: &'static str,
    },
}
