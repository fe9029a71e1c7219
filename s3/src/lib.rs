//! A bucket of an S3 server: requests with path-style addresses and AWS Signature Version 4. A file is written, read and deleted as a
//! whole; each call blocks its thread.
//!
//! Environment: `AWS_ENDPOINT_URL` or `AWS_ENDPOINT` (without it Amazon's), `AWS_REGION`, `AWS_ACCESS_KEY_ID`, `AWS_SECRET_ACCESS_KEY`,
//! `AWS_SESSION_TOKEN`. Google Cloud Storage has such an address and such keys too (<https://storage.googleapis.com>, HMAC keys).

use anyhow::{Context, ensure};
use hmac::{Hmac, KeyInit, Mac};
use sha2::{Digest, Sha256};
use std::fmt;
use std::io;
use std::sync::Arc;
use std::time::{Duration, SystemTime, UNIX_EPOCH};
use ureq::tls::{Certificate, RootCerts, TlsConfig};

/// Longest time for a connection, and for a whole request.
const CONNECT_TIMEOUT: Duration = Duration::from_secs(5);
const TIMEOUT: Duration = Duration::from_secs(60);
/// Largest answer that is no file: a page of a list has up to 1,000 keys.
const MAX_TEXT: u64 = 8 << 20;

/// A bucket, and the prefix of all keys in it.
pub struct Bucket {
    agent: ureq::Agent,
    /// `https://s3.example.org`
    endpoint: String,
    bucket: String,
    /// Empty, or with `/` at its end.
    prefix: String,
    credentials: Credentials,
    /// Largest file that is read.
    max_bytes: u64,
}

/// The access to a bucket.
struct Credentials {
    region: String,
    key_id: String,
    secret: String,
    session_token: Option<String>,
}

impl fmt::Debug for Bucket {
    /// Without the credentials.
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        write!(f, "Bucket({}/{}/{})", self.endpoint, self.bucket, self.prefix)
    }
}

impl Bucket {
    /// The bucket of `bucket/prefix`, with address and credentials from the environment. Larger files than `max_bytes` are not read.
    ///
    /// # Errors
    /// The name or the environment is not valid.
    pub fn open(rest: &str, max_bytes: u64) -> anyhow::Result<Self> {
        Self::with(rest, max_bytes, &|name| std::env::var(name).ok())
    }

    fn with(rest: &str, max_bytes: u64, variable: &dyn Fn(&str) -> Option<String>) -> anyhow::Result<Self> {
        let plain = |c: char| c.is_ascii_alphanumeric() || "-_./".contains(c);
        let rest = rest.trim_end_matches('/');
        ensure!(
            !rest.is_empty() && !rest.starts_with('/') && !rest.contains("//") && rest.chars().all(plain),
            "storage `s3://{rest}`: expected s3://BUCKET or s3://BUCKET/PREFIX of letters, digits, `-`, `_`, `.` and `/`"
        );
        let first =
            |names: &[&str]| names.iter().find_map(|name| variable(name)).filter(|value| !value.is_empty());
        let needed =
            |name: &str| first(&[name]).with_context(|| format!("storage `s3://{rest}`: {name} is not set"));
        let region = first(&["AWS_REGION", "AWS_DEFAULT_REGION"]).unwrap_or_else(|| "us-east-1".into());
        let endpoint = first(&["AWS_ENDPOINT_URL_S3", "AWS_ENDPOINT_URL", "AWS_ENDPOINT"]);
        let endpoint = endpoint.unwrap_or_else(|| format!("https://s3.{region}.amazonaws.com"));
        let endpoint = endpoint.trim_end_matches('/').to_owned();
        let config = ureq::Agent::config_builder()
            .timeout_connect(Some(CONNECT_TIMEOUT))
            .timeout_global(Some(TIMEOUT))
            .http_status_as_error(false)
            .max_redirects(0)
            .proxy(None);
        let config = match (endpoint.strip_prefix("https://"), endpoint.strip_prefix("http://")) {
            (Some(host), _) if !host.contains('/') => config.tls_config(tls()?),
            (_, Some(host)) if !host.contains('/') => config,
            _ => anyhow::bail!("AWS_ENDPOINT_URL `{endpoint}`: expected https://HOST or http://HOST:PORT"),
        };
        let credentials = Credentials {
            region,
            key_id: needed("AWS_ACCESS_KEY_ID")?,
            secret: needed("AWS_SECRET_ACCESS_KEY")?,
            session_token: first(&["AWS_SESSION_TOKEN"]),
        };
        let (bucket, prefix) = match rest.split_once('/') {
            Some((bucket, prefix)) => (bucket.to_owned(), format!("{prefix}/")),
            None => (rest.to_owned(), String::new()),
        };
        Ok(Bucket { agent: config.build().into(), endpoint, bucket, prefix, credentials, max_bytes })
    }

