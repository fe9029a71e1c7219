//! Busy polling. A controller in lockstep sends its next request a fraction of a millisecond after the last reply, and to put
//! a thread to sleep and wake it takes about as long as to compute a tick. So the connection polls its socket for a while
//! before it sleeps, if recent requests came soon enough and no other world needs the core.

use super::stream::PollMode;
use axum::extract::ws::{Message, WebSocket};
use std::future::poll_fn;
use std::pin::pin;
use std::sync::Arc;
use std::sync::atomic::{AtomicUsize, Ordering};
use std::task::Poll;
use std::time::{Duration, Instant};

/// Longest time to poll.
const MAX_SPIN: Duration = Duration::from_micros(500);
/// Weight of a new gap in the mean.
const WEIGHT: f64 = 0.2;
/// Number of requests in a row that are polled for before other events are handled.
const IN_A_ROW: u32 = 16;

/// A message of a socket; None at its end.
pub type Incoming = Option<Result<Message, axum::Error>>;

/// How one connection waits for requests.
#[derive(Debug)]
pub struct BusyPoll {
    poll_mode: PollMode,
    /// None without busy polling.
    spinning: Option<Arc<SpinLimit>>,
    cores: usize,
    gaps: GapEstimate,
    in_a_row: u32,
}

impl BusyPoll {
    pub(super) fn new(poll_mode: PollMode, spinning: Option<Arc<SpinLimit>>, cores: usize) -> Self {
        BusyPoll { poll_mode, spinning, cores, gaps: GapEstimate::new(), in_a_row: 0 }
    }

    /// A reply was sent.
    pub fn replied(&mut self) {
        self.gaps.replied(Instant::now());
    }

    /// A request came.
    pub fn received(&mut self) {
        self.gaps.received(Instant::now());
    }

    /// Polls for the next request while `idle` reports that no other world needs the core. Then, if `may_block` and the request
    /// is expected soon, waits for it in a blocking read.
    pub async fn next(
        &mut self,
        socket: &mut WebSocket,
        idle: impl Fn() -> bool,
        may_block: bool,
    ) -> Option<Incoming> {
        if let Some(message) = self.spin(socket, idle).await {
            return Some(message);
        }
        if !(may_block && self.gaps.is_soon()) {
            return None;
        }
        let _blocking = self.poll_mode.block();
        poll_once(socket).await
    }

    async fn spin(&mut self, socket: &mut WebSocket, idle: impl Fn() -> bool) -> Option<Incoming> {
        let span = self.gaps.spin_time()?;
        let _permit = self.spinning.as_ref()?.permit(self.cores)?;
        let _spinning = self.poll_mode.spin();
        let end = Instant::now() + span;
        while idle() && Instant::now() < end {
            if let Some(message) = poll_once(socket).await {
                return Some(message);
            }
            // The client may need this core.
            std::thread::yield_now();
        }
        None
    }

    /// Whether to poll again before other events are handled. Bounded: a client that never pauses must not delay organizers,
    /// pings and the clock.
    pub fn continues(&mut self, found: bool) -> bool {
        self.in_a_row = if found { (self.in_a_row + 1) % IN_A_ROW } else { 0 };
        self.in_a_row > 0
    }
}

/// Polls the socket once; in the mode `block` it returns after a message or a few milliseconds.
async fn poll_once(socket: &mut WebSocket) -> Option<Incoming> {
    let mut next = pin!(socket.recv());
    match poll_fn(|context| Poll::Ready(next.as_mut().poll(context))).await {
        Poll::Ready(message) => Some(message),
        Poll::Pending => None,
    }
}

/// Estimates the time from a reply to the next request.
#[derive(Clone, Debug)]
struct GapEstimate {
    replied: Option<Instant>,
    /// Mean time from a reply to the next request, s; each gap is clamped to twice [`MAX_SPIN`].
    mean_s: f64,
}

impl GapEstimate {
    /// Without data: the gap is taken as too long to poll.
    fn new() -> Self {
        GapEstimate { replied: None, mean_s: 2.0 * MAX_SPIN.as_secs_f64() }
    }

    /// A reply was sent.
    fn replied(&mut self, now: Instant) {
        self.replied = Some(now);
    }

    /// A request came.
    fn received(&mut self, now: Instant) {
        if let Some(replied) = self.replied.take() {
            let gap_s = (now - replied).as_secs_f64().min(2.0 * MAX_SPIN.as_secs_f64());
            self.mean_s += WEIGHT * (gap_s - self.mean_s);
        }
    }

    /// How long to poll for the next request; None when it is expected too late.
    fn spin_time(&self) -> Option<Duration> {
        let span = Duration::from_secs_f64(1.5 * self.mean_s);
        (self.replied.is_some() && span <= MAX_SPIN).then_some(span)
    }

    /// Whether most gaps are below the clamp.
    fn is_soon(&self) -> bool {
        self.replied.is_some() && self.mean_s < 1.8 * MAX_SPIN.as_secs_f64()
    }
}

/// Limits the connections that poll at once: most cores are for worlds.
#[derive(Debug, Default)]
pub(super) struct SpinLimit(AtomicUsize);

/// Guard for one busy-poll slot.
struct SpinPermit<'a>(&'a AtomicUsize);

impl SpinLimit {
    /// A slot, one for two cores; None when all are taken.
    fn permit(&self, cores: usize) -> Option<SpinPermit<'_>> {
        let permit = SpinPermit(&self.0);
        // Counted in any case: dropping a refused permit gives its slot back.
        (self.0.fetch_add(1, Ordering::AcqRel) < cores / 2).then_some(permit)
    }
}

impl Drop for SpinPermit<'_> {
    fn drop(&mut self) {
        self.0.fetch_sub(1, Ordering::AcqRel);
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn only_quick_clients_are_polled() {
        let mut gaps = GapEstimate::new();
        let mut now = Instant::now();
        let mut go = |gaps: &mut GapEstimate, micros: u64, times: u32| {
            for _ in 0..times {
                gaps.replied(now);
                now += Duration::from_micros(micros);
                gaps.received(now);
            }
            gaps.replied(now);
        };
        go(&mut gaps, 100, 1);
        assert_eq!(gaps.spin_time(), None, "once is not a habit");
        go(&mut gaps, 600, 30);
        assert!(gaps.spin_time().is_none() && gaps.is_soon(), "too late to poll, but soon");
        go(&mut gaps, 100, 30);
        let span = gaps.spin_time().expect("polled");
        assert!((140..170).contains(&span.as_micros()), "{span:?}");
        go(&mut gaps, 20_000, 3);
        assert_eq!(gaps.spin_time(), None, "the controller thinks now");
        go(&mut gaps, 20_000, 30);
        assert!(!gaps.is_soon());
    }

    #[test]
    fn there_is_one_slot_for_two_cores() {
        let limit = SpinLimit::default();
        assert!(limit.permit(1).is_none());
        let first = limit.permit(4).expect("free");
        let second = limit.permit(4).expect("free");
        assert!(limit.permit(4).is_none());
        drop(first);
        assert!(limit.permit(4).is_some());
        drop(second);
    }
}
