//! Requests over HTTP, or over TLS with the system's certificate authorities and the certificates of `--ca`.

mod tls;

use anyhow::{Context, anyhow, ensure};
use rustls::pki_types::CertificateDer;
use rustls::pki_types::pem::PemObject;
use std::io::{self, ErrorKind};
use std::path::Path;
use ureq::config::ConfigBuilder;
use ureq::typestate::AgentScope;

/// An agent with this configuration, for this URL.
pub(crate) fn agent(
    config: ConfigBuilder<AgentScope>,
    url: &str,
    ca: Option<&Path>,
) -> anyhow::Result<ureq::Agent> {
    let secure = url.starts_with("https://");
    ensure!(
        secure || url.starts_with("http://"),
        "--url {url}: expected http://HOST:PORT or https://HOST:PORT"
    );
    let config = config.build();
    if !secure {
        return Ok(config.into());
    }
    let named = ca.map(certificates).transpose()?.unwrap_or_default();
    tls::agent(config, named)
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

/// The certificates of a PEM file.
fn certificates(path: &Path) -> anyhow::Result<Vec<CertificateDer<'static>>> {
    let bytes = std::fs::read(path).with_context(|| format!("--ca {}: cannot be read", path.display()))?;
    let found: Result<Vec<_>, _> = CertificateDer::pem_slice_iter(&bytes).collect();
    let found = found.with_context(|| format!("--ca {}: not a PEM file", path.display()))?;
    ensure!(!found.is_empty(), "--ca {}: there is no certificate in it (PEM)", path.display());
    Ok(found)
}

/// Advice for an error of a TLS connection.
fn help(error: &io::Error) -> &'static str {
    use rustls::CertificateError::{
        Expired, ExpiredContext, NotValidForName, NotValidForNameContext, NotValidYet, NotValidYetContext,
    };
    use rustls::Error::{InvalidCertificate, InvalidMessage};
    match error.get_ref().and_then(|inner| inner.downcast_ref()) {
        Some(InvalidCertificate(NotValidForName | NotValidForNameContext { .. })) => {
            "the certificate is for another name than that of --url"
        }
        Some(InvalidCertificate(
            Expired | ExpiredContext { .. } | NotValidYet | NotValidYetContext { .. },
        )) => "the server needs a certificate of today; is this machine's clock right?",
        Some(InvalidCertificate(_)) => {
            "--ca names a file with the certificate of an authority to trust, or with the server's own"
        }
        Some(InvalidMessage(_)) => "is there a server without TLS? --url http://… reaches it",
        _ => "the connection is broken",
    }
}

#[cfg(test)]
mod tests;
