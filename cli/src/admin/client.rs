//! An HTTP client for the server's addresses, with an organizer's token.

use crate::environment::variable;
use crate::http::{self, unreachable};
use anyhow::{Context, anyhow, bail};
use clap::Args;
use palmares_protocol::text::printable;
use serde_json::{Value, json};
use std::io::{self, Write};
use std::path::PathBuf;
use std::time::Duration;

/// Longest wait for the head of a response.
const TIMEOUT: Duration = Duration::from_secs(60);

/// The server and the token. The token is never an argument, since other users of the machine could read it.
#[derive(Args, Debug)]
pub(crate) struct Access {
    /// The server's URL, http or https. Without TLS the token can be read on the network: use http only on the server's machine or
    /// through a tunnel
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

    /// A file with certificates (PEM) that are trusted in addition to the system's, for https: of an authority, or the server's own
    #[arg(long, global = true, value_name = "FILE", env = "PALMARES_CA")]
    ca: Option<PathBuf>,
}

impl Access {
    fn token(&self) -> anyhow::Result<String> {
        let path = match (&self.token_file, variable("PALMARES_TOKEN")) {
            (None, Some(token)) => {
                return token.into_string().map_err(|_| anyhow!("PALMARES_TOKEN: expected a token, plm_…"));
            }
            (Some(path), _) => path.clone(),
            (None, None) => {
                let folder = variable("PALMARES_DATA_DIR").map_or(".palmares".into(), PathBuf::from);
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

/// Rows of a page of a long list; the server sends no more.
const PAGE_ROWS: usize = 1000;

/// A list that the server sends in pages.
pub(crate) struct Paged {
    pub(crate) path: &'static str,
    /// Name of the list in the response.
    pub(crate) rows: &'static str,
    /// Field of a row that the query for the next page has, and its name there.
    pub(crate) cursor: (&'static str, &'static str),
    /// Whether the server sends the newest first. They are returned oldest first: at a terminal the newest are at the end.
    pub(crate) newest_first: bool,
}

type Response = ureq::http::Response<ureq::Body>;

impl Client {
    pub(crate) fn new(access: &Access) -> anyhow::Result<Self> {
        Self::with_token(access, access.token()?)
    }

    pub(crate) fn with_token(access: &Access, token: String) -> anyhow::Result<Self> {
        let config = ureq::Agent::config_builder()
            .timeout_recv_response(Some(TIMEOUT))
            .http_status_as_error(false)
            .max_redirects(0)
            .proxy(None);
        let url = access.url.trim_end_matches('/').to_owned();
        let agent = http::agent(config, &url, access.ca.as_deref())?;
        let authorization = format!("Bearer {token}");
        Ok(Client { agent, url, authorization })
    }

    pub(crate) fn get(&self, path: &str) -> anyhow::Result<Value> {
        json(self.request(path)?)
    }

    /// A list with all its pages, at most `limit` rows, and whether there are more.
    pub(crate) fn pages(
        &self,
        list: &Paged,
        fields: Vec<(&str, Option<String>)>,
        limit: Option<u32>,
    ) -> anyhow::Result<Value> {
        let limit = limit.map_or(usize::MAX, |limit| limit as usize);
        let mut rows: Vec<Value> = Vec::new();
        let mut after = None;
        loop {
            let wanted = PAGE_ROWS.min(limit - rows.len());
            let mut query = fields.clone();
            query.push(("limit", Some(wanted.to_string())));
            if after.is_some() {
                query.retain(|(name, _)| *name != list.cursor.1);
                query.push((list.cursor.1, after));
            }
            let mut page = self.get(&with_query(list.path, &query))?;
            let Value::Array(more) = page[list.rows].take() else {
                bail!("this server sends no `{}`: it is older than this program", list.rows)
            };
            let there_is_more = page["more"] == true;
            after = more.last().map(|row| match &row[list.cursor.0] {
                Value::String(id) => id.clone(),
                number => number.to_string(),
            });
            rows.extend(more);
            if !there_is_more || rows.len() >= limit || after.is_none() {
                if list.newest_first {
                    rows.reverse();
                }
                return Ok(json!({list.rows: rows, "more": there_is_more}));
            }
        }
    }

    pub(crate) fn post(&self, path: &str, body: &Value) -> anyhow::Result<Value> {
        let address = format!("{}{path}", self.url);
        let request = self.agent.post(&address).header("Authorization", &self.authorization);
        let request = request.header("Content-Type", "application/json");
        let response = request.send(body.to_string().as_bytes());
        json(checked(response.map_err(|error| unreachable(&address, &error))?)?)
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
        checked(request.call().map_err(|error| unreachable(&address, &error))?)
    }
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
            // An import names each bad line in a line of its own.
            let detail: Vec<_> = word("detail").lines().map(|line| printable(line).into_owned()).collect();
            bail!("{}: {}", word("code"), detail.join("\n"))
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
