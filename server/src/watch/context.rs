//! The parts of the server that a viewer's connection needs.

use super::hub::Hub;
use super::ranking_cache::RankingCache;
use crate::auth::Auth;
use crate::clock::SessionClocks;
use crate::competition::Competition;
use crate::lifecycle::Lifecycle;
use crate::store::Store;
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
    /// The ranking.
    pub(crate) ranking: Arc<RankingCache>,
    /// Closes the connections of revoked tokens.
    pub(crate) auth: Arc<Auth>,
    /// Closes the connection when the server stops.
    pub(crate) lifecycle: Arc<Lifecycle>,
}
