//! Extractors for parts of an address, whose errors are problems.

use axum::extract::{self, FromRequestParts};
use axum::http::request::Parts;
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use serde::de::DeserializeOwned;

fn bad(what: &str, why: &str) -> Problem {
    Problem::new(Code::BadRequest, format!("{what}: {why}"))
}

/// The variable part of the path.
pub(super) struct Path(pub(super) String);

impl<S: Send + Sync> FromRequestParts<S> for Path {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        match extract::Path::<String>::from_request_parts(parts, state).await {
            Ok(extract::Path(text)) => Ok(Path(text)),
            Err(error) => Err(bad("address", &error.body_text())),
        }
    }
}

/// The query of the address.
pub(super) struct Query<T>(pub(super) T);

impl<S: Send + Sync, T: DeserializeOwned> FromRequestParts<S> for Query<T> {
    type Rejection = Problem;

    async fn from_request_parts(parts: &mut Parts, state: &S) -> Result<Self, Problem> {
        match extract::Query::<T>::from_request_parts(parts, state).await {
            Ok(extract::Query(query)) => Ok(Query(query)),
            Err(error) => Err(bad("query", &error.body_text())),
        }
    }
}
