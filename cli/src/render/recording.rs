//! The replay: a file, or a run on a server.

use crate::http::{self, unreachable};
use anyhow::{bail, ensure};
use palmares_replay::FILE_BYTES;
use std::path::Path;
use std::time::Duration;

/// Longest wait for a file of the largest size.
const TIMEOUT: Duration = Duration::from_secs(120);

/// The name of a replay, and its bytes.
///
/// # Errors
/// There is no such file and no such run, or the server does not answer.
pub(super) fn load(run: &str, url: &str, ca: Option<&Path>) -> anyhow::Result<(String, Vec<u8>)> {
    let is_id = run.starts_with("run_") && run.chars().all(|c| c == '_' || c.is_ascii_alphanumeric());
    if !is_id || Path::new(run).exists() {
        return Ok((run.to_owned(), crate::verify::load(Path::new(run))?));
    }
    let config = ureq::Agent::config_builder()
        .timeout_global(Some(TIMEOUT))
        .http_status_as_error(false)
        .max_redirects(0)
        .proxy(None);
    let agent = http::agent(config, url, ca)?;
    let address = format!("{}/v1/runs/{run}/replay", url.trim_end_matches('/'));
    let mut answer = agent.get(&address).call().map_err(|error| unreachable(&address, &error))?;
    let status = answer.status();
    if !status.is_success() {
        let body = answer.body_mut().read_to_string().unwrap_or_default();
        bail!("{address} answered {status}: {}", body.trim());
    }
    let limit = FILE_BYTES as u64;
    let bytes = answer.body_mut().with_config().limit(limit + 1).read_to_vec();
    let bytes = bytes.map_err(|error| unreachable(&address, &error))?;
    ensure!(bytes.len() <= FILE_BYTES, "{address}: more than {limit} bytes are too many for a replay");
    Ok((address, bytes))
}
