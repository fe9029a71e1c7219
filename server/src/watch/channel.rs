//! What a run publishes, and how it gets from the thread that steps the world to its viewers.
//!
//! The world leaves a copy of itself and wakes at most one task, the channel's pump, thirty times a second; the pump
//! makes a frame of the newest copy and wakes the viewers. So a world pays the same for one viewer and for a hundred.

use super::access::{Watched, Watcher};
use super::frame::Frame;
use super::messages::WatchRun;
use super::snapshot::{Overlays, Snapshot, Wanted};
use axum::extract::ws::Utf8Bytes;
use palmares_tasks::Sensing;
use palmares_tasks::run::TelemetryModel;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, AtomicU64, Ordering};
use std::time::Duration;
use tokio::sync::{broadcast, watch};
use tokio::time::{Instant, sleep_until};

/// Least time between two frames: 30 Hz.
const FRAME_PERIOD: Duration = Duration::from_micros(33_334);

/// A message that must not be skipped.
#[derive(Clone, Debug)]
pub(super) enum News {
    /// To be sent as it is.
    Message(Utf8Bytes),
    /// The last one of a run.
    Ended(Utf8Bytes),
}

/// What a run publishes.
#[derive(Debug)]
pub(super) struct Channel {
    /// The run, as spectators may know it.
    pub(super) info: WatchRun,
    pub(super) sensing: Sensing,
    /// Whether the team sent the hand in.
    pub(super) own_hand: bool,
    /// The message `scene`: for those who may know all of the hand, and for the others.
    pub(super) scenes: [Utf8Bytes; 2],
    pub(super) telemetry_model: Arc<TelemetryModel>,
    /// The newest copy; its sender is the run's.
    pub(super) snapshots: watch::Receiver<Arc<Snapshot>>,
    /// The newest frame.
    pub(super) frames: watch::Sender<Arc<Frame>>,
    pub(super) news: broadcast::Sender<News>,
    /// What the viewers want to see.
    pub(super) wanted: Wanted,
    /// When it last moved, ms since the hub exists.
    pub(super) moved: AtomicU64,
    /// When the referee last noted something in it, ms since the hub exists; 0: never.
    pub(super) noted: AtomicU64,
    pub(super) pumping: AtomicBool,
}

impl Channel {
    /// What decides who may watch it.
    pub(super) fn watched(&self) -> Watched<'_> {
        Watched { team: &self.info.team, official: self.info.official, sensing: self.sensing }
    }

    /// The message `scene` for a watcher.
    pub(super) fn scene(&self, watcher: &Watcher) -> Utf8Bytes {
        let [with_hand, bare] = &self.scenes;
        // In practice everybody can ask for any team's hand.
        if watcher.may_know_hand(&self.info.team, self.own_hand && self.info.official) {
            with_hand.clone()
        } else {
            bare.clone()
        }
    }

    /// Makes a frame of the newest copy, unless there is one.
    pub(super) fn refresh(&self) {
        self.frames.send_if_modified(|frame| {
            let newest = self.snapshots.borrow().clone();
            let fresh = !Arc::ptr_eq(&frame.snapshot, &newest);
            if fresh {
                *frame = Arc::new(Frame::new(&self.info.run_id, &self.telemetry_model, newest));
            }
            fresh
        });
    }

    fn is_watched(&self) -> bool {
        self.frames.receiver_count() > 0
    }

    /// Has frames made as long as somebody watches.
    pub(super) fn pump(self: &Arc<Self>) {
        if !self.pumping.swap(true, Ordering::AcqRel) {
            tokio::spawn(pump(self.clone()));
        }
    }
}

async fn pump(channel: Arc<Channel>) {
    let mut snapshots = channel.snapshots.clone();
    loop {
        let begun = Instant::now();
        snapshots.mark_unchanged();
        channel.refresh();
        sleep_until(begun + FRAME_PERIOD).await;
        // An error means that the run is over; whoever tells its last word takes care of the last frame.
        let over = snapshots.changed().await.is_err();
        if !over && channel.is_watched() {
            continue;
        }
        channel.pumping.store(false, Ordering::Release);
        // Somebody may have come just now.
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
    /// What must not be skipped.
    pub(super) news: broadcast::Receiver<News>,
    overlays: Overlays,
}

impl Following {
    /// Follows a run from its newest frame on.
    pub(super) fn new(channel: &Arc<Channel>) -> Self {
        channel.refresh();
        Following {
            channel: channel.clone(),
            frames: channel.frames.subscribe(),
            news: channel.news.subscribe(),
            overlays: Overlays::default(),
        }
    }

    /// Wants to see more than poses.
    pub(super) fn want(&mut self, overlays: Overlays) {
        self.channel.wanted.remove(std::mem::replace(&mut self.overlays, overlays));
        self.channel.wanted.add(overlays);
    }
}

impl Drop for Following {
    fn drop(&mut self) {
        self.channel.wanted.remove(self.overlays);
    }
}
