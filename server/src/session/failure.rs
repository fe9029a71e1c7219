//! Refusals for failures of the server.

use palmares_net::auth;
use palmares_protocol::{Code, Refusal};
use palmares_store::StoreError;

/// `bytes` random bytes as lower-case hexadecimal.
pub(super) fn random_hex(bytes: usize) -> Result<String, Refusal> {
    auth::random_hex(bytes).map_err(|error| {
        tracing::error!(%error, "no randomness");
        Refusal::new(Code::Internal, "the server has no randomness")
    })
}

/// Logs a failure of the database and returns the refusal for the client.
pub(super) fn store_failed(what: &str) -> impl Fn(StoreError) -> Refusal {
    move |error| {
        tracing::error!(%error, what, "the database failed");
        Refusal::new(Code::Internal, format!("database error on {what}; nothing was lost, try again"))
            .retry_after(1.0)
    }
}
