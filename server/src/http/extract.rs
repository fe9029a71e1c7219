//! Parts of an address, whose errors are problems.

use crate::problem::Problem;
use axum::extract::{FromRequestParts, Path, Query};
use axum::http::request::Parts;
use palmares_protocol::Code;
use serde::de::DeserializeOwned;

fn bad(what: &str, why: &str) -> Problem {
    Problem::new(Code::BadRequest, format!("{what}: {why}"))
}

/// The part of the path that is not fixed.
pub(super) struct Segment(pub(super) String);

impl<S: Send + Sync> FromRequestParts<S> for Segment {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        match Path::<String>::from_request_parts(parts, state).await {
            Ok(Path(text)) => Ok(Segment(text)),
            Err(error) => Err(bad("address", &error.body_text())),
        }
    }
}

/// What stands behind the question mark.
pub(super) struct Asking<T>(pub(super) T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequestParts<S> for Asking<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        match Query::<T>::from_request_parts(parts, state).await {
            Ok(Query(asked)) => Ok(Asking(asked)),
            Err(error) => Err(bad("query", &error.body_text())),
        }
    }
}
