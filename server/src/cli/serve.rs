//! `palmares serve`.

use crate::api;
use crate::config::ServeOptions;
use crate::replay;
use crate::session::{Host, STACK, Session};
use crate::store::{Location, Store};
use crate::telemetry;
use anyhow::{Context, bail};
use axum::serve::ListenerExt;
use palmares_models::builtin::builtin_hands;
use palmares_models::hand::Hand;
use palmares_models::load::{self, LoadOptions, Loaded};
use std::io::Write;
use std::net::SocketAddr;
use std::num::NonZero;
use std::path::PathBuf;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpSocket};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::time::timeout;

/// How long open runs and connections may take to finish at shutdown.
const SHUTDOWN_TIMEOUT: Duration = Duration::from_secs(30);

/// Serves until a signal ends it.
pub(super) fn serve(options: &ServeOptions) -> anyhow::Result<()> {
    telemetry::start()?;
    // Worlds are stepped on the runtime's threads, at most as many at once as there are cores; two more keep the
    // network going meanwhile.
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get) + 2;
    let mut runtime = tokio::runtime::Builder::new_multi_thread();
    let runtime = runtime.worker_threads(threads).thread_stack_size(STACK).enable_all().build();
    let runtime = runtime.context("cannot start the asynchronous runtime")?;
    runtime.block_on(run(options))
}

async fn run(options: &ServeOptions) -> anyhow::Result<()> {
    let (mut interrupt, mut terminate) = (on(SignalKind::interrupt())?, on(SignalKind::terminate())?);
    let hands = hands(&options.hands)?;
    // The port before the database: a second server by mistake must not touch the first one's runs.
    let listener = listen(options.listen).with_context(|| {
        format!("cannot listen on {}; choose another with --listen, port 0 takes a free one", options.listen)
    })?;
    let address = listener.local_addr().context("the listening socket has no address")?;
    let location = options.location();
    let store = Store::open(&location).await?;
    for run in store.abort_open_runs().await? {
        tracing::warn!(run, "the server stopped during this run; marked as aborted");
    }
    let replays = archive(options, &hands)?;
    let host = Arc::new(Host::new(store, options.settings(), hands, replays.clone()));
    let auditor = replays.map(|archive| {
        let (store, host) = (host.store.clone(), host.clone());
        tokio::spawn(replay::audit(store, archive, async move { host.stopping().await }))
    });
    for session in host.store.load_resumable_sessions().await? {
        Session::restore(&host, session);
    }
    greet(address, &location, &host)?;

    // Small messages, each waited for: Nagle's algorithm would only hold them back.
    let listener = listener.tap_io(|stream| {
        if let Err(error) = stream.set_nodelay(true) {
            tracing::debug!(%error, "no TCP_NODELAY");
        }
    });
    let signalled = {
        let host = host.clone();
        async move {
            tokio::select! {
                _ = interrupt.recv() => {}
                _ = terminate.recv() => {}
            }
            tracing::info!("shutting down: open runs are stopped and scored");
            host.stop();
        }
    };
    let server = axum::serve(listener, api::router(host.clone())).with_graceful_shutdown(signalled);
    let server = tokio::spawn(server.into_future());
    host.stopping().await;
    // Sockets and sessions first, then the last HTTP answers.
    if timeout(SHUTDOWN_TIMEOUT, host.deserted()).await.is_err() {
        tracing::warn!("some runs did not finish in time; they are marked at the next start");
    }
    if let Ok(ended) = timeout(Duration::from_secs(5), server).await {
        ended.context("the server's task failed")?.context("the server failed")?;
    }
    if let Some(auditor) = auditor {
        auditor.await.context("the verification's task failed")?;
    }
    host.store.close().await;
    tracing::info!("stopped");
    Ok(())
}

/// What may be on its way to a client in the system's buffers, bytes: more would only make what a slow client sees
/// older.
const SEND_BUFFER: u32 = 128 << 10;

fn listen(address: SocketAddr) -> std::io::Result<TcpListener> {
    let socket = if address.is_ipv4() { TcpSocket::new_v4()? } else { TcpSocket::new_v6()? };
    // A server that is started again must not wait for the old connections to be forgotten.
    socket.set_reuseaddr(true)?;
    // Connections inherit it.
    socket.set_send_buffer_size(SEND_BUFFER)?;
    socket.bind(address)?;
    socket.listen(1024)
}

/// Where runs are recorded.
fn archive(options: &ServeOptions, hands: &[Arc<Hand>]) -> anyhow::Result<Option<Arc<replay::Archive>>> {
    if options.no_replays {
        return Ok(None);
    }
    let key = options.data_dir.join(replay::KEY_FILE);
    let kept = options.practice_replays_mb.saturating_mul(1 << 20);
    let archive = replay::Archive::open(&options.data_dir, &key, kept)?;
    let own = &hands[hands.len() - options.hands.len()..];
    for (path, hand) in options.hands.iter().zip(own) {
        match replay::pack(path, hand) {
            Ok(files) => archive.add_hand(hand, Arc::new(files)),
            Err(error) => {
                tracing::warn!(%error, hand = hand.name, "replays with this hand cannot be verified")
            }
        }
    }
    Ok(Some(Arc::new(archive)))
}

/// The hands that come with the program, and those of these files.
fn hands(own: &[PathBuf]) -> anyhow::Result<Vec<Arc<Hand>>> {
    let mut hands = builtin_hands().to_vec();
    for path in own {
        let Loaded { hand, warnings, .. } = load::hand(path, &LoadOptions::default())?;
        for warning in &warnings {
            tracing::warn!("{warning}");
        }
        if hands.iter().any(|known| known.name == hand.name) {
            bail!(
                "{}: there is a hand named `{}` already; give this one a name of its own in hand.toml: \
                 name = \"...\"",
                path.display(),
                hand.name
            );
        }
        hands.push(Arc::new(hand));
    }
    Ok(hands)
}

fn on(kind: SignalKind) -> anyhow::Result<Signal> {
    signal(kind).context("cannot listen for signals")
}

/// One line for programs on stdout, hints for people on stderr.
fn greet(address: SocketAddr, location: &Location, host: &Host) -> anyhow::Result<()> {
    let database = match location {
        Location::DataDir(folder) => folder.join("palmares.sqlite").display().to_string(),
        Location::Url(_) => "as given by --database-url".into(),
    };
    let tasks: Vec<&str> = host.tasks.iter().map(|task| task.name.as_str()).collect();
    let hands: Vec<&str> = host.hands.iter().map(|hand| hand.name.as_str()).collect();
    eprintln!(
        "Palmares {} practice server\n  leaderboard  http://{address}/\n  controllers  ws://{address}/v1/control\n  \
         tasks        {}\n  hands        {}\n  database     {database}\nCtrl-C ends it; open runs are scored first.",
        env!("CARGO_PKG_VERSION"),
        tasks.join(", "),
        hands.join(", "),
    );
    let mut out = std::io::stdout().lock();
    writeln!(out, "listening on http://{address}")
        .and_then(|()| out.flush())
        .context("cannot write to stdout")
}
