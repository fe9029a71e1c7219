//! The parts of the server. A handler takes those it needs as `State<…>`, by axum's `FromRef`.

use crate::archive::Archive;
use crate::backup;
use crate::competition::Competition;
use crate::fleet::hosts::OtherHostRows;
use crate::fleet::lease::Lease;
use crate::http::readiness::Readiness;
use crate::session::Sessions;
use crate::watch::{Hub, OtherHosts, RankingCache, WatchContext};
use axum::extract::FromRef;
use palmares_net::auth::Auth;
use palmares_net::process::lifecycle::Lifecycle;
use palmares_net::transport::InboundLimits;
use palmares_store::Store;
use palmares_worlds::clock::SessionClocks;
use palmares_worlds::compute::Compute;
use std::sync::Arc;

/// The parts of the server. Clones share them.
#[derive(Clone, Debug)]
pub(crate) struct AppState {
    /// The database.
    pub(crate) store: Store,
    /// Tasks, hands and rules.
    pub(crate) competition: Arc<Competition>,
    /// Computing resources.
    pub(crate) compute: Arc<Compute>,
    /// The sessions of teams.
    pub(crate) sessions: Arc<Sessions>,
    /// The clocks of the sessions.
    pub(crate) clocks: Arc<SessionClocks>,
    /// Replays; None on a practice server that does not record.
    pub(crate) archive: Option<Arc<Archive>>,
    /// The spectators' hub.
    pub(crate) hub: Arc<Hub>,
    /// The runs of the other hosts of a fleet; None without one.
    pub(crate) other_hosts: Option<Arc<OtherHosts>>,
    /// The other hosts of a fleet, as read last.
    pub(crate) host_rows: Arc<OtherHostRows>,
    /// The ranking.
    pub(crate) ranking: Arc<RankingCache>,
    /// Checks tokens.
    pub(crate) auth: Arc<Auth>,
    /// Limits on connections and uploads.
    pub(crate) inbound: Arc<InboundLimits>,
    /// The server's stop, and the tasks that it waits for.
    pub(crate) lifecycle: Arc<Lifecycle>,
    /// This server's right to its sessions.
    pub(crate) lease: Arc<Lease>,
    /// Proves that the server can write.
    pub(crate) readiness: Arc<Readiness>,
    /// The files of a backup.
    pub(crate) backup: Arc<backup::Files>,
}

/// Makes parts available to handlers.
macro_rules! parts {
    ($($field:ident: $part:ty),* $(,)?) => {
        $(impl FromRef<AppState> for $part {
            fn from_ref(app: &AppState) -> Self {
                app.$field.clone()
            }
        })*
    };
}

parts! {
    store: Store,
    competition: Arc<Competition>,
    compute: Arc<Compute>,
    sessions: Arc<Sessions>,
    clocks: Arc<SessionClocks>,
    archive: Option<Arc<Archive>>,
    hub: Arc<Hub>,
    ranking: Arc<RankingCache>,
    auth: Arc<Auth>,
    inbound: Arc<InboundLimits>,
    lifecycle: Arc<Lifecycle>,
    lease: Arc<Lease>,
    readiness: Arc<Readiness>,
    backup: Arc<backup::Files>,
}

impl FromRef<AppState> for WatchContext {
    fn from_ref(app: &AppState) -> Self {
        WatchContext {
            store: app.store.clone(),
            competition: app.competition.clone(),
            clocks: app.clocks.clone(),
            hub: app.hub.clone(),
            other_hosts: app.other_hosts.clone(),
            ranking: app.ranking.clone(),
            auth: app.auth.clone(),
            lifecycle: app.lifecycle.clone(),
        }
    }
}
