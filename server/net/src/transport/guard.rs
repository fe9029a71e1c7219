//! Decides which web pages may use the server. A browser sends the requests of any page, also to servers on its own machine.
//! But it names the page (`Origin`) and the server (`Host`), and a page cannot set these headers. Programs send no `Origin`.

use axum::http::header::{HOST, HeaderName, ORIGIN, UPGRADE};
use axum::http::{HeaderMap, Method};
use palmares_protocol::text::shortened;
use palmares_protocol::{Code, Refusal};
use std::net::IpAddr;

const FETCH_SITE: HeaderName = HeaderName::from_static("sec-fetch-site");

/// The names under which the server is served, and the pages that may use it.
#[derive(Clone, Debug, Default)]
pub struct Guard {
    /// The server listens on the loopback interface only, for clients on this machine.
    pub loopback: bool,
    /// Names of the server, in addition to its addresses.
    pub hosts: Vec<String>,
    /// Sites whose pages may use it, in addition to its own: `https://cup.example.org`.
    pub origins: Vec<String>,
}

/// Name and port of `name:port`; an IPv6 address is in brackets.
fn parts(authority: &str) -> (&str, Option<&str>) {
    match authority.rsplit_once(':') {
        Some((name, port)) if !port.contains(']') => (name, Some(port)),
        _ => (authority, None),
    }
}

fn address(name: &str) -> Option<IpAddr> {
    name.trim_start_matches('[').trim_end_matches(']').parse().ok()
}

fn is_loopback(name: &str) -> bool {
    name.eq_ignore_ascii_case("localhost") || address(name).is_some_and(|address| address.is_loopback())
}

/// Scheme and authority of an origin; None unless it is http or https.
fn page(origin: &str) -> Option<(&str, &str)> {
    let (scheme, authority) = origin.split_once("://")?;
    matches!(scheme, "http" | "https").then_some((scheme, authority))
}

/// Name and port of an authority, with the scheme's default port.
fn with_port<'a>(authority: &'a str, scheme: &str) -> (&'a str, String) {
    let (name, port) = parts(authority);
    let usual = if scheme == "https" { "443" } else { "80" };
    (name, port.unwrap_or(usual).to_owned())
}

fn forbidden(message: String) -> Refusal {
    Refusal::new(Code::Forbidden, message)
}

/// The only value of a header; an error when there are several or it is not text.
fn only(headers: &HeaderMap, name: HeaderName) -> Result<Option<&str>, Refusal> {
    let mut values = headers.get_all(&name).iter();
    let value = values.next().map(|value| value.to_str());
    match (value, values.next()) {
        (None, _) => Ok(None),
        (Some(Ok(value)), None) => Ok(Some(value)),
        _ => Err(Refusal::new(Code::BadRequest, format!("{name}: expected once, as text"))),
    }
}

impl Guard {
    /// Checks the form of names and sites.
    ///
    /// # Errors
    /// One cannot be compared with a header.
    pub fn check_names(&self) -> anyhow::Result<()> {
        let plain = |text: &str| !text.is_empty() && !text.contains(|c: char| c == '/' || c.is_whitespace());
        if let Some(wrong) = self.hosts.iter().find(|host| !plain(host)) {
            anyhow::bail!("allowed_hosts: `{wrong}`: expected a name such as cup.example.org");
        }
        let site = |origin: &&String| !page(origin).is_some_and(|(_, authority)| plain(authority));
        if let Some(wrong) = self.origins.iter().find(site) {
            anyhow::bail!(
                "allowed_origins: `{wrong}`: expected a site such as https://cup.example.org, without a path"
            );
        }
        Ok(())
    }

    /// Checks the headers of a request.
    pub fn check(&self, method: &Method, headers: &HeaderMap) -> Result<(), Refusal> {
        let host = only(headers, HOST)?;
        if let Some(host) = host {
            self.check_host(host)?;
        }
        let reads = (*method == Method::GET || *method == Method::HEAD) && !headers.contains_key(UPGRADE);
        if reads { Ok(()) } else { self.check_page(host, headers) }
    }

    fn check_host(&self, host: &str) -> Result<(), Refusal> {
        let (name, _) = parts(host);
        let known =
            |allowed: &String| allowed.eq_ignore_ascii_case(name) || allowed.eq_ignore_ascii_case(host);
        let checked = self.loopback || !self.hosts.is_empty();
        // DNS rebinding: a foreign name may resolve to this machine; an address cannot change.
        if !checked || is_loopback(name) || address(name).is_some() || self.hosts.iter().any(known) {
            return Ok(());
        }
        Err(forbidden(format!(
            "this server is not served as `{}`; use its address, or name it with --allowed-host or in allowed_hosts",
            shortened(name)
        )))
    }