    /// Writes a file.
    ///
    /// # Errors
    /// The server refuses, or does not answer.
    pub fn put(&self, key: &str, bytes: &[u8]) -> io::Result<()> {
        let (url, headers) = self.signed("PUT", &self.path(key), "", bytes);
        let request = headers
            .into_iter()
            .fold(self.agent.put(url), |request, (name, value)| request.header(name, value));
        accepted(request.send(bytes), &[]).map(drop)
    }

    /// The bytes of a file; None if there is none.
    ///
    /// # Errors
    /// The bucket is missing, the server refuses or does not answer, or the file is too large.
    pub fn get(&self, key: &str) -> io::Result<Option<Vec<u8>>> {
        self.get_path(&self.path(key))
    }

    fn get_path(&self, path: &str) -> io::Result<Option<Vec<u8>>> {
        let mut response = self.request(path, "", &[404])?;
        if response.status() == 404 {
            // A missing bucket is no missing file.
            let text = response.body_mut().read_to_string().unwrap_or_default();
            return if text.contains("NoSuchBucket") { Err(refused(404, &text)) } else { Ok(None) };
        }
        let bytes = response.body_mut().with_config().limit(self.max_bytes).read_to_vec();
        bytes.map(Some).map_err(io::Error::other)
    }

    /// Deletes a file; it may be missing.
    ///
    /// # Errors
    /// The server refuses, or does not answer.
    pub fn delete(&self, key: &str) -> io::Result<()> {
        let (url, headers) = self.signed("DELETE", &self.path(key), "", &[]);
        let request = headers
            .into_iter()
            .fold(self.agent.delete(url), |request, (name, value)| request.header(name, value));
        accepted(request.call(), &[404]).map(drop)
    }

    /// The keys of all files below the prefix, in their order; the prefix itself if it is the key of a file. Keys are relative to the
    /// bucket, as [`Bucket::read`] takes them.
    ///
    /// <https://docs.aws.amazon.com/AmazonS3/latest/API/API_ListObjectsV2.html>
    ///
    /// # Errors
    /// The server refuses, or does not answer.
    pub fn list(&self) -> io::Result<Vec<String>> {
        let (mut keys, mut token): (Vec<String>, Option<String>) = (Vec::new(), None);
        let file = self.prefix.trim_end_matches('/');
        loop {
            // Parameters in alphabetical order, as the signature needs them.
            let mut query = String::new();
            if let Some(token) = &token {
                query = format!("continuation-token={}&", encoded(token, false));
            }
            query += &format!("list-type=2&prefix={}", encoded(file, false));
            let path = format!("/{}", self.bucket);
            let mut response = self.request(&path, &query, &[])?;
            let text = response.body_mut().with_config().limit(MAX_TEXT).read_to_string();
            let text = text.map_err(io::Error::other)?;
            let found = elements(&text, "Key").map(unescaped);
            keys.extend(found.filter(|key| key == file || key.starts_with(&self.prefix)));
            token = elements(&text, "NextContinuationToken").next().map(unescaped);
            let more = elements(&text, "IsTruncated").next() == Some("true");
            match more {
                true if token.is_none() => {
                    return Err(io::Error::other("object storage: a list ends without its end"));
                }
                true => {}
                false => return Ok(keys),
            }
        }
    }

