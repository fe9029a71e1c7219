//! The verdict on a replay, as text and as JSON.

use palmares_replay::{Replay, Verified, VerifyError};
use serde::{Deserialize, Serialize};

/// The verdict on a replay.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(tag = "verdict", rename_all = "snake_case")]
pub(super) enum Verdict {
    Verified {
        run_id: String,
        team: String,
        task: String,
        hand: String,
        score: f64,
        ticks: u64,
        states: usize,
        key: String,
        /// SHA-256 of the file; empty if another version has verified it.
        #[serde(default)]
        sha256: String,
    },
    Refused {
        reason: String,
        message: String,
        tick: Option<u64>,
    },
    /// There is no verdict.
    Unreadable {
        message: String,
    },
}

impl From<Result<(Replay, Verified), VerifyError>> for Verdict {
    fn from(result: Result<(Replay, Verified), VerifyError>) -> Self {
        match result {
            Ok((replay, Verified { ticks, states, score })) => Verdict::Verified {
                run_id: replay.header.run_id,
                team: replay.header.team,
                task: replay.header.task,
                hand: replay.header.hand,
                score,
                ticks,
                states,
                key: replay.key.to_string(),
                sha256: replay.sha256,
            },
            Err(refused) => Verdict::Refused {
                reason: refused.name().to_owned(),
                message: refused.to_string(),
                tick: refused.tick(),
            },
        }
    }
}

impl Verdict {
    /// A line for people, or two. `known`: the key was checked.
    pub(super) fn text(&self, file: &str, known: bool) -> String {
        match self {
            Verdict::Verified { run_id, team, task, hand, score, ticks, states, key, .. } => {
                let known = if known { "" } else { " (not checked; give the expected key with --key)" };
                format!(
                    "{file}: verified: {run_id} of {team:?}, {task} with {hand}: score {score}, {ticks} ticks, {states} states equal\n  \
                     signed by {key}{known}"
                )
            }
            Verdict::Refused { reason, message, .. } => format!("{file}: refused: {reason}: {message}"),
            Verdict::Unreadable { message } => format!("{file}: unreadable: {message}"),
        }
    }

    /// A JSON object.
    pub(super) fn json(&self, file: &str) -> String {
        #[derive(Serialize)]
        struct Line<'a> {
            file: &'a str,
            #[serde(flatten)]
            verdict: &'a Verdict,
        }
        // Strings and numbers: encoding cannot fail.
        serde_json::to_string(&Line { file, verdict: self }).unwrap_or_default()
    }
}
