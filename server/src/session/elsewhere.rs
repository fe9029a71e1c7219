//! Sessions of a fleet's other hosts: one is brought here when its client is here.

use super::failure::store_failed;
use super::registry::Registry;
use super::session::{Session, Sessions};
use palmares_protocol::{Code, Refusal};
use palmares_worlds::compute::admission::RETRY_S;
use palmares_worlds::world::run::World;
use std::sync::Arc;
use std::time::{Duration, Instant};

/// Longest wait for a session of another host: the end of a lease, and the continuation of a run.
const FETCH_TIMEOUT: Duration = Duration::from_secs(8);
/// Time between two attempts.
const FETCH_PERIOD: Duration = Duration::from_millis(100);

impl Sessions {
    /// Brings the session with this resume token here, if another host has it: at once if that host is gone, otherwise when it gives it.
    /// `firmly`: the client has shown the token, so that an old connection of it does not matter.
    ///
    /// # Errors
    /// The other host keeps it, or the database failed.
    pub(super) async fn fetch(self: &Arc<Self>, token_hash: &str, firmly: bool) -> Result<(), Refusal> {
        if self.store.host_name().is_none() {
            return Ok(());
        }
        let began = Instant::now();
        let failed = store_failed("the session");
        while !self.registry.has(token_hash) {
            let open = self.store.open_session_by_token(token_hash).await.map_err(&failed)?;
            let Some(session_id) = open else { return Ok(()) };
            if self.lease.is_valid() {
                self.revive(&session_id).await.map_err(&failed)?;
                if self.registry.knows(&session_id) {
                    return Ok(());
                }
            }
            self.store.want_session(&session_id, firmly).await.map_err(&failed)?;
            if began.elapsed() >= FETCH_TIMEOUT {
                return Err(Registry::<Session>::taken());
            }
            tokio::time::sleep(FETCH_PERIOD).await;
        }
        Ok(())
    }

    /// Refuses another session unless the other hosts have places for the worlds of the fullest one, should it fail.
    ///
    /// # Errors
    /// The fleet is full, or the database failed.
    pub(super) async fn check_reserve(&self) -> Result<(), Refusal> {
        if self.store.host_name().is_none() {
            return Ok(());
        }
        let hosts = self.store.hosts().await.map_err(store_failed("the session"))?;
        let up: Vec<_> = hosts.iter().filter(|host| host.state == "up").collect();
        let free: i64 = up.iter().map(|host| (host.places - host.taken).max(0)).sum();
        let reserve = up.iter().map(|host| host.taken).max().unwrap_or_default();
        if up.len() > 1 && free <= reserve {
            let message =
                format!("the fleet is full: free places: {free}; kept in case that a host fails: {reserve}");
            return Err(Refusal::new(Code::Capacity, message).retry_after(RETRY_S));
        }
        Ok(())
    }
}

impl Session {
    /// Whether another host continues the session when this server stops.
    pub(crate) fn moves_on(&self) -> bool {
        self.official && self.shared.store.host_name().is_some() && self.outlasts_absence()
    }

    /// Gives the session to whoever wants it. It ends here.
    pub(crate) async fn hand_over(mut self: Box<Self>) {
        if let Err(refusal) = self.give_away().await {
            // Others take it when this server's lease ends.
            tracing::warn!(
                why = refusal.message,
                session = self.held.session_id,
                "the session was not handed over"
            );
        }
        self.part();
    }

    /// Stops the world, stores its last ticks and the clock, and gives up the ownership.
    pub(super) async fn give_away(&mut self) -> Result<(), Refusal> {
        self.stand();
        self.catch_up();
        if let (Some(shipper), Some(run)) = (&self.shared.shipper, self.machine.playing())
            && let Some(open) = &mut self.open_run
            && open.gate.is_some()
        {
            let run_id = run.run_id.clone();
            // A run that has ended has reported all its ticks.
            let _ = open.with_world(World::notify_observers);
            let lost = |_| Refusal::new(Code::Internal, "the session has another owner");
            shipper.flush(&run_id).await.map_err(lost)?;
        }
        self.show_clock();
        self.shared.save_clocks().await?;
        self.shared.store.release_session(&self.held).await?;
        self.held.lose();
        Ok(())
    }
}
