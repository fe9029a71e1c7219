//! `palmares verify`.

use anyhow::Context;
use clap::Args;
use palmares_replay::{self as replay, PublicKey, Replay, Verified, VerifyError};
use palmares_tasks::Task;
use serde_json::json;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

/// Options of `palmares verify`.
#[derive(Args, Debug)]
pub(crate) struct VerifyOptions {
    /// The replays' files
    #[arg(required = true, value_name = "RUN.mcap")]
    files: Vec<PathBuf>,
    /// Expected public key of the server, 64 hexadecimal digits: `replay_key` in GET /v1/competition. Without it the signer is
    /// printed but not checked
    #[arg(long, value_name = "HEX")]
    key: Option<PublicKey>,
    /// Your own task, if runs are of one: a folder with a task.toml. May be given several times
    #[arg(long = "task", value_name = "PATH")]
    tasks: Vec<PathBuf>,
    /// Print one JSON object per file
    #[arg(long)]
    json: bool,
}

/// Verifies every file and prints the result.
pub(crate) fn verify(options: &VerifyOptions) -> anyhow::Result<ExitCode> {
    let mut code = ExitCode::SUCCESS;
    let tasks = own_tasks(&options.tasks)?;
    let mut out = std::io::stdout().lock();
    for file in &options.files {
        let bytes = load(file)?;
        let result = check(&bytes, options.key.as_ref(), &tasks);
        if result.is_err() {
            code = ExitCode::FAILURE;
        }
        let line = if options.json { as_json(file, &result) } else { as_text(file, &result, options.key) };
        writeln!(out, "{line}")?;
    }
    Ok(code)
}

/// Tasks from folders.
pub(crate) fn own_tasks(paths: &[PathBuf]) -> anyhow::Result<Vec<Arc<Task>>> {
    paths.iter().map(|path| Ok(Arc::new(Task::load(path)?.task))).collect()
}

/// A file's bytes; a file that is too large for a replay is not read.
pub(crate) fn load(file: &Path) -> anyhow::Result<Vec<u8>> {
    let failed = || format!("cannot read {}", file.display());
    let facts = std::fs::metadata(file).with_context(failed)?;
    anyhow::ensure!(facts.is_file(), "{}: not a file", file.display());
    anyhow::ensure!(
        facts.len() <= replay::FILE_BYTES as u64,
        "{}: {} bytes are too many for a replay, the maximum is {}",
        file.display(),
        facts.len(),
        replay::FILE_BYTES
    );
    std::fs::read(file).with_context(failed)
}

fn check(
    bytes: &[u8],
    key: Option<&PublicKey>,
    tasks: &[Arc<Task>],
) -> Result<(Replay, Verified), VerifyError> {
    let replay = replay::read(bytes)?;
    replay.signed_by(key)?;
    let verified = replay::verify(&replay, tasks)?;
    Ok((replay, verified))
}

fn as_text(file: &Path, result: &Result<(Replay, Verified), VerifyError>, key: Option<PublicKey>) -> String {
    let file = file.display();
    match result {
        Ok((replay, verified)) => {
            let header = &replay.header;
            let known = if key.is_some() { "" } else { " (not checked; give the expected key with --key)" };
            format!(
                "{file}: verified: {} of {:?}, {} with {}: score {}, {} ticks, {} states equal\n  signed by {}{known}",
                header.run_id,
                header.team,
                header.task,
                header.hand,
                verified.score,
                verified.ticks,
                verified.states,
                replay.key,
            )
        }
        Err(refused) => format!("{file}: refused: {}: {refused}", refused.name()),
    }
}

fn as_json(file: &Path, result: &Result<(Replay, Verified), VerifyError>) -> String {
    let file = file.display().to_string();
    match result {
        Ok((replay, verified)) => json!({
            "file": file, "verdict": "verified", "run_id": replay.header.run_id, "team": replay.header.team,
            "task": replay.header.task, "hand": replay.header.hand, "score": verified.score,
            "ticks": verified.ticks, "states": verified.states, "key": replay.key.to_string(),
        }),
        Err(refused) => json!({
            "file": file, "verdict": "refused", "reason": refused.name(), "message": refused.to_string(),
            "tick": refused.tick(),
        }),
    }
    .to_string()
}
