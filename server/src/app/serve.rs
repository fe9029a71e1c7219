//! Starts, runs and stops the server.

use super::assemble;
use super::beat::beat;
use super::memory;
use super::playable::playable;
use crate::archive::{Upload, Verification, WriteAgain};
use crate::competition::rules::CompetitionPhase;
use crate::fleet::lease::{Lease, Moment};
use crate::http;
use crate::http::state::AppState;
use anyhow::Context;
use palmares_net::config::{Config, ServeOptions};
use palmares_net::process::{logging, version};
use palmares_net::transport;
use palmares_net::transport::low_latency::listener::Listener;
use palmares_protocol::reply::ServerInfo;
use palmares_store::files::private_files;
use palmares_store::{LEASE, Location, Store};
use palmares_tasks::Task;
use palmares_worlds::compute::{STACK_BYTES, overrun};
use std::io::Write;
use std::net::SocketAddr;
use std::num::NonZero;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpSocket};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::time::timeout;

/// Longest time for each step after the open runs have ended: answers in progress, the verification, the database.
const STOP_TIMEOUT: Duration = Duration::from_secs(3);

/// Exit code when open runs did not finish.
const UNFINISHED: u8 = 3;

/// Serves until a signal ends it.
///
/// # Errors
/// Reason why the server cannot start.
pub fn serve(options: &ServeOptions, own: ServerInfo) -> anyhow::Result<ExitCode> {
    version::set(own);
    memory::limit_arenas();
    logging::start()?;
    let config = options.resolve()?;
    // Threads for the network, the database and signals. Worlds are stepped on other threads.
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get).max(2);
    let mut runtime = tokio::runtime::Builder::new_multi_thread();
    let runtime = runtime.worker_threads(threads).thread_stack_size(STACK_BYTES).enable_all().build();
    let runtime = runtime.context("cannot start the asynchronous runtime")?;
    let ended = runtime.block_on(run(&config));
    // Without waiting: the thread of an endless tick ends with the process.
    runtime.shutdown_background();
    ended
}

async fn run(config: &Config) -> anyhow::Result<ExitCode> {
    let (mut interrupt, mut terminate) = (on(SignalKind::interrupt())?, on(SignalKind::terminate())?);
    let guard = assemble::guard(config)?;
    let tasks = assemble::tasks(config)?;
    let hands = playable(config, &tasks, assemble::hands(config, &tasks)?)?;
    // Before the database: a second server by mistake must not change the runs of the first.
    let listener = listen(config.listen).with_context(|| {
        format!("cannot listen on {}; choose another with --listen, port 0 takes a free one", config.listen)
    })?;
    let address = listener.local_addr().context("the listening socket has no address")?;
    private_files::make_folder(&config.data_dir)
        .with_context(|| format!("cannot make the data directory {}", config.data_dir.display()))?;
    private_files::withdraw_access(&config.data_dir);
    let location = Location::new(&config.data_dir, config.database_url.clone());
    let host = assemble::host(config, &tasks, &hands);
    let requested = Moment::now();
    let store = Store::open(&location, &host).await?;
    // A server alone on a database of its own needs no lease.
    let fleet = store.host_name().is_some();
    let lease = Arc::new(if fleet { Lease::from(requested, LEASE) } else { Lease::endless() });
    let audited: Arc<[Arc<Task>]> = tasks.clone().into();
    let app = assemble::app(config, guard, store, tasks, hands, lease.clone()).await?;
    let lifecycle = app.lifecycle.clone();
    let beats = app.store.is_shared().then(|| tokio::spawn(beat(app.clone(), lease, fleet)));
    // Before the first round of verification, which keeps the replays of open runs.
    app.sessions.refund_all().await?;
    if !fleet {
        app.sessions.end_lost().await?;
        app.sessions.adopt(usize::MAX).await?;
    }
    let verification = match app.archive.clone() {
        None => None,
        Some(archive) => {
            let verification = Verification::new(app.store.clone(), archive, app.hub.clone(), audited)?;
            let writer = app.sessions.shipper.is_some().then(|| app.sessions.clone() as Arc<dyn WriteAgain>);
            let verification = verification.writing(writer);
            let lifecycle = lifecycle.clone();
            Some(tokio::spawn(verification.run(async move { lifecycle.stopping().await })))
        }
    };
    let upload = app
        .archive
        .clone()
        .and_then(|archive| Upload::new(app.store.clone(), archive, app.competition.own_hands.clone()));
    if let Some(upload) = upload {
        // Not waited for: what is not uploaded is uploaded after the next start.
        let lifecycle = lifecycle.clone();
        tokio::spawn(upload.run(async move { lifecycle.stopping().await }));
    }
    greet(address, &location, &app, config)?;

    let signalled = {
        let lifecycle = lifecycle.clone();
        async move {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
            tracing::info!("shutting down: open runs are stopped and scored");
            lifecycle.stop();
        }
    };
    tokio::spawn(signalled);
    let router = http::router(app.clone());
    // The plain `listener` would switch the low-latency path off.
    let listener = Listener::new(listener);
    let server = transport::serve(listener, router, app.inbound.clone(), lifecycle.clone());
    let server = tokio::spawn(server);
    let overseer = tokio::spawn(overrun::watch_over(app.compute.clone()));
    tokio::spawn(app.sessions.clone().keep_clocks_saved());
    if let Some(hosts) = &app.other_hosts {
        tokio::spawn(hosts.clone().keep_read());
    }
    lifecycle.stopping().await;
    // Sockets and sessions first, then the last HTTP answers.
    let finished = timeout(config.shutdown_grace, lifecycle.idle()).await.is_ok();
    if !finished {
        tracing::warn!("some runs did not finish in time; they are marked at the next start");
    }
    if let Ok(ended) = timeout(STOP_TIMEOUT, server).await {
        ended.context("the server's task failed")?;
    }
    if let Some(verification) = verification
        && let Ok(ended) = timeout(STOP_TIMEOUT, verification).await
    {
        ended.context("the verification's task failed")?;
    }
    overseer.abort();
    if let Some(beats) = beats {
        beats.abort();
    }
    if timeout(STOP_TIMEOUT, app.store.close()).await.is_err() {
        tracing::warn!("the database did not close in time");
    }
    tracing::info!("stopped");
    Ok(if finished { ExitCode::SUCCESS } else { ExitCode::from(UNFINISHED) })
}

