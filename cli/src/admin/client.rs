//! A server's REST addresses, as an organizer.

use anyhow::{Context, bail, ensure};
use clap::Args;
use palmares_protocol::text::printable;
use serde_json::Value;
use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Duration;

/// How long a server may take for the head of an answer.
const TIMEOUT: Duration = Duration::from_secs(60);

/// Which server, and as whom. The token is never an argument: other users of the machine could read it.
#[derive(Args, Debug)]
pub(crate) struct Access {
    /// The server. Without TLS the token is readable on the way: use it on the server's machine, or through a tunnel
    #[arg(
        long,
        global = true,
        value_name = "URL",
        env = "PALMARES_URL",
        default_value = "http://127.0.0.1:8080"
    )]
    url: String,

    /// A file with an organizer's token; left out, the environment's PALMARES_TOKEN, or else organizer.token in the
    /// server's data directory: PALMARES_DATA_DIR, or .palmares here
    #[arg(long, global = true, value_name = "FILE", env = "PALMARES_TOKEN_FILE")]
    token_file: Option<PathBuf>,
}

impl Access {
    fn token(&self) -> anyhow::Result<String> {
        let path = match (&self.token_file, std::env::var("PALMARES_TOKEN")) {
            (None, Ok(token)) => return Ok(token),
            (Some(path), _) => path.clone(),
            (None, Err(_)) => {
                let folder = std::env::var_os("PALMARES_DATA_DIR").map_or(".palmares".into(), PathBuf::from);
                folder.join("organizer.token")
            }
        };
        let text = std::fs::read_to_string(&path).with_context(|| {
            format!(
                "cannot read an organizer's token from {}; name its file with --token-file: the first one lies in the \
                 server's data directory",
                path.display()
            )
        })?;
        Ok(text.trim().to_owned())
    }
}

/// An organizer's connection.
pub(crate) struct Client {
    agent: ureq::Agent,
    url: String,
    authorization: String,
}

type Answer = ureq::http::Response<ureq::Body>;

impl Client {
    pub(crate) fn new(access: &Access) -> anyhow::Result<Self> {
        let config = ureq::Agent::config_builder()
            .timeout_recv_response(Some(TIMEOUT))
            .http_status_as_error(false)
            .max_redirects(0)
            .proxy(None);
        let authorization = format!("Bearer {}", access.token()?);
        let url = access.url.trim_end_matches('/').to_owned();
        ensure!(
            url.starts_with("http://") || url.starts_with("https://"),
            "--url {url}: expected http://HOST:PORT"
        );
        Ok(Client { agent: config.build().into(), url, authorization })
    }

    pub(crate) fn get(&self, path: &str) -> anyhow::Result<Value> {
        json(self.ask(path)?)
    }

    pub(crate) fn post(&self, path: &str, body: &Value) -> anyhow::Result<Value> {
        let address = format!("{}{path}", self.url);
        let request = self.agent.post(&address).header("Authorization", &self.authorization);
        let request = request.header("Content-Type", "application/json");
        let answer = request.send(body.to_string().as_bytes());
        json(checked(answer.with_context(|| silent(&address))?)?)
    }

    /// Writes an answer's body to `to`, however long it is.
    pub(crate) fn fetch(&self, path: &str, to: &mut impl Write) -> anyhow::Result<()> {
        let mut answer = self.ask(path)?;
        let mut body = answer.body_mut().with_config().limit(u64::MAX).reader();
        io::copy(&mut body, to).context("the answer broke off")?;
        Ok(())
    }

    fn ask(&self, path: &str) -> anyhow::Result<Answer> {
        let address = format!("{}{path}", self.url);
        let request = self.agent.get(&address).header("Authorization", &self.authorization);
        checked(request.call().with_context(|| silent(&address))?)
    }
}

fn silent(address: &str) -> String {
    format!("{address} does not answer; is the server running? --url names another")
}

/// A problem as an error.
fn checked(mut answer: Answer) -> anyhow::Result<Answer> {
    let status = answer.status();
    if status.is_success() {
        return Ok(answer);
    }
    let text = answer.body_mut().read_to_string().unwrap_or_default();
    match serde_json::from_str::<Value>(&text) {
        Ok(Value::Object(problem)) if problem.contains_key("detail") => {
            let word = |name: &str| problem.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
            bail!("{}: {}", word("code"), printable(&word("detail")))
        }
        _ => bail!("{status}: {}", text.trim()),
    }
}

fn json(mut answer: Answer) -> anyhow::Result<Value> {
    let text = answer.body_mut().with_config().limit(u64::MAX).read_to_string()?;
    serde_json::from_str(&text).context("the answer is not JSON")
}

/// An id for a path: what is no letter, digit or underscore is escaped.
pub(crate) fn escaped(id: &str) -> String {
    id.bytes()
        .map(|byte| match byte {
            b'_' => "_".to_owned(),
            byte if byte.is_ascii_alphanumeric() => char::from(byte).to_string(),
            byte => format!("%{byte:02X}"),
        })
        .collect()
}

#[cfg(test)]
mod tests {
    use super::escaped;

    #[test]
    fn an_id_stays_one_part_of_a_path() {
        assert_eq!(escaped("run_1a"), "run_1a");
        assert_eq!(escaped("../x?y"), "%2E%2E%2Fx%3Fy");
    }
}
