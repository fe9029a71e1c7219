//! Request bodies: read in pieces, with bounds for each, for each address and for all, so that no caller fills the memory.

use super::quota::{Quota, Quotas};
use axum::body::Body;
use axum::http::HeaderMap;
use axum::http::header::CONTENT_LENGTH;
use futures_util::StreamExt;
use palmares_protocol::{Code, Refusal};
use std::net::IpAddr;
use std::time::Duration;
use tokio::time::{Instant, timeout, timeout_at};

/// Bytes of all bodies in memory.
const ALL_BYTES: usize = 128 << 20;
/// Bytes of the bodies from one address.
const ADDRESS_BYTES: usize = 64 << 20;
/// Longest pause between two pieces.
const IDLE: Duration = Duration::from_secs(10);
/// Longest time for a whole body.
const WHOLE: Duration = Duration::from_secs(120);

/// Counts the bodies in memory.
#[derive(Debug, Default)]
pub struct Bodies {
    all: Quotas<()>,
    by_address: Quotas<IpAddr>,
}

/// A body. It is counted until it is dropped.
#[derive(Debug)]
pub struct Received {
    /// Its bytes.
    pub bytes: Vec<u8>,
    _of_all: Quota<()>,
    _of_address: Quota<IpAddr>,
}

fn too_large(most: usize) -> Refusal {
    Refusal::new(Code::TooLarge, format!("expected a body of at most {most} bytes"))
}

impl Bodies {
    /// Reads a body of at most `most` bytes.
    ///
    /// # Errors
    /// The body is too large or too slow, or the bodies in memory have reached a bound.
    pub async fn read(
        &self,
        from: IpAddr,
        headers: &HeaderMap,
        body: Body,
        most: usize,
    ) -> Result<Received, Refusal> {
        let declared = headers.get(CONTENT_LENGTH).and_then(|length| length.to_str().ok()?.parse().ok());
        if declared.is_some_and(|bytes: u64| bytes > most as u64) {
            return Err(too_large(most));
        }
        let (mut of_all, mut of_address) = (self.all.of(()), self.by_address.of(from));
        let mut bytes = Vec::new();
        let mut pieces = body.into_data_stream();
        let end = Instant::now() + WHOLE;
        loop {
            let piece = match timeout_at(end, timeout(IDLE, pieces.next())).await {
                Ok(Ok(Some(Ok(piece)))) => piece,
                Ok(Ok(None)) => return Ok(Received { bytes, _of_all: of_all, _of_address: of_address }),
                Ok(Ok(Some(Err(error)))) => {
                    return Err(Refusal::new(
                        Code::BadRequest,
                        format!("the body could not be read: {error}"),
                    ));
                }
                Err(_) | Ok(Err(_)) => {
                    let (idle, whole) = (IDLE.as_secs(), WHOLE.as_secs());
                    let message = format!(
                        "the upload is too slow: at most {idle} s without data and {whole} s in total"
                    );
                    return Err(Refusal::new(Code::TooSlow, message));
                }
            };
            if bytes.len() + piece.len() > most {
                return Err(too_large(most));
            }
            if !of_address.grow(piece.len(), ADDRESS_BYTES) || !of_all.grow(piece.len(), ALL_BYTES) {
                let message = "too many uploads at once; try again";
                return Err(Refusal::new(Code::Capacity, message).retry_after(5.0));
            }
            bytes.extend_from_slice(&piece);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    async fn read(bodies: &Bodies, from: u8, bytes: usize, most: usize) -> Result<Received, Refusal> {
        let from = IpAddr::from([10, 0, 0, from]);
        bodies.read(from, &HeaderMap::new(), Body::from(vec![0; bytes]), most).await
    }

    #[tokio::test]
    async fn bodies_are_bounded_each_by_address_and_all_together() {
        let bodies = Bodies::default();
        assert_eq!(read(&bodies, 1, 11, 10).await.expect_err("too large").code, Code::TooLarge);
        let whole = ADDRESS_BYTES / 2;
        let kept = [read(&bodies, 1, whole, whole).await, read(&bodies, 1, whole, whole).await];
        assert!(kept.iter().all(Result::is_ok));
        assert_eq!(
            read(&bodies, 1, 1, 1).await.expect_err("the quota of the address is used up").code,
            Code::Capacity
        );
        let others = [read(&bodies, 2, whole, whole).await, read(&bodies, 3, whole, whole).await];
        assert!(others.iter().all(Result::is_ok));
        assert_eq!(read(&bodies, 4, 1, 1).await.expect_err("the total is used up").code, Code::Capacity);
        drop(kept);
        assert!(read(&bodies, 1, whole, whole).await.is_ok());
    }

    #[tokio::test]
    async fn a_body_that_declares_too_large_a_size_is_not_read() {
        let bodies = Bodies::default();
        let mut headers = HeaderMap::new();
        headers.insert(CONTENT_LENGTH, "11".parse().expect("a header"));
        // A body that never comes: a reader would wait forever.
        let never = Body::from_stream(futures_util::stream::pending::<Result<Vec<u8>, std::io::Error>>());
        let refused = bodies.read(IpAddr::from([10, 0, 0, 1]), &headers, never, 10).await;
        assert_eq!(refused.expect_err("too large").code, Code::TooLarge);
    }
}
