//! The beat of a server whose database can have several: it renews the lease twice a second, takes over sessions of hosts that are gone,
//! gives sessions to the hosts where their clients are, and reads what other hosts have changed.

use crate::fleet::lease::{Lease, Moment};
use crate::http::state::AppState;
use palmares_store::{LEASE, OwnedSession, Renewal, StoreError};
use sqlx::AnyConnection;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::time::Duration;
use tokio::time::{Instant, sleep_until, timeout};

/// Time between two beats.
const PERIOD: Duration = Duration::from_millis(500);
/// Longest time for one beat. After it the connection is thrown away: an old one can hang for minutes after the repair of a network.
const BEAT_TIMEOUT: Duration = Duration::from_millis(1000);
/// A host of a fleet gives up its sessions when its lease has ended for this time: their clients are to find another host.
const GIVE_UP: Duration = Duration::from_millis(800);
/// Time between two looks for what hosts that are gone have left.
const SWEEP_PERIOD: Duration = Duration::from_secs(5);

/// Renews the lease until the server has stopped. Without `fleet` nobody else can take the sessions, and none are given up.
pub(super) async fn beat(app: AppState, lease: Arc<Lease>, fleet: bool) {
    let mut connection = None;
    let (mut swept, mut answered) = (Instant::now(), Instant::now());
    let adopting = Arc::new(AtomicBool::new(false));
    loop {
        let (began, requested) = (Instant::now(), Moment::now());
        match timeout(BEAT_TIMEOUT, once(&app, &mut connection)).await {
            Ok(Ok(Some(owned))) => {
                // Also without a fleet, where the lease has no end.
                if answered.elapsed() >= LEASE {
                    tracing::warn!("the database answers again");
                    if let Err(error) = app.store.reconnect().await {
                        tracing::error!(%error, "the connections to the database could not be replaced");
                    }
                }
                answered = began;
                lease.renew(requested, LEASE);
                app.sessions.follow_owners(owned);
            }
            Ok(Ok(None)) => {
                tracing::error!("another process has taken this server's place; it stops");
                app.sessions.registry.lose_all();
                app.lifecycle.stop();
                return;
            }
            Ok(Err(error)) => {
                tracing::warn!(%error, "the lease could not be renewed");
                connection = None;
            }
            Err(_) => {
                tracing::warn!("the lease could not be renewed: the database does not answer");
                connection = None;
            }
        }
        if fleet && lease.ended_for() >= GIVE_UP && app.sessions.registry.len() > 0 {
            tracing::error!("no lease: the sessions are given up");
            app.sessions.registry.lose_all();
            // As another owner, this server takes over what nobody else has.
            app.store.renew_incarnation();
        }
        if fleet
            && lease.is_whole()
            && !app.lifecycle.is_stopping()
            && !adopting.swap(true, Ordering::Relaxed)
        {
            let sweep = swept.elapsed() >= SWEEP_PERIOD;
            if sweep {
                swept = Instant::now();
            }
            let (app, adopting) = (app.clone(), adopting.clone());
            tokio::spawn(async move {
                let free = app.compute.max_worlds().saturating_sub(app.compute.admission.open().all());
                if let Err(error) = app.store.answered(app.sessions.adopt(free)).await {
                    tracing::warn!(%error, "sessions without an owner could not be taken over");
                }
                if sweep && let Err(error) = app.store.answered(app.sessions.end_lost()).await {
                    tracing::warn!(%error, "what lost hosts have left could not be ended");
                }
                if sweep && let Err(error) = app.store.answered(app.sessions.give_up_orphans()).await {
                    tracing::warn!(%error, "sessions that nobody here has could not be given up");
                }
                let shared = app.archive.as_ref().is_some_and(|archive| archive.is_shared());
                if sweep && let Err(error) = app.store.answered(app.store.sweep_shipped_runs(shared)).await {
                    tracing::warn!(%error, "the ticks of ended runs could not be deleted");
                }
                adopting.store(false, Ordering::Relaxed);
            });
        }
        sleep_until(began + PERIOD).await;
    }
}

/// Applies what another host has changed; the beat does not wait for the sessions.
fn follow_competition(app: &AppState) {
    let sessions = app.sessions.clone();
    tokio::spawn(async move {
        if let Err(error) = sessions.follow_competition().await {
            tracing::warn!(%error, "a change of the competition's state could not be applied");
        }
    });
}

/// One beat. None if another process has taken this host's place.
async fn once(
    app: &AppState,
    connection: &mut Option<AnyConnection>,
) -> Result<Option<Vec<OwnedSession>>, StoreError> {
    let connection = match connection {
        Some(connection) => connection,
        None => connection.insert(app.store.connection().await?),
    };
    let open = app.compute.admission.open();
    let renewal = Renewal {
        places: app.compute.max_worlds(),
        taken: open.all(),
        idle: open.idle,
        waiting: app.compute.admission.waiting(),
        draining: app.lifecycle.is_stopping(),
    };
    if !app.store.renew(connection, renewal).await? {
        return Ok(None);
    }
    let held = app.sessions.registry.held();
    let owned = app.store.owners_of(connection, &held).await?;
    if app.store.host_name().is_some() {
        app.host_rows.set(app.store.other_hosts(connection).await?);
    }
    if app.store.competition_state_by(connection).await? != app.competition.rules.state() {
        follow_competition(app);
    }
    app.ranking.follow(connection).await?;
    app.auth.revoke(app.store.revoked_tokens(connection).await?);
    Ok(Some(owned))
}
