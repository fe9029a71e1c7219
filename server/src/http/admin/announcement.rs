//! Announcements to all clients.

use super::request::{AdminRequest, entry};
use crate::watch::Hub;
use axum::Json;
use axum::extract::State;
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use palmares_protocol::text::hidden;
use palmares_store::{Announcement, Store};
use schemars::JsonSchema;
use serde::Deserialize;
use std::sync::Arc;

/// Longest text, characters.
const MAX_CHARS: usize = 500;

/// An announcement, and the reason for it.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "NewAnnouncement")]
pub(in crate::http) struct NewAnnouncement {
    /// At most 500 characters; an empty text withdraws the one before.
    text: String,
    /// The reason, for the audit.
    #[serde(default)]
    reason: Option<String>,
}

/// Checks the text: visible characters and line breaks.
fn checked(text: &str) -> Result<&str, Problem> {
    let text = text.trim();
    let bad = |why: String| Problem::new(Code::BadRequest, format!("text: {why}"));
    let length = text.chars().count();
    if length > MAX_CHARS {
        return Err(bad(format!("it has {length} characters, expected at most {MAX_CHARS}")));
    }
    for (i, c) in text.chars().enumerate().filter(|(_, c)| *c != '\n') {
        if let Some(what) = hidden(c) {
            return Err(bad(format!("character {} is U+{:04X}, {what}", i + 1, u32::from(c))));
        }
    }
    Ok(text)
}

/// Stores an announcement and sends it to all viewers.
pub(super) async fn announce(
    State(store): State<Store>,
    State(hub): State<Arc<Hub>>,
    request: AdminRequest<NewAnnouncement>,
) -> Result<Json<Announcement>, Problem> {
    let text = checked(&request.body.text)?;
    let entry = entry(&request.identity, "announcement", text, &request.body.reason);
    let announcement = store.announce(text, &entry).await?;
    hub.announce_text(&announcement);
    Ok(Json(announcement))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_has_lines_and_no_invisible_characters() {
        assert_eq!(
            checked(" Lunch at noon.\nThe shelf is closed. 蟹 ").ok(),
            Some("Lunch at noon.\nThe shelf is closed. 蟹")
        );
        assert_eq!(checked("  ").ok(), Some(""));
        let why = |text: &str| checked(text).expect_err(text).0.message;
        assert_eq!(
            why("cr\u{202e}abs"),
            "text: character 3 is U+202E, which steers the direction of writing"
        );
        assert!(why(&"a".repeat(501)).contains("501 characters"));
    }
}
