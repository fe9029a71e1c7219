//! Announcements of organizers.

use axum::Json;
use axum::extract::State;
use axum::http::header::CACHE_CONTROL;
use axum::response::IntoResponse;
use palmares_net::transport::problem::Problem;
use palmares_store::{Announcement, Store};
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
