//! Limits on open control connections: in total, and for each team.

use super::quota::{Quota, Quotas};
use crate::auth::Identity;
use crate::config::settings::Settings;
use palmares_protocol::{Code, Refusal};
use std::sync::Arc;
use tokio::sync::{OwnedSemaphorePermit, Semaphore};

/// Counts the control connections.
#[derive(Debug)]
pub struct Connections {
    all: Arc<Semaphore>,
    max: usize,
    by_team: Quotas<String>,
    max_of_team: usize,
}

/// A control connection, counted until this is dropped.
#[derive(Debug)]
pub struct ConnectionPermit {
    _of_all: OwnedSemaphorePermit,
    _of_team: Option<Quota<String>>,
}

impl Connections {
    /// The limits that the organizer sets.
    pub(super) fn new(settings: &Settings) -> Self {
        Connections {
            all: Arc::new(Semaphore::new(settings.max_connections)),
            max: settings.max_connections,
            by_team: Quotas::default(),
            max_of_team: settings.max_connections_per_team,
        }
    }

    /// Counts another connection of a team.
    ///
    /// # Errors
    /// A limit is reached.
    pub fn take(&self, identity: Option<&Identity>) -> Result<ConnectionPermit, Refusal> {
        let full = |message: String| Refusal::new(Code::Capacity, message).retry_after(5.0);
        let mut of_team = identity.and_then(|identity| identity.team.clone()).map(|t| self.by_team.of(t));
        let max = self.max_of_team;
        if of_team.as_mut().is_some_and(|quota| !quota.grow(1, max)) {
            return Err(full(format!("all {max} connections of this team are in use")));
        }
        let of_all = self.all.clone().try_acquire_owned();
        let of_all =
            of_all.map_err(|_| full(format!("all {} connections of this server are in use", self.max)))?;
        Ok(ConnectionPermit { _of_all: of_all, _of_team: of_team })
    }
}