    /// The bytes of a file that [`Bucket::list`] has found; None if it is gone.
    ///
    /// # Errors
    /// As for [`Bucket::get`].
    pub fn read(&self, key: &str) -> io::Result<Option<Vec<u8>>> {
        self.get_path(&format!("/{}/{}", self.bucket, encoded(key, true)))
    }

    /// The path of a key below the prefix.
    fn path(&self, key: &str) -> String {
        format!("/{}/{}{}", self.bucket, encoded(&self.prefix, true), encoded(key, true))
    }

    /// The answer to a GET.
    fn request(&self, path: &str, query: &str, also: &[u16]) -> io::Result<Response> {
        let (url, headers) = self.signed("GET", path, query, &[]);
        let request = headers
            .into_iter()
            .fold(self.agent.get(url), |request, (name, value)| request.header(name, value));
        accepted(request.call(), also)
    }

    /// The address of an encoded path, and the headers that sign a request with this body.
    fn signed(
        &self,
        method: &str,
        path: &str,
        query: &str,
        body: &[u8],
    ) -> (String, Vec<(&'static str, String)>) {
        let now = SystemTime::now().duration_since(UNIX_EPOCH).unwrap_or_default().as_secs();
        let host = self.endpoint.split_once("://").map_or("", |(_, host)| host);
        let mut headers = vec![
            ("host", host.to_owned()),
            ("x-amz-content-sha256", sha256_hex(body)),
            ("x-amz-date", timestamp(now)),
        ];
        if let Some(token) = &self.credentials.session_token {
            headers.push(("x-amz-security-token", token.clone()));
        }
        let authorization = self.credentials.authorization(method, path, query, &headers);
        // The client itself writes the host.
        headers.remove(0);
        headers.push(("authorization", authorization));
        let mark = if query.is_empty() { "" } else { "?" };
        (format!("{}{path}{mark}{query}", self.endpoint), headers)
    }
}

impl Credentials {
    /// The header `Authorization`. `headers` are in alphabetical order, with `x-amz-date` and `x-amz-content-sha256` among them.
    ///
    /// <https://docs.aws.amazon.com/AmazonS3/latest/API/sig-v4-header-based-auth.html>
    fn authorization(&self, method: &str, path: &str, query: &str, headers: &[(&str, String)]) -> String {
        let value =
            |wanted: &str| headers.iter().find(|(name, _)| *name == wanted).map_or("", |(_, value)| value);
        let (time, payload) = (value("x-amz-date"), value("x-amz-content-sha256"));
        let day = time.get(..8).unwrap_or_default();
        let names = headers.iter().map(|(name, _)| *name).collect::<Vec<_>>().join(";");
        let lines: String = headers.iter().map(|(name, value)| format!("{name}:{value}\n")).collect();
        let request = format!("{method}\n{path}\n{query}\n{lines}\n{names}\n{payload}");
        let scope = format!("{day}/{}/s3/aws4_request", self.region);
        let message = format!("AWS4-HMAC-SHA256\n{time}\n{scope}\n{}", sha256_hex(request.as_bytes()));
        let mut key = format!("AWS4{}", self.secret).into_bytes();
        for part in [day, &self.region, "s3", "aws4_request"] {
            key = mac(&key, part);
        }
        let signature = hex::encode(mac(&key, &message));
        format!(
            "AWS4-HMAC-SHA256 Credential={}/{scope},SignedHeaders={names},Signature={signature}",
            self.key_id
        )
    }
}

/// SHA-256 as lower-case hexadecimal.
fn sha256_hex(bytes: &[u8]) -> String {
    hex::encode(Sha256::digest(bytes))
}

/// A text in percent-encoding, as signatures need it; with `slashes` these stay.
fn encoded(text: &str, slashes: bool) -> String {
    let mut encoded = String::new();
    for byte in text.bytes() {
        match byte {
            b'A'..=b'Z' | b'a'..=b'z' | b'0'..=b'9' | b'-' | b'.' | b'_' | b'~' => {
                encoded.push(char::from(byte));
            }
            b'/' if slashes => encoded.push('/'),
            _ => encoded += &format!("%{byte:02X}"),
        }
    }
    encoded
}

/// The texts of the elements with this name, without children, in an answer of S3.
fn elements<'a>(xml: &'a str, name: &str) -> impl Iterator<Item = &'a str> + use<'a> {
    let (open, close) = (format!("<{name}>"), format!("</{name}>"));
    let mut rest = xml;
    std::iter::from_fn(move || {
        let (_, after) = rest.split_once(&open)?;
        let (text, after) = after.split_once(&close)?;
        rest = after;
        Some(text)
    })
}

