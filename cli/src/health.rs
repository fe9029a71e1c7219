//! `palmares health`, for the health check of a container.

use crate::http::{self, unreachable};
use anyhow::{Context, bail};
use clap::Args;
use std::io::Write;
use std::net::SocketAddr;
use std::path::PathBuf;
use std::time::Duration;

/// Longest wait for the server's response.
const TIMEOUT: Duration = Duration::from_secs(4);

/// Options of `palmares health`.
#[derive(Args, Clone, Debug)]
pub(crate) struct HealthOptions {
    /// The server's URL [default: this machine, at the port of --listen]
    #[arg(long, value_name = "URL", env = "PALMARES_URL")]
    url: Option<String>,

    /// The address on which the server listens
    #[arg(long, value_name = "ADDRESS:PORT", env = "PALMARES_LISTEN", default_value = "127.0.0.1:8080")]
    listen: SocketAddr,

    /// A file with certificates (PEM) that are trusted in addition to the system's, for https: of an authority, or the server's own
    #[arg(long, value_name = "FILE", env = "PALMARES_CA")]
    ca: Option<PathBuf>,
}

impl HealthOptions {
    fn url(&self) -> String {
        match &self.url {
            Some(url) => url.trim_end_matches('/').to_owned(),
            // A server on all addresses is reached on the loopback address.
            None if self.listen.ip().is_unspecified() => format!("http://127.0.0.1:{}", self.listen.port()),
            None => format!("http://{}", self.listen),
        }
    }
}

/// Checks whether a server is ready; an error if it is not, or does not answer.
pub(crate) fn health(options: &HealthOptions) -> anyhow::Result<()> {
    let config = ureq::Agent::config_builder()
        .timeout_global(Some(TIMEOUT))
        .http_status_as_error(false)
        .max_redirects(0)
        .proxy(None);
    let agent = http::agent(config, &options.url(), options.ca.as_deref())?;
    let address = format!("{}/readyz", options.url());
    let mut answer = agent.get(&address).call().map_err(|error| unreachable(&address, &error))?;
    let status = answer.status();
    let body = answer.body_mut().read_to_string().unwrap_or_default();
    if !status.is_success() {
        bail!("{address} answered {status}: {}", body.trim());
    }
    writeln!(std::io::stdout().lock(), "{}", body.trim()).context("cannot write to stdout")
}

#[cfg(test)]
mod tests {
    use super::*;

    fn url(listen: &str, url: Option<&str>) -> String {
        let listen = listen.parse().expect("an address");
        HealthOptions { listen, url: url.map(str::to_owned), ca: None }.url()
    }

    #[test]
    fn a_server_on_all_addresses_is_reached_on_the_loopback_address() {
        assert_eq!(url("0.0.0.0:9000", None), "http://127.0.0.1:9000");
        assert_eq!(url("[::]:9000", None), "http://127.0.0.1:9000");
        assert_eq!(url("10.0.0.2:80", None), "http://10.0.0.2:80");
        assert_eq!(url("0.0.0.0:9000", Some("http://host:1/")), "http://host:1");
    }
}
