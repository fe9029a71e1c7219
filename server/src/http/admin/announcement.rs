//! Telling everybody something.

use super::request::{Asked, entry};
use crate::problem::Problem;
use crate::store::{Announcement, Store};
use crate::watch::Hub;
use axum::Json;
use axum::extract::State;
use palmares_protocol::Code;
use palmares_protocol::text::hidden;
use schemars::JsonSchema;
use serde::Deserialize;
use std::sync::Arc;

/// Characters of the longest text.
const LONGEST: usize = 500;

/// What, and why.
#[derive(Deserialize, JsonSchema)]
#[serde(deny_unknown_fields)]
#[schemars(rename = "NewAnnouncement")]
pub(in crate::http) struct Body {
    /// At most 500 characters; an empty one takes the one before off the pages.
    text: String,
    /// Kept in the audit.
    #[serde(default)]
    reason: Option<String>,
}

/// The text as it is kept: visible characters and line breaks.
fn checked(text: &str) -> Result<&str, Problem> {
    let text = text.trim();
    let bad = |why: String| Problem::new(Code::BadRequest, format!("text: {why}"));
    let length = text.chars().count();
    if length > LONGEST {
        return Err(bad(format!("it has {length} characters, expected at most {LONGEST}")));
    }
    for (i, c) in text.chars().enumerate().filter(|(_, c)| *c != '\n') {
        if let Some(what) = hidden(c) {
            return Err(bad(format!("character {} is U+{:04X}, {what}", i + 1, u32::from(c))));
        }
    }
    Ok(text)
}

/// Keeps it, and tells whoever watches.
pub(super) async fn announce(
    State(store): State<Store>,
    State(hub): State<Arc<Hub>>,
    asked: Asked<Body>,
) -> Result<Json<Announcement>, Problem> {
    let text = checked(&asked.body.text)?;
    let entry = entry(&asked.identity, "announcement", text, &asked.body.reason);
    let told = store.announce(text, &entry).await?;
    hub.announce_text(&told);
    Ok(Json(told))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_text_has_lines_and_nothing_that_cannot_be_seen() {
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