/// A text without the escapes of XML.
fn unescaped(text: &str) -> String {
    let escapes = [("&lt;", "<"), ("&gt;", ">"), ("&quot;", "\""), ("&apos;", "'"), ("&amp;", "&")];
    escapes.iter().fold(text.to_owned(), |text, (escape, plain)| text.replace(escape, plain))
}

fn mac(key: &[u8], text: &str) -> Vec<u8> {
    let mut mac = Hmac::<Sha256>::new_from_slice(key).expect("HMAC takes keys of any length");
    mac.update(text.as_bytes());
    mac.finalize().into_bytes().to_vec()
}

/// The time of a signature, `20130524T000000Z`, from seconds since 1970 UTC.
fn timestamp(unix_s: u64) -> String {
    // Days since 0000-03-01; a leap day is the last one of such a year.
    let days = unix_s / 86_400 + 719_468;
    let (era, day_of_era) = (days / 146_097, days % 146_097);
    let year_of_era = (day_of_era - day_of_era / 1460 + day_of_era / 36_524 - day_of_era / 146_096) / 365;
    let day_of_year = day_of_era - (365 * year_of_era + year_of_era / 4 - year_of_era / 100);
    let shifted = (5 * day_of_year + 2) / 153;
    let day = day_of_year - (153 * shifted + 2) / 5 + 1;
    let month = if shifted < 10 { shifted + 3 } else { shifted - 9 };
    let year = era * 400 + year_of_era + u64::from(month <= 2);
    let second = unix_s % 86_400;
    format!("{year:04}{month:02}{day:02}T{:02}{:02}{:02}Z", second / 3600, second / 60 % 60, second % 60)
}

type Response = ureq::http::Response<ureq::Body>;

/// A response with success, or with one of these codes.
fn accepted(response: Result<Response, ureq::Error>, also: &[u16]) -> io::Result<Response> {
    let mut response = response.map_err(|error| io::Error::other(format!("object storage: {error}")))?;
    let code = response.status().as_u16();
    if response.status().is_success() || also.contains(&code) {
        return Ok(response);
    }
    Err(refused(code, &response.body_mut().read_to_string().unwrap_or_default()))
}

/// The error of a response: S3's code, as in `<Code>AccessDenied</Code>`.
fn refused(code: u16, text: &str) -> io::Error {
    let word = elements(text, "Code").next().unwrap_or_default();
    io::Error::other(format!("object storage: {code} {word}"))
}

/// The settings of a client over TLS, with the system's certificate authorities.
fn tls() -> anyhow::Result<TlsConfig> {
    let system = rustls_native_certs::load_native_certs().certs;
    let roots: Vec<Certificate<'static>> =
        system.iter().map(|certificate| Certificate::from_der(certificate).to_owned()).collect();
    ensure!(
        !roots.is_empty(),
        "this machine has no certificate authorities for the object storage; install them (Debian: ca-certificates)"
    );
    // An error means that there is a provider already.
    let _ = rustls::crypto::ring::default_provider().install_default();
    Ok(TlsConfig::builder().root_certs(RootCerts::Specific(Arc::new(roots))).build())
}

