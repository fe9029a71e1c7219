//! `palmares serve`.

use crate::auth::{self, Role};
use crate::config::{Config, Mode, ServeOptions};
use crate::http;
use crate::inspect;
use crate::names;
use crate::net;
use crate::replay;
use crate::rules::{Phase, Rules, write_secret};
use crate::session::{self, Host, STACK, Session};
use crate::store::{Location, NewAuditEntry, Store};
use crate::telemetry;
use crate::ws::WireListener;
use anyhow::{Context, anyhow, bail};
use palmares_models::builtin::builtin_hands;
use palmares_models::hand::Hand;
use palmares_models::read::{self, LoadOptions, Loaded};
use palmares_tasks::Task;
use std::io::Write;
use std::net::SocketAddr;
use std::num::NonZero;
use std::process::ExitCode;
use std::sync::Arc;
use std::time::Duration;
use tokio::net::{TcpListener, TcpSocket};
use tokio::signal::unix::{Signal, SignalKind, signal};
use tokio::time::timeout;

/// How long each of the last things may take after the open runs: answers that are on their way, the verification, the
/// database.
const LAST_THINGS: Duration = Duration::from_secs(3);

/// How the program ends when runs were left unfinished.
const UNFINISHED: u8 = 3;

/// Serves until a signal ends it.
pub(super) fn serve(options: &ServeOptions) -> anyhow::Result<ExitCode> {
    telemetry::start()?;
    let config = options.resolve()?;
    // The network, the database and the signals. No world is stepped on these threads: sessions have their own.
    let threads = std::thread::available_parallelism().map_or(1, NonZero::get).max(2);
    let mut runtime = tokio::runtime::Builder::new_multi_thread();
    let runtime = runtime.worker_threads(threads).thread_stack_size(STACK).enable_all().build();
    let runtime = runtime.context("cannot start the asynchronous runtime")?;
    let ended = runtime.block_on(run(&config));
    // Without waiting for anybody: the thread of a world that computes for ever ends with the process.
    runtime.shutdown_background();
    ended
}

