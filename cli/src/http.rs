//! Requests over HTTP, or over TLS with the system's certificate authorities and those of `--ca`.

use anyhow::{Context, anyhow, ensure};
use rustls::crypto::ring;
use std::io::{self, ErrorKind};
use std::path::Path;
use std::sync::Arc;
use ureq::config::ConfigBuilder;
use ureq::tls::{Certificate, PemItem, RootCerts, TlsConfig, parse_pem};
use ureq::typestate::AgentScope;

/// The configuration of an agent for this URL.
pub(crate) fn for_url(
    config: ConfigBuilder<AgentScope>,
    url: &str,
    ca: Option<&Path>,
) -> anyhow::Result<ConfigBuilder<AgentScope>> {
    let secure = url.starts_with("https://");
    ensure!(
        secure || url.starts_with("http://"),
        "--url {url}: expected http://HOST:PORT or https://HOST:PORT"
    );
    Ok(if secure { config.tls_config(tls(ca)?) } else { config })
}

/// The reason why a request got no response, and what helps.
pub(crate) fn unreachable(address: &str, error: &ureq::Error) -> anyhow::Error {
    let help = match error {
        ureq::Error::Io(io) if io.kind() == ErrorKind::ConnectionRefused => {
            "is the server running? --url names another"
        }
        ureq::Error::Timeout(_) => "the server takes connections, but does not answer in time",
        // rustls packs its errors into this kind.
        ureq::Error::Io(io) if io.kind() == ErrorKind::InvalidData => help(io),
        ureq::Error::Io(_) | ureq::Error::HostNotFound => "--url names another server",
        _ => return anyhow!("{address}: {error}"),
    };
    anyhow!("{address}: {error}; {help}")
}

/// The settings of an HTTPS client.
fn tls(ca: Option<&Path>) -> anyhow::Result<TlsConfig> {
    // A system without authorities is no error as long as --ca names one.
    let system = rustls_native_certs::load_native_certs().certs;
    let mut roots: Vec<Certificate<'static>> =
        system.iter().map(|certificate| Certificate::from_der(certificate).to_owned()).collect();
    if let Some(path) = ca {
        roots.extend(authorities(path)?);
    }
    ensure!(
        !roots.is_empty(),
        "this machine has no certificate authorities; install them (Debian: ca-certificates), or name a file with --ca"
    );
    // An error means that there is a provider already.
    let _ = ring::default_provider().install_default();
    Ok(TlsConfig::builder().root_certs(RootCerts::Specific(Arc::new(roots))).build())
}

/// The certificates of a PEM file.
fn authorities(path: &Path) -> anyhow::Result<Vec<Certificate<'static>>> {
    let bytes = std::fs::read(path).with_context(|| format!("--ca {}: cannot be read", path.display()))?;
    let mut found = Vec::new();
    for item in parse_pem(&bytes) {
        if let PemItem::Certificate(certificate) =
            item.with_context(|| format!("--ca {}: not a PEM file", path.display()))?
        {
            found.push(certificate);
        }
    }
    ensure!(!found.is_empty(), "--ca {}: there is no certificate in it (PEM)", path.display());
    Ok(found)
}

/// Advice for an error of a TLS connection.
fn help(error: &io::Error) -> &'static str {
    use rustls::CertificateError::{NotValidForName, NotValidForNameContext};
    use rustls::Error::{InvalidCertificate, InvalidMessage};
    match error.get_ref().and_then(|inner| inner.downcast_ref()) {
        Some(InvalidCertificate(NotValidForName | NotValidForNameContext { .. })) => {
            "the certificate is for another name than that of --url"
        }
        Some(InvalidCertificate(_)) => "--ca names a file with the certificate of an authority to trust",
        Some(InvalidMessage(_)) => "is there a server without TLS? --url http://… reaches it",
        _ => "the connection is broken",
    }
}

#[cfg(test)]
mod tests;
