//! An HTTP client for the server's addresses, with an organizer's token.

use anyhow::{Context, bail, ensure};
use clap::Args;
use palmares_protocol::text::printable;
use serde_json::Value;
use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Duration;

/// Longest wait for the head of a response.
const TIMEOUT: Duration = Duration::from_secs(60);

/// The server and the token. The token is never an argument, since other users of the machine could read it.
#[derive(Args, Debug)]
pub(crate) struct Access {
    /// The server's URL. Without TLS the token can be read on the network: use http only on the server's machine or through a
    /// tunnel
    #[arg(
        long,
        global = true,
        value_name = "URL",
        env = "PALMARES_URL",
        default_value = "http://127.0.0.1:8080"
    )]
    url: String,

    /// A file with an organizer's token [default: the environment's PALMARES_TOKEN, or else organizer.token in the server's
    /// data directory, PALMARES_DATA_DIR or .palmares]
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
                "cannot read an organizer's token from {}; name its file with --token-file: the first one is in the \
                 server's data directory",
                path.display()
            )
        })?;
        Ok(text.trim().to_owned())
    }
}

/// A client with an organizer's token.
pub(crate) struct Client {
    agent: ureq::Agent,
    url: String,
    authorization: String,
}

type Response = ureq::http::Response<ureq::Body>;

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
        json(self.request(path)?)
    }

    pub(crate) fn post(&self, path: &str, body: &Value) -> anyhow::Result<Value> {
        let address = format!("{}{path}", self.url);
        let request = self.agent.post(&address).header("Authorization", &self.authorization);
        let request = request.header("Content-Type", "application/json");
        let response = request.send(body.to_string().as_bytes());
        json(checked(response.with_context(|| silent(&address))?)?)
    }

    /// Writes a response's body of any length to `to`.
    pub(crate) fn fetch(&self, path: &str, to: &mut impl Write) -> anyhow::Result<()> {
        let mut response = self.request(path)?;
        let mut body = response.body_mut().with_config().limit(u64::MAX).reader();
        io::copy(&mut body, to).context("the response is incomplete")?;
        Ok(())
    }

    fn request(&self, path: &str) -> anyhow::Result<Response> {
        let address = format!("{}{path}", self.url);
        let request = self.agent.get(&address).header("Authorization", &self.authorization);
        checked(request.call().with_context(|| silent(&address))?)
    }
}

fn silent(address: &str) -> String {
    format!("{address} does not answer; is the server running? --url names another")
}

/// Turns a problem into an error.
fn checked(mut response: Response) -> anyhow::Result<Response> {
    let status = response.status();
    if status.is_success() {
        return Ok(response);
    }
    let text = response.body_mut().read_to_string().unwrap_or_default();
    match serde_json::from_str::<Value>(&text) {
        Ok(Value::Object(problem)) if problem.contains_key("detail") => {
            let word = |name: &str| problem.get(name).and_then(Value::as_str).unwrap_or_default().to_owned();
            bail!("{}: {}", word("code"), printable(&word("detail")))
        }
        _ => bail!("{status}: {}", text.trim()),
    }
}

fn json(mut response: Response) -> anyhow::Result<Value> {
    let text = response.body_mut().with_config().limit(u64::MAX).read_to_string()?;
    serde_json::from_str(&text).context("the response is not JSON")
}

/// An address with these fields, without those that are not set.
pub(crate) fn with_query(path: &str, fields: &[(&str, Option<String>)]) -> String {
    let set = fields.iter().filter_map(|(name, value)| Some((name, value.as_ref()?)));
    let set: Vec<String> = set.map(|(name, value)| format!("{name}={}", escaped(value))).collect();
    if set.is_empty() { path.to_owned() } else { format!("{path}?{}", set.join("&")) }
}

/// A part of an address: all bytes but letters, digits and underscores are escaped.
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
    use super::{escaped, with_query};

    #[test]
    fn an_id_is_one_part_of_a_path() {
        assert_eq!(escaped("run_1a"), "run_1a");
        assert_eq!(escaped("../x?y"), "%2E%2E%2Fx%3Fy");
    }

    #[test]
    fn a_query_has_the_fields_that_are_set() {
        let fields = [("team", Some("a&b".to_owned())), ("task", None), ("limit", Some("3".to_owned()))];
        assert_eq!(with_query("/v1/x", &fields), "/v1/x?team=a%26b&limit=3");
        assert_eq!(with_query("/v1/x", &fields[1..2]), "/v1/x");
    }
}
