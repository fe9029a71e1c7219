//! The parts of the server that a viewer's connection needs.

use super::access::Watcher;
use super::channel::Following;
use super::hub::{FindError, Hub};
use super::messages::WatchRun;
use super::other_hosts::OtherHosts;
use super::ranking_cache::RankingCache;
use super::request::Target;
use crate::competition::Competition;
use palmares_net::auth::Auth;
use palmares_net::process::lifecycle::Lifecycle;
use palmares_store::Store;
use palmares_worlds::clock::SessionClocks;
use std::sync::Arc;

/// The parts of the server that a viewer's connection needs.
#[derive(Clone, Debug)]
pub(crate) struct WatchContext {
    /// For tokens.
    pub(crate) store: Store,
    /// For the timeouts.
    pub(crate) competition: Arc<Competition>,
    /// The clocks of the sessions that are watched.
    pub(crate) clocks: Arc<SessionClocks>,
    /// The runs that are watched.
    pub(crate) hub: Arc<Hub>,
    /// The runs of the other hosts of a fleet; None without one.
    pub(crate) other_hosts: Option<Arc<OtherHosts>>,
    /// The ranking.
    pub(crate) ranking: Arc<RankingCache>,
    /// Closes the connections of revoked tokens.
    pub(crate) auth: Arc<Auth>,
    /// Closes the connection when the server stops.
    pub(crate) lifecycle: Arc<Lifecycle>,
}

impl WatchContext {
    /// The open runs that this watcher may watch.
    pub(super) async fn list(&self, watcher: &Watcher) -> Vec<WatchRun> {
        match &self.other_hosts {
            Some(hosts) => hosts.list(watcher).await,
            None => self.hub.list(watcher),
        }
    }

    /// Follows the run that a target names.
    pub(super) async fn find(&self, target: &Target, watcher: &Watcher) -> Result<Following, FindError> {
        match &self.other_hosts {
            Some(hosts) => hosts.find(target, watcher).await,
            None => self.hub.find(target, watcher),
        }
    }

    /// Whether a run that is no longer here may be open elsewhere.
    pub(super) async fn may_continue(&self, run_id: &str) -> bool {
        match &self.other_hosts {
            Some(hosts) => hosts.may_continue(run_id).await,
            None => false,
        }
    }
}