#[cfg(test)]
mod tests {
    use super::*;

    fn variables(name: &str) -> Option<String> {
        let value = match name {
            "AWS_ENDPOINT_URL" => "http://127.0.0.1:9000/",
            "AWS_ACCESS_KEY_ID" => "AKIAIOSFODNN7EXAMPLE",
            "AWS_SECRET_ACCESS_KEY" => "wJalrXUtnFEMI/K7MDENG/bPxRfiCYEXAMPLEKEY",
            _ => return None,
        };
        Some(value.into())
    }

    fn opened(rest: &str) -> anyhow::Result<Bucket> {
        Bucket::with(rest, 1 << 20, &variables)
    }

    /// The example of Amazon's documentation, "GET Object".
    #[test]
    fn a_signature_is_that_of_the_documentation() {
        let credentials = opened("examplebucket").expect("opens").credentials;
        let headers = [
            ("host", "examplebucket.s3.amazonaws.com".to_owned()),
            ("range", "bytes=0-9".to_owned()),
            ("x-amz-content-sha256", sha256_hex(b"")),
            ("x-amz-date", timestamp(1_369_353_600)),
        ];
        assert_eq!(
            credentials.authorization("GET", "/test.txt", "", &headers),
            "AWS4-HMAC-SHA256 Credential=AKIAIOSFODNN7EXAMPLE/20130524/us-east-1/s3/aws4_request,\
             SignedHeaders=host;range;x-amz-content-sha256;x-amz-date,\
             Signature=f0e8bdb87c964420e857bd35b5d6ed310bd44f0170aba48dd91039c6036bdb41"
        );
    }

    #[test]
    fn times_are_those_of_the_calendar() {
        for (unix_s, text) in [
            (0, "19700101T000000Z"),
            (951_782_399, "20000228T235959Z"),
            (951_782_400, "20000229T000000Z"),
            (1_709_164_800, "20240229T000000Z"),
            (1_735_689_599, "20241231T235959Z"),
        ] {
            assert_eq!(timestamp(unix_s), text);
        }
    }

    #[test]
    fn keys_are_below_the_prefix_and_a_missing_credential_is_named() {
        let bucket = opened("cup/2026/").expect("opens");
        let (url, headers) = bucket.signed("PUT", &bucket.path("hands/ab.zip"), "", b"zip");
        assert_eq!(url, "http://127.0.0.1:9000/cup/2026/hands/ab.zip");
        assert!(headers.iter().all(|(name, _)| *name != "host"));
        assert!(!format!("{bucket:?}").contains("wJalr"));
        let error = Bucket::with("cup", 1, &|_| None).expect_err("no credentials").to_string();
        assert!(error.contains("AWS_ACCESS_KEY_ID is not set"), "{error}");
        for wrong in ["", "/", "cup//a", "cup/ä", "cup?x"] {
            assert!(opened(wrong).is_err(), "{wrong}");
        }
    }

    #[test]
    fn a_list_is_read_and_keys_are_encoded() {
        let page = "<ListBucketResult><IsTruncated>true</IsTruncated><Contents><Key>a/b&amp;c.mcap</Key></Contents>\
                    <Contents><Key>a/d.mcap</Key></Contents><NextContinuationToken>1+/=</NextContinuationToken>";
        let keys: Vec<String> = elements(page, "Key").map(unescaped).collect();
        assert_eq!(keys, ["a/b&c.mcap", "a/d.mcap"]);
        assert_eq!(elements(page, "Code").next(), None);
        assert_eq!(encoded("a/b&c é.mcap", true), "a/b%26c%20%C3%A9.mcap");
        assert_eq!(encoded("1+/=", false), "1%2B%2F%3D");
    }
}
