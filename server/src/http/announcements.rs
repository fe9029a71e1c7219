//! Announcements of organizers.

use crate::store::{Announcement, Store};
use crate::transport::problem::Problem;
use axum::Json;
use axum::extract::State;
use axum::http::header::CACHE_CONTROL;
use axum::response::IntoResponse;
use schemars::JsonSchema;
use serde::Serialize;

/// Number of announcements in the list.
const LISTED: u32 = 100;

/// Announcements, newest first.
#[derive(Serialize, JsonSchema)]
pub(super) struct Announcements {
    announcements: Vec<Announcement>,
}

/// The announcements, newest first.
pub(super) async fn list(State(store): State<Store>) -> Result<impl IntoResponse, Problem> {
    let announcements = store.announcements(LISTED).await?;
    Ok(([(CACHE_CONTROL, "no-store")], Json(Announcements { announcements })))
}
