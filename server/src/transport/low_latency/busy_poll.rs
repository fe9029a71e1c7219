//! Waiting awake. A controller in lockstep sends its next request a fraction of a millisecond after the last reply;
//! putting a thread to sleep and waking it up again takes about as long as a tick computes. So the connection looks for
//! the request a little longer before it sleeps, if that has paid lately and nobody else wants the core.

use super::stream::Attention;
use axum::extract::ws::{Message, WebSocket};
use std::future::poll_fn;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::task::Poll;
use std::time::{Duration, Instant};

/// Longest time to stay awake.
const LONGEST: Duration = Duration::from_micros(500);
/// How much of the mean a new gap is.
const WEIGHT: f64 = 0.2;
/// After so many requests in a row that were waited for awake everything else has its turn.
const IN_A_ROW: u32 = 16;

/// What came through a socket; none at its end.
pub(crate) type Incoming = Option<Result<Message, axum::Error>>;

/// How one connection waits for requests.
#[derive(Debug)]
pub(crate) struct BusyPoll {
    attention: Attention,
    /// None where nobody stays awake.
    awake: Option<Arc<Awake>>,
    cores: usize,
    gaps: GapEstimate,
    in_a_row: u32,
}

impl BusyPoll {
    pub(super) fn new(attention: Attention, awake: Option<Arc<Awake>>, cores: usize) -> Self {
        BusyPoll { attention, awake, cores, gaps: GapEstimate::new(), in_a_row: 0 }
    }

    /// A reply was sent.
    pub(crate) fn replied(&mut self) {
        self.gaps.replied(Instant::now());
    }

    /// A request came.
    pub(crate) fn asked(&mut self) {
        self.gaps.asked(Instant::now());
    }

    /// Looks for the next request without going to sleep, where that pays, and as long as `idle` says that nobody else wants
    /// the core; then, if it `may_doze` and the request is expected soon, asleep on the socket itself.
    pub(crate) async fn next(
        &mut self,
        socket: &mut WebSocket,
        idle: impl Fn() -> bool,
        may_doze: bool,
    ) -> Option<Incoming> {
        if let Some(message) = self.awake(socket, idle).await {
            return Some(message);
        }
        if !(may_doze && self.gaps.is_soon()) {
            return None;
        }
        let _dozing = self.attention.dozing();
        look(socket).await
    }

    async fn awake(&mut self, socket: &mut WebSocket, idle: impl Fn() -> bool) -> Option<Incoming> {
        let span = self.gaps.worth()?;
        let _leave = self.awake.as_ref()?.leave(self.cores)?;
        let _attentive = self.attention.awake();
        let end = Instant::now() + span;
        while idle() && Instant::now() < end {
            if let Some(message) = look(socket).await {
                return Some(message);
            }
            // The client may be waiting for this very core.
            std::thread::yield_now();
        }
        None
    }

    /// Whether the connection may look for another request at once. Not for ever: a client that never pauses must not keep
    /// organizers, pings and the clock waiting.
    pub(crate) fn goes_on(&mut self, found: bool) -> bool {
        self.in_a_row = if found { (self.in_a_row + 1) % IN_A_ROW } else { 0 };
        self.in_a_row > 0
    }
}

/// What has come, or comes while the connection dozes.
async fn look(socket: &mut WebSocket) -> Option<Incoming> {
    let mut next = pin!(socket.recv());
    match poll_fn(|context| Poll::Ready(next.as_mut().poll(context))).await {
        Poll::Ready(message) => Some(message),
        Poll::Pending => None,
    }
}

/// How soon requests follow the replies of one connection.
#[derive(Clone, Debug)]
struct GapEstimate {
    replied: Option<Instant>,
    /// Mean time from a reply to the next request, s; longer ones count as twice the longest worth waiting for.
    mean_s: f64,
}

impl GapEstimate {
    /// Nothing known: not worth waiting for.
    fn new() -> Self {
        GapEstimate { replied: None, mean_s: 2.0 * LONGEST.as_secs_f64() }
    }

    /// A reply was sent.
    fn replied(&mut self, now: Instant) {
        self.replied = Some(now);
    }

    /// A request came.
    fn asked(&mut self, now: Instant) {
        if let Some(replied) = self.replied.take() {
            let gap_s = (now - replied).as_secs_f64().min(2.0 * LONGEST.as_secs_f64());
            self.mean_s += WEIGHT * (gap_s - self.mean_s);
        }
    }

    /// How long it pays to stay awake for the next request; none when it does not.
    fn worth(&self) -> Option<Duration> {
        let span = Duration::from_secs_f64(1.5 * self.mean_s);
        (self.replied.is_some() && span <= LONGEST).then_some(span)
    }

    /// Whether most requests come sooner than what counts as long.
    fn is_soon(&self) -> bool {
        self.replied.is_some() && self.mean_s < 1.8 * LONGEST.as_secs_f64()
    }
}

/// Counts who stays awake: most of the cores are for those who compute.
#[derive(Debug, Default)]
pub(super) struct Awake(AtomicUsize);

/// Leave to stay awake.
struct Leave<'a>(&'a AtomicUsize);

impl Awake {
    /// Leave to stay awake, for one connection in two cores.
    fn leave(&self, cores: usize) -> Option<Leave<'_>> {
        let leave = Leave(&self.0);
        // Counted in any case: a refused leave is given back as it is dropped.
        (self.0.fetch_add(1, Ordering::AcqRel) < cores / 2).then_some(leave)
    }
}

impl Drop for Leave<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waiting_pays_only_for_those_who_have_been_quick() {
        let mut gaps = GapEstimate::new();
        let mut now = Instant::now();
        let mut go = |gaps: &mut GapEstimate, micros: u64, times: u32| {
            for _ in 0..times {
                gaps.replied(now);
                now += Duration::from_micros(micros);
                gaps.asked(now);
            }
            gaps.replied(now);
        };
        go(&mut gaps, 100, 1);
        assert_eq!(gaps.worth(), None, "once is not a habit");
        go(&mut gaps, 600, 30);
        assert!(gaps.worth().is_none() && gaps.is_soon(), "not worth staying awake, but soon");
        go(&mut gaps, 100, 30);
        let span = gaps.worth().expect("it pays");
        assert!((140..170).contains(&span.as_micros()), "{span:?}");
        go(&mut gaps, 20_000, 3);
        assert_eq!(gaps.worth(), None, "the controller thinks now");
        go(&mut gaps, 20_000, 30);
        assert!(!gaps.is_soon());
    }

    #[test]
    fn one_in_two_cores_may_stay_awake() {
        let awake = Awake::default();
        assert!(awake.leave(1).is_none());
        let first = awake.leave(4).expect("free");
        let second = awake.leave(4).expect("free");
        assert!(awake.leave(4).is_none());
        drop(first);
        assert!(awake.leave(4).is_some());
        drop(second);
    }
}