async fn run(config: &Config) -> anyhow::Result<ExitCode> {
    let (mut interrupt, mut terminate) = (on(SignalKind::interrupt())?, on(SignalKind::terminate())?);
    let tasks = tasks(config)?;
    let hands = hands(config, &tasks)?;
    // The port before the database: a second server by mistake must not touch the first one's runs.
    let listener = listen(config.listen).with_context(|| {
        format!("cannot listen on {}; choose another with --listen, port 0 takes a free one", config.listen)
    })?;
    let address = listener.local_addr().context("the listening socket has no address")?;
    let location = config.location();
    std::fs::create_dir_all(&config.data_dir)
        .with_context(|| format!("cannot make the data directory {}", config.data_dir.display()))?;
    let store = Store::open(&location).await?;
    let rules = Rules::open(config, &store).await?;
    first_organizer(config, &store).await?;
    for run in store.abort_open_runs().await? {
        tracing::warn!(run, "the server stopped during this run; marked as aborted");
        let why = "the server stopped during this run; its time is given back";
        let entry = NewAuditEntry { actor: "server", action: "run.abort", subject: &run, reason: Some(why) };
        store.record(&entry).await?;
    }
    let replays = archive(config, &hands)?;
    let host = Arc::new(Host::new(store, rules, config, tasks, hands, replays.clone()));
    let auditor = replays.map(|archive| {
        let (store, host) = (host.store.clone(), host.clone());
        tokio::spawn(replay::audit(store, archive, async move { host.stopping().await }))
    });
    session::give_back_all(&host).await?;
    for session in host.store.load_resumable_sessions().await? {
        Session::restore(&host, session);
    }
    greet(address, &location, &host)?;

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
    tokio::spawn(signalled);
    let server = net::serve(WireListener::new(listener), http::router(host.clone()), host.clone());
    let server = tokio::spawn(server);
    let overseer = tokio::spawn(session::watch_over(host.clone()));
    host.stopping().await;
    // Sockets and sessions first, then the last HTTP answers.
    let finished = timeout(config.shutdown_grace, host.deserted()).await.is_ok();
    if !finished {
        tracing::warn!("some runs did not finish in time; they are marked at the next start");
    }
    if let Ok(ended) = timeout(LAST_THINGS, server).await {
        ended.context("the server's task failed")?;
    }
    if let Some(auditor) = auditor
        && let Ok(ended) = timeout(LAST_THINGS, auditor).await
    {
        ended.context("the verification's task failed")?;
    }
    overseer.abort();
    if timeout(LAST_THINGS, host.store.close()).await.is_err() {
        tracing::warn!("the database did not close in time");
    }
    tracing::info!("stopped");
    Ok(if finished { ExitCode::SUCCESS } else { ExitCode::from(UNFINISHED) })
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
fn archive(config: &Config, hands: &[Arc<Hand>]) -> anyhow::Result<Option<Arc<replay::Archive>>> {
    // A score is listed only when it replays.
    if config.no_replays && config.mode == Mode::Practice {
        return Ok(None);
    }
    let kept = config.practice_replays_mb.saturating_mul(1 << 20);
    let archive = replay::Archive::open(&config.data_dir, &config.signing_key, kept)?;
    let own = &hands[hands.len() - config.hands.len()..];
    for (path, hand) in config.hands.iter().zip(own) {
        match replay::pack(path, hand) {
            Ok(files) => archive.add_hand(hand, Arc::new(files)),
            Err(error) => {
                tracing::warn!(%error, hand = hand.name, "replays with this hand cannot be verified")
            }
        }
    }
    Ok(Some(Arc::new(archive)))
}

/// A database without an organizer gets one, whose token lies in the data directory.
async fn first_organizer(config: &Config, store: &Store) -> anyhow::Result<()> {
    if store.has_organizer().await? {
        return Ok(());
    }
    let entry = NewAuditEntry {
        actor: "server",
        action: "token.issue",
        subject: "organizer",
        reason: Some("first start"),
    };
    let (token, _) = auth::issue(store, Role::Organizer, None, "first", false, &entry).await?;
    let path = config.data_dir.join("organizer.token");
    // One of an earlier database is of no use any more.
    let _ = std::fs::remove_file(&path);
    write_secret(&path, &token.reveal())
        .with_context(|| format!("cannot write the organizer's token to {}", path.display()))
}

/// The names that the file asks for, each of which must be there.
fn chosen<T>(
    what: &str,
    wanted: Option<&[String]>,
    all: Vec<Arc<T>>,
    name: impl Fn(&T) -> &str,
) -> anyhow::Result<Vec<Arc<T>>> {
    let Some(wanted) = wanted else { return Ok(all) };
    let find = |wanted: &String| {
        let found = all.iter().find(|one| name(one) == wanted).cloned();
        found.with_context(|| {
            let known: Vec<&str> = all.iter().map(|one| name(one)).collect();
            format!("{what}: no `{wanted}`; there are {}", known.join(", "))
        })
    };
    if wanted.is_empty() {
        bail!("{what}: name at least one, or leave the field out for all");
    }
    wanted.iter().map(find).collect()
}

/// The tasks that are played.
fn tasks(config: &Config) -> anyhow::Result<Vec<Arc<Task>>> {
    chosen("tasks", config.tasks.as_deref(), Task::builtin(), |task| &task.name)
}

/// The hands that come with the program, and those of files.
fn hands(config: &Config, tasks: &[Arc<Task>]) -> anyhow::Result<Vec<Arc<Hand>>> {
    let builtin = builtin_hands().to_vec();
    let mut hands = chosen("hands", config.builtin_hands.as_deref(), builtin, |hand| &hand.name)?;
    for path in &config.hands {
        // Its words name the file and tell the cause already.
        let Loaded { hand, sources, warnings } = read::hand(path, &LoadOptions::default())
            .map_err(|error| anyhow!("a hand of your own: {error}"))?;
        let beyond = inspect::beyond_limits(&hand, &sources, &config.hand_limits);
        if !beyond.is_empty() {
            let told = inspect::told(&beyond);
            bail!(
                "a hand of your own is beyond the limits, which [hand_limits] in the file of --config sets:\n{told}"
            );
        }
        for warning in &warnings {
            tracing::warn!("{warning}");
        }
        names::hand(&hand.name).map_err(|error| anyhow!("{}: name in hand.toml: {error}", path.display()))?;
        if hands.iter().any(|known| known.name == hand.name) {
            bail!(
                "{}: there is a hand named `{}` already; give this one a name of its own in hand.toml: \
                 name = \"...\"",
                path.display(),
                hand.name
            );
        }
        let hand = Arc::new(hand);
        let in_the_way = inspect::in_the_way(&hand, tasks);
        if !in_the_way.is_empty() {
            bail!("a hand of your own: {}", inspect::told(&in_the_way));
        }
        hands.push(hand);
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
    let kind = match (host.rules.official(), host.rules.phase()) {
        (false, _) => "practice server".to_owned(),
        (true, Phase::Open) => format!("official server: {}, open", host.rules.name),
        (true, Phase::Closed) => {
            format!("official server: {}, closed (palmares admin open)", host.rules.name)
        }
        (true, Phase::Revealed) => format!("official server: {}, over", host.rules.name),
    };
    // For people who look for it; what is in it is shown nowhere.
    let token = host.data_dir.join("organizer.token");
    let token = match host.rules.official() && token.exists() {
        true => format!("\n  organizer    the first one's token is in {}", token.display()),
        false => String::new(),
    };
    eprintln!(
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
