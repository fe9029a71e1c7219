//! What the program is made of, and what of it a handler may ask for: each as `State<…>`, by axum's `FromRef`.

use crate::archive::Archive;
use crate::auth::Auth;
use crate::backup;
use crate::clock::SessionClocks;
use crate::competition::Competition;
use crate::compute::Compute;
use crate::lifecycle::Lifecycle;
use crate::session::Sessions;
use crate::store::Store;
use crate::transport::InboundLimits;
use crate::watch::{Hub, WatchContext};
use axum::extract::FromRef;
use std::sync::Arc;

/// The parts of the program. A clone leads to the same ones.
#[derive(Clone, Debug)]
pub(crate) struct AppState {
    /// The database.
    pub(crate) store: Store,
    /// What is played, and by which rules.
    pub(crate) competition: Arc<Competition>,
    /// What worlds are computed with.
    pub(crate) compute: Arc<Compute>,
    /// The sessions of teams.
    pub(crate) sessions: Arc<Sessions>,
    /// The sessions' clocks, for everybody who shows them.
    pub(crate) clocks: Arc<SessionClocks>,
    /// Where runs are recorded; none for a practice server that does not.
    pub(crate) archive: Option<Arc<Archive>>,
    /// Where spectators watch.
    pub(crate) hub: Arc<Hub>,
    /// Who may what.
    pub(crate) auth: Arc<Auth>,
    /// Who is let in, and how much may be sent in.
    pub(crate) inbound: Arc<InboundLimits>,
    /// Whether the server is finishing, and who is still there.
    pub(crate) lifecycle: Arc<Lifecycle>,
    /// What a backup takes beside the database.
    pub(crate) backup: Arc<backup::Files>,
}

/// Lets handlers ask for a part of the program.
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
    auth: Arc<Auth>,
    inbound: Arc<InboundLimits>,
    lifecycle: Arc<Lifecycle>,
    backup: Arc<backup::Files>,
}

impl FromRef<AppState> for WatchContext {
    fn from_ref(app: &AppState) -> Self {
        WatchContext {
            store: app.store.clone(),
            competition: app.competition.clone(),
            clocks: app.clocks.clone(),
            hub: app.hub.clone(),
            auth: app.auth.clone(),
            lifecycle: app.lifecycle.clone(),
        }
    }
}
