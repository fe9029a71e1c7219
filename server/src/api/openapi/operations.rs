//! The addresses, one entry each.

use super::super::admin::{
    competition, export, hands as admin_hands, runs as admin_runs, sessions as admin_sessions, teams,
};
use super::super::{hands, rest, runs};
use super::{Content, Operation, Token, get, of, post};
use crate::store::{HandRow, RunRecord};
use palmares_models::hand::describe::HandDescription;
use serde_json::{Map, Value};

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
        get("/v1/sessions", "The sessions: a team's own, for organizers all", of::<runs::Sessions>())
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
    let deeds = [
        post(
            "/v1/admin/competition/{verb}",
            "Let sessions begin, let no further one begin, end it for good and publish the secret of the seeds",
            of::<competition::Body>(),
            of::<competition::Answer>(),
        )
        .words(&["open", "close", "reveal"]),
        post(
            "/v1/admin/team/add",
            "Add a team; answers its token",
            of::<teams::TeamBody>(),
            of::<teams::Issued>(),
        ),
        post(
            "/v1/admin/team/rotate",
            "Give a team a new token instead of the old",
            of::<teams::TeamBody>(),
            of::<teams::Issued>(),
        ),
        post(
            "/v1/admin/team/revoke",
            "Take a team's tokens back",
            of::<teams::TeamBody>(),
            of::<teams::Revoked>(),
        ),
        get("/v1/admin/teams", "The teams", of::<teams::Teams>()),
        post(
            "/v1/admin/token/add",
            "Make a token for an organizer or a viewer",
            of::<teams::TokenBody>(),
            of::<teams::Issued>(),
        ),
        post("/v1/admin/token/revoke", "Take a token back", of::<teams::TokenId>(), of::<teams::Revoked>()),
        get("/v1/admin/tokens", "The tokens without their secrets", of::<teams::Tokens>()),
        post(
            "/v1/admin/session/{verb}",
            "Hold a session, let it go on, end it, void it, give it time",
            of::<admin_sessions::Body>(),
            of::<admin_sessions::Answer>(),
        )
        .words(&["pause", "resume", "end", "void", "grant"]),
        post(
            "/v1/admin/run/{verb}",
            "Void a run and give its time back, or have its replay played again",
            of::<admin_runs::Body>(),
            of::<admin_runs::Answer>(),
        )
        .words(&["void", "reverify"]),
        get("/v1/admin/hands", "The hands of all teams", of::<admin_hands::List>()),
        get(
            "/v1/admin/hands/{id}",
            "A hand's figures beside those of the program's hands and the limits",
            of::<admin_hands::Shown>(),
        ),
        get("/v1/admin/hands/{id}/archive", "A hand's archive, as it was sent in", ZIP),
        post(
            "/v1/admin/hand/{verb}",
            "Let a team play a hand of its own officially, or do not",
            of::<admin_hands::Body>(),
            of::<admin_hands::Decided>(),
        )
        .words(&["approve", "reject"]),
        get("/v1/admin/audit", "Who decided what, when and why", of::<export::Records>())
            .query("after", "Only records after this number")
            .query("limit", "At most so many, 1000 if left out, and never more"),
        get("/v1/admin/export/{what}", "A table, whole: a list of rows", of::<Vec<Map<String, Value>>>())
            .words(&["leaderboard", "sessions", "runs", "audit"])
            .query("format", "json or csv"),
        get("/v1/admin/backup", "Everything as one archive, secrets included", ZIP),
    ];
    deeds.into_iter().map(|operation| operation.token(Token::Organizer))
}
