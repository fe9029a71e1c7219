//! How many control connections may be open: all together, and of one team.

use super::counts::{Counts, Share};
use crate::auth::Identity;
use crate::config::settings::Settings;
use palmares_protocol::{Code, Refusal};
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Counts the control connections.
#[derive(Debug)]
pub(crate) struct Connections {
    all: Arc<Semaphore>,
    most: usize,
    by_team: Counts<String>,
    most_of_team: usize,
}

/// A control connection that is counted, until it is dropped.
#[derive(Debug)]
pub(crate) struct ConnectionPermit {
    _of_all: OwnedSemaphorePermit,
    _of_team: Option<Share<String>>,
}

impl Connections {
    /// As many as an organizer allows.
    pub(super) fn new(settings: &Settings) -> Self {
        Connections {
            all: Arc::new(Semaphore::new(settings.max_connections)),
            most: settings.max_connections,
            by_team: Counts::default(),
            most_of_team: settings.max_connections_per_team,
        }
    }

    /// Counts another connection of a team.
    ///
    /// # Errors
    /// There are enough.
    pub(crate) fn take(&self, identity: Option<&Identity>) -> Result<ConnectionPermit, Refusal> {
        let full = |message: String| Refusal::new(Code::Capacity, message).retry_after(5.0);
        let mut of_team = identity.and_then(|identity| identity.team.clone()).map(|t| self.by_team.share(t));
        let most = self.most_of_team;
        if of_team.as_mut().is_some_and(|share| !share.grow(1, most)) {
            return Err(full(format!("all {most} connections of this team are in use")));
        }
        let of_all = self.all.clone().try_acquire_owned();
        let of_all =
            of_all.map_err(|_| full(format!("all {} connections of this server are in use", self.most)))?;
        Ok(ConnectionPermit { _of_all: of_all, _of_team: of_team })
    }
}
