//! The addresses, one entry each.

use super::super::{hands, rest};
use super::{Content, Operation, Token, get, object, of, post};
use crate::store::{HandRow, RunRecord};
use palmares_models::describe::HandDescription;
use serde_json::Value;

const TEXT: Content = Content::Other("text/plain");
const CSV: Content = Content::Other("text/csv");
const ZIP: Content = Content::Other("application/zip");
/// Whose hands are meant, where there are no tokens.
const WHOSE: &str = "Name of the team, on a practice server";

/// Every address and method of the router.
pub(super) fn operations() -> Vec<Operation> {
    let mut all = vec![
        get("/", "The leaderboard as a page", Content::Other("text/html")),
        get("/healthz", "The process lives", TEXT),
        get("/readyz", "The server can take work", TEXT),
        get(
            "/metrics",
            "What the server counts about itself",
            Content::Other("application/openmetrics-text"),
        ),
        get("/openapi.json", "This document", of::<Value>()),
        get("/v1/control", "The control socket of a team", Content::Socket).token(Token::Optional),
        get("/v1/watch", "The watch socket of a spectator", Content::Socket).token(Token::Optional),
        get("/v1/competition", "What is being played here", of::<rest::CompetitionAnswer>()),
        get("/v1/tasks", "The tasks", of::<rest::Tasks>()),
        get("/v1/hands", "The hands in short", of::<hands::Hands>())
            .query("team", WHOSE)
            .token(Token::Optional),
        post("/v1/hands", "Send in a hand of one's own", ZIP, of::<HandRow>())
            .query("team", WHOSE)
            .token(Token::Optional)
            .created(),
        get("/v1/hands/{name}", "A hand in full", of::<HandDescription>())
            .query("team", WHOSE)
            .token(Token::Optional),
        get("/v1/leaderboard", "The ranking", of::<rest::Leaderboard>()),
        get("/v1/leaderboard.csv", "The ranking as a table", CSV),
        get("/v1/sessions", "The sessions: a team's own, for organizers all", object())
            .token(Token::Required),
        get("/v1/runs/{id}", "A run as stored", of::<RunRecord>()).token(Token::Optional),
        get(
            "/v1/runs/{id}/replay",
            "A run's replay, an MCAP file",
            Content::Other("application/octet-stream"),
        )
        .token(Token::Optional),
    ];
    all.extend(deeds());
    all
}

/// What organizers do.
fn deeds() -> impl Iterator<Item = Operation> {
    let deed = |path, summary| post(path, summary, object(), object());
    let deeds = [
        deed("/v1/admin/competition/{verb}", "open, close or reveal: {reason?}"),
        deed("/v1/admin/team/add", "Add a team; answers its token: {team, reason?}"),
        deed("/v1/admin/team/rotate", "A new token instead of the old: {team, reason?}"),
        deed("/v1/admin/team/revoke", "Take a team's tokens back: {team, reason?}"),
        get("/v1/admin/teams", "The teams", object()),
        deed("/v1/admin/token/add", "A token for an organizer or a viewer: {role, label?, reason?}"),
        deed("/v1/admin/token/revoke", "Take a token back: {token_id, reason?}"),
        get("/v1/admin/tokens", "The tokens without their secrets", object()),
        deed(
            "/v1/admin/session/{verb}",
            "pause, resume, end, void or grant: {session_id, reason?, seconds?}",
        ),
        deed("/v1/admin/run/{verb}", "void or reverify: {run_id, reason?}"),
        get("/v1/admin/hands", "The hands of all teams", object()),
        deed("/v1/admin/hand/{verb}", "approve or reject: {hand_id, reason?}"),
        get("/v1/admin/audit", "Who decided what, when and why", object())
            .query("after", "Only records after this number")
            .query("limit", "At most so many"),
        get("/v1/admin/export/{what}", "leaderboard, sessions, runs or audit, whole", of::<Value>())
            .query("format", "json or csv"),
        get("/v1/admin/backup", "Everything as one archive, secrets included", ZIP),
    ];
    deeds.into_iter().map(|operation| operation.token(Token::Organizer))
}