    fn check_page(&self, host: Option<&str>, headers: &HeaderMap) -> Result<(), Refusal> {
        let refused = |page: &str| {
            Err(forbidden(format!(
                "a page of {} may not use this server; allow it with --allowed-origin or in allowed_origins",
                shortened(page)
            )))
        };
        let Some(origin) = only(headers, ORIGIN)? else {
            return match only(headers, FETCH_SITE)? {
                None | Some("none" | "same-origin") => Ok(()),
                Some(_) => refused("another site"),
            };
        };
        if self.origins.iter().any(|allowed| allowed.eq_ignore_ascii_case(origin)) {
            return Ok(());
        }
        let (Some((scheme, authority)), Some(host)) = (page(origin), host) else { return refused(origin) };
        let (page_name, page_port) = with_port(authority, scheme);
        let (host_name, host_port) = with_port(host, scheme);
        let same = page_name.eq_ignore_ascii_case(host_name)
            || self.loopback && is_loopback(page_name) && is_loopback(host_name);
        if same && page_port == host_port { Ok(()) } else { refused(origin) }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn asks(guard: &Guard, method: Method, headers: &[(&str, &str)]) -> bool {
        let mut map = HeaderMap::new();
        for (name, value) in headers {
            let name: HeaderName = name.parse().expect("a name");
            map.append(name, value.parse().expect("a value"));
        }
        guard.check(&method, &map).is_ok()
    }

    #[test]
    fn a_local_server_answers_to_its_own_names_only() {
        let guard = Guard { loopback: true, hosts: vec!["cup.example.org".into()], ..Guard::default() };
        for host in ["127.0.0.1:8080", "localhost", "LOCALHOST:1", "[::1]:80", "cup.example.org:443"] {
            assert!(asks(&guard, Method::GET, &[("host", host)]), "{host}");
        }
        for host in ["evil.example", "localhost.evil.example:8080", "127.0.0.1.evil.example", ""] {
            assert!(!asks(&guard, Method::GET, &[("host", host)]), "{host}");
        }
        assert!(!asks(&guard, Method::GET, &[("host", "localhost"), ("host", "evil.example")]));
        assert!(asks(&Guard::default(), Method::GET, &[("host", "palmares:8080")]), "open to a network");
    }

    #[test]
    fn pages_of_other_sites_may_neither_open_sockets_nor_post() {
        let guard =
            Guard { loopback: true, origins: vec!["https://cup.example.org".into()], ..Guard::default() };
        let local = ("host", "127.0.0.1:8080");
        let may = |origin: &str, upgrade: bool| {
            let (method, socket) = match upgrade {
                true => (Method::GET, ("upgrade", "websocket")),
                false => (Method::POST, ("x-nothing", "")),
            };
            asks(&guard, method, &[local, ("origin", origin), socket])
        };
        for upgrade in [true, false] {
            for origin in ["http://127.0.0.1:8080", "http://localhost:8080", "https://cup.example.org"] {
                assert!(may(origin, upgrade), "{origin}");
            }
            for origin in [
                "https://evil.example",
                "http://127.0.0.1:9000",
                "http://localhost",
                "null",
                "file://",
                "http://127.0.0.1:8080.evil.example",
            ] {
                assert!(!may(origin, upgrade), "{origin}");
            }
        }
        assert!(asks(&guard, Method::POST, &[local]), "a program");
        assert!(!asks(&guard, Method::POST, &[local, ("sec-fetch-site", "cross-site")]));
        assert!(asks(&guard, Method::GET, &[local, ("origin", "https://evil.example")]), "it cannot read it");
    }

    #[test]
    fn behind_a_proxy_a_page_with_the_servers_name_is_its_own() {
        let guard = Guard::default();
        let ask = |host, origin| asks(&guard, Method::POST, &[("host", host), ("origin", origin)]);
        assert!(ask("cup.example.org", "https://cup.example.org"));
        assert!(ask("cup.example.org:8443", "https://cup.example.org:8443"));
        assert!(!ask("cup.example.org", "https://other.example.org"));
        assert!(!ask("10.0.0.2:8080", "http://localhost:8080"), "only for servers of this machine");
    }
}
