//! Content codings: which ones a client takes, and JSON as gzip for those that take it.

use axum::http::header::{ACCEPT_ENCODING, CONTENT_ENCODING, CONTENT_TYPE, VARY};
use axum::http::{HeaderMap, HeaderValue};
use axum::response::{IntoResponse, Response};
use flate2::{Compression, write::GzEncoder};
use palmares_net::transport::problem::Problem;
use palmares_protocol::Code;
use serde::Serialize;
use std::io::Write;

/// Shorter bodies are sent as they are, bytes.
const SHORT: usize = 2000;

/// Whether the client takes this coding.
pub(super) fn takes(headers: &HeaderMap, coding: &str) -> bool {
    let codings = headers.get_all(ACCEPT_ENCODING).iter().filter_map(|value| value.to_str().ok());
    codings.flat_map(|value| value.split(',')).any(|taken| {
        let mut parts = taken.split(';').map(str::trim);
        let no = |q: &str| q.strip_prefix("q=").is_some_and(|q| q.parse() == Ok(0.0));
        parts.next().is_some_and(|name| name.eq_ignore_ascii_case(coding)) && !parts.any(no)
    })
}

/// A response in JSON; a long one is compressed for clients that take gzip.
pub(super) fn json(headers: &HeaderMap, body: &impl Serialize) -> Response {
    let text = match serde_json::to_vec(body) {
        Ok(text) => text,
        Err(error) => {
            tracing::error!(%error, "an answer cannot be written as JSON");
            return Problem::new(Code::Internal, "the answer could not be written").into_response();
        }
    };
    let packed = if text.len() > SHORT && takes(headers, "gzip") { gzip(&text) } else { None };
    let mut response = match packed {
        Some(packed) => ([(CONTENT_ENCODING, "gzip")], packed).into_response(),
        None => text.into_response(),
    };
    let headers = response.headers_mut();
    headers.insert(CONTENT_TYPE, HeaderValue::from_static("application/json"));
    headers.insert(VARY, HeaderValue::from_static("accept-encoding"));
    response
}

/// The bytes as gzip. Memory has no errors; were there one, the bytes would be sent as they are.
fn gzip(bytes: &[u8]) -> Option<Vec<u8>> {
    let mut packer = GzEncoder::new(Vec::new(), Compression::fast());
    packer.write_all(bytes).and_then(|()| packer.finish()).ok()
}

#[cfg(test)]
mod tests {
    use super::*;
    use axum::body::to_bytes;
    use flate2::read::GzDecoder;
    use std::io::Read;

    fn accepting(value: &'static str) -> HeaderMap {
        [(ACCEPT_ENCODING, HeaderValue::from_static(value))].into_iter().collect()
    }

    #[test]
    fn a_coding_is_for_clients_that_accept_it() {
        let taken = |value: &'static str| ["br", "gzip"].map(|coding| takes(&accepting(value), coding));
        assert_eq!(taken("gzip, deflate, br"), [true, true]);
        assert_eq!(taken("br;q=0.000, GZIP;q=0.8"), [false, true]);
        assert_eq!(taken("br, gzip;q=0"), [true, false]);
        assert!(!takes(&HeaderMap::new(), "gzip"));
    }

    #[tokio::test]
    async fn long_json_is_compressed_and_has_the_same_content() {
        let long = vec!["a link of a hand"; 500];
        let plain = serde_json::to_vec(&long).expect("texts");
        let sent = json(&accepting("gzip"), &long);
        assert_eq!(sent.headers()[CONTENT_ENCODING], "gzip");
        let bytes = to_bytes(sent.into_body(), usize::MAX).await.expect("all of it");
        assert!(bytes.len() < plain.len() / 2, "{} of {}", bytes.len(), plain.len());
        let mut read = Vec::new();
        GzDecoder::new(&bytes[..]).read_to_end(&mut read).expect("gzip");
        assert_eq!(read, plain);
        for (headers, body) in [(HeaderMap::new(), long), (accepting("gzip"), vec!["short"])] {
            let sent = json(&headers, &body);
            assert!(!sent.headers().contains_key(CONTENT_ENCODING));
            assert_eq!(sent.headers()[VARY], "accept-encoding");
            let bytes = to_bytes(sent.into_body(), usize::MAX).await.expect("all of it");
            assert_eq!(bytes, serde_json::to_vec(&body).expect("texts"));
        }
    }
}