/// Send buffer of a connection, bytes: a larger one would only delay the observations of a slow client.
const SEND_BUFFER_BYTES: u32 = 128 << 10;

fn listen(address: SocketAddr) -> std::io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4()? } else { TcpSocket::new_v6()? };
    // A restarted server can bind while old connections are in TIME_WAIT.
    socket.set_reuseaddr(true)?;
    // Accepted connections inherit it.
    socket.set_send_buffer_size(SEND_BUFFER_BYTES)?;
    socket.bind(address)?;
    socket.listen(1024)
}

fn on(kind: SignalKind) -> anyhow::Result<Signal> {
    signal(kind).context("cannot listen for signals")
}

/// Prints one line for programs on stdout, and hints for people on stderr.
fn greet(address: SocketAddr, location: &Location, app: &AppState, config: &Config) -> anyhow::Result<()> {
    let database = match location {
        Location::DataDir(folder) => folder.join("palmares.sqlite").display().to_string(),
        Location::Url(_) => "as given by --database-url".into(),
    };
    let competition = &app.competition;
    let rules = &competition.rules;
    let tasks: Vec<&str> = competition.tasks.iter().map(|task| task.name.as_str()).collect();
    let hands: Vec<&str> = competition.hands.iter().map(|hand| hand.name.as_str()).collect();
    let kind = match (rules.official(), rules.phase()) {
        (false, _) => "practice server".to_owned(),
        (true, CompetitionPhase::Open) => format!("official server: {}, open", rules.name),
        (true, CompetitionPhase::Closed) => {
            format!("official server: {}, closed (palmares admin open)", rules.name)
        }
        (true, CompetitionPhase::Revealed) => format!("official server: {}, over", rules.name),
    };
    // Only the path is shown, not the token.
    let token = config.organizer_token_file();
    let token = match rules.official() && token.exists() {
        true => format!("\n  organizer    the first one's token is in {}", token.display()),
        false => String::new(),
    };
    // A closed stderr is no error.
    let _ = writeln!(
        std::io::stderr(),
        "Palmares {} {kind}\n  leaderboard  http://{address}/\n  controllers  ws://{address}/v1/control\n  \
         tasks        {}\n  hands        {}\n  database     {database}{token}\nCtrl-C ends it; open runs are scored first.",
        env!("CARGO_PKG_VERSION"),
        tasks.join(", "),
        hands.join(", "),
    );
    let mut out = std::io::stdout().lock();
    writeln!(out, "listening on http://{address}")
        .and_then(|()| out.flush())
        .context("cannot write to stdout")
}
