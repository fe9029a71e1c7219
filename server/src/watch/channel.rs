//! The way of a run's frames and messages from the thread that steps the world to its viewers.
//!
//! The world publishes samples of its state and wakes at most one task, the channel's pump, thirty times a second. The pump makes
//! a frame of the newest sample and wakes the viewers. So the cost for a world does not grow with the number of viewers.

use super::access::{RunAccess, Watcher};
use super::frame::Frame;
use super::link::LinkClock;
use super::messages::WatchRun;
use super::sample::{OverlayCounts, Overlays, WatchSample};
use axum::extract::ws::Utf8Bytes;
use palmares_tasks::Sensing;
use palmares_tasks::run::TelemetryModel;
use parking_lot::Mutex;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;
use tokio::sync::{broadcast, watch};
use tokio::time::{Instant, sleep_until};

/// Shortest time between two frames: 30 Hz.
const FRAME_PERIOD: Duration = Duration::from_micros(33_334);

/// A message that every viewer must get.
#[derive(Clone, Debug)]
pub(super) enum QueuedMessage {
    /// Sent as it is.
    Message(Utf8Bytes),
    /// The last message of a run.
    Ended(Utf8Bytes),
    /// The run is no longer here; another host may continue it.
    Moved,
}

/// The origin of a run's frames.
#[derive(Debug)]
pub(super) enum Source {
    /// A world of this host.
    World {
        /// The newest sample; the run has its sender.
        samples: watch::Receiver<Arc<WatchSample>>,
        telemetry_model: Arc<TelemetryModel>,
    },
    /// Another host, which sends frames and the session's clock.
    Host { clock: Mutex<Option<LinkClock>> },
}

/// A run's frames and messages.
#[derive(Debug)]
pub(super) struct Channel {
    /// The run, without what spectators must not know.
    pub(super) info: WatchRun,
    pub(super) sensing: Sensing,
    /// Whether the team uploaded the hand.
    pub(super) own_hand: bool,
    /// The message `scene`: with the hand's full description, and without.
    pub(super) scenes: [Utf8Bytes; 2],
    pub(super) source: Source,
    /// The newest frame.
    pub(super) frames: watch::Sender<Arc<Frame>>,
    pub(super) queue: broadcast::Sender<QueuedMessage>,
    /// Overlays of the viewers.
    pub(super) overlays: OverlayCounts,
    /// Time of the newest sample, ms since the hub exists.
    pub(super) moved: AtomicU64,
    /// Time of the referee's last event, ms since the hub exists; 0: none.
    pub(super) last_event: AtomicU64,
    pub(super) pumping: AtomicBool,
}

impl Channel {
    /// The properties that decide who may watch it.
    pub(super) fn access(&self) -> RunAccess<'_> {
        RunAccess { team: &self.info.team, official: self.info.official, sensing: self.sensing }
    }

    /// The message `scene` for a watcher.
    pub(super) fn scene(&self, watcher: &Watcher) -> Utf8Bytes {
        let [with_hand, bare] = &self.scenes;
        // In practice every client may see every team's hand.
        if watcher.may_know_hand(&self.info.team, self.own_hand && self.info.official) {
            with_hand.clone()
        } else {
            bare.clone()
        }
    }

    /// The newest sample.
    pub(super) fn newest(&self) -> Arc<WatchSample> {
        match &self.source {
            Source::World { samples, .. } => samples.borrow().clone(),
            Source::Host { .. } => self.frames.borrow().sample.clone(),
        }
    }

    /// The session's clock as another host has sent it; None for a run of this host.
    pub(super) fn linked_clock(&self) -> Option<LinkClock> {
        let Source::Host { clock } = &self.source else { return None };
        *clock.lock()
    }

    /// Notes the session's clock as another host has sent it.
    pub(super) fn set_linked_clock(&self, newest: Option<LinkClock>) {
        if let Source::Host { clock } = &self.source {
            *clock.lock() = newest;
        }
    }

    /// Makes a frame of the newest sample, unless there is one.
    pub(super) fn refresh(&self) {
        let Source::World { samples, telemetry_model } = &self.source else { return };
        self.frames.send_if_modified(|frame| {
            let newest = samples.borrow().clone();
            let fresh = !Arc::ptr_eq(&frame.sample, &newest);
            if fresh {
                *frame = Arc::new(Frame::new(&self.info.run_id, telemetry_model, newest));
            }
            fresh
        });
    }

    pub(super) fn is_watched(&self) -> bool {
        self.frames.receiver_count() > 0
    }

    /// Starts the task that makes frames while the run has viewers.
    pub(super) fn pump(self: &Arc<Self>) {
        let Source::World { samples, .. } = &self.source else { return };
        if !self.pumping.swap(true, Ordering::AcqRel) {
            tokio::spawn(pump(self.clone(), samples.clone()));
        }
    }
}

async fn pump(channel: Arc<Channel>, mut samples: watch::Receiver<Arc<WatchSample>>) {
    loop {
        let begun = Instant::now();
        samples.mark_unchanged();
        channel.refresh();
        sleep_until(begun + FRAME_PERIOD).await;
        // An error means that the run is over; a viewer that sends its last message sends the last frame first.
        let over = samples.changed().await.is_err();
        if !over && channel.is_watched() {
            continue;
        }
        channel.pumping.store(false, Ordering::Release);
        // A viewer may have come in between.
        if over || !channel.is_watched() || channel.pumping.swap(true, Ordering::AcqRel) {
            return;
        }
    }
}

/// A run that a viewer follows.
#[derive(Debug)]
pub(super) struct Following {
    pub(super) channel: Arc<Channel>,
    /// The newest frame.
    pub(super) frames: watch::Receiver<Arc<Frame>>,
    /// Messages that must not be skipped.
    pub(super) queue: broadcast::Receiver<QueuedMessage>,
    overlays: Overlays,
}

impl Following {
    /// Follows a run from its newest frame on.
    pub(super) fn new(channel: &Arc<Channel>) -> Self {
        channel.refresh();
        Following {
            channel: channel.clone(),
            frames: channel.frames.subscribe(),
            queue: channel.queue.subscribe(),
            overlays: Overlays::default(),
        }
    }

    /// Sets the viewer's overlays.
    pub(super) fn set_overlays(&mut self, overlays: Overlays) {
        self.channel.overlays.remove(std::mem::replace(&mut self.overlays, overlays));
        self.channel.overlays.add(overlays);
    }
}

impl Drop for Following {
    fn drop(&mut self) {
        self.channel.overlays.remove(self.overlays);
    }
}
