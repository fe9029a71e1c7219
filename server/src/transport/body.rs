//! What callers send in: read in pieces, of which all together have a bound, so that nobody can fill the memory.

use super::counts::{Counts, Share};
use axum::body::Body;
use axum::http::HeaderMap;
use axum::http::header::CONTENT_LENGTH;
use futures_util::StreamExt;
use palmares_protocol::{Code, Refusal};
use std::net::IpAddr;
use std::time::Duration;
use tokio::time::{Instant, timeout, timeout_at};

/// Bytes of bodies that are kept at once.
const ALL_BYTES: usize = 128 << 20;
/// Of these, those from one address.
const ADDRESS_BYTES: usize = 64 << 20;
/// How long nothing may come while more is awaited.
const IDLE: Duration = Duration::from_secs(10);
/// How long a body may take.
const WHOLE: Duration = Duration::from_secs(120);

/// All bodies that are kept.
#[derive(Debug, Default)]
pub(crate) struct Bodies {
    all: Counts<()>,
    by_address: Counts<IpAddr>,
}

/// A body. It counts as long as it exists.
#[derive(Debug)]
pub(crate) struct Received {
    /// What was sent.
    pub(crate) bytes: Vec<u8>,
    _of_all: Share<()>,
    _of_address: Share<IpAddr>,
}

fn too_large(most: usize) -> Refusal {
    Refusal::new(Code::TooLarge, format!("expected a body of at most {most} bytes"))
}

impl Bodies {
    /// Reads a body of at most `most` bytes.
    ///
    /// # Errors
    /// It is larger, comes too slowly, or too much is being sent in already.
    pub(crate) async fn read(
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
        let (mut of_all, mut of_address) = (self.all.share(()), self.by_address.share(from));
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
                    let message = format!("a body may pause for {idle} s and take {whole} s in all");
                    return Err(Refusal::new(Code::TooSlow, message));
                }
            };
            if bytes.len() + piece.len() > most {
                return Err(too_large(most));
            }
            if !of_address.grow(piece.len(), ADDRESS_BYTES) || !of_all.grow(piece.len(), ALL_BYTES) {
                let message = "too much is being sent in at once; try again";
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
        assert_eq!(read(&bodies, 1, 1, 1).await.expect_err("its share is used up").code, Code::Capacity);
        let others = [read(&bodies, 2, whole, whole).await, read(&bodies, 3, whole, whole).await];
        assert!(others.iter().all(Result::is_ok));
        assert_eq!(read(&bodies, 4, 1, 1).await.expect_err("all is used up").code, Code::Capacity);
        drop(kept);
        assert!(read(&bodies, 1, whole, whole).await.is_ok());
    }

    #[tokio::test]
    async fn what_says_that_it_is_too_large_is_not_read() {
        let bodies = Bodies::default();
        let mut headers = HeaderMap::new();
        headers.insert(CONTENT_LENGTH, "11".parse().expect("a header"));
        // A body that never comes: whoever reads it waits.
        let never = Body::from_stream(futures_util::stream::pending::<Result<Vec<u8>, std::io::Error>>());
        let refused = bodies.read(IpAddr::from([10, 0, 0, 1]), &headers, never, 10).await;
        assert_eq!(refused.expect_err("too large").code, Code::TooLarge);
    }
}
