//! Builds the parts of the server from its configuration.

use crate::archive::{Archive, Keys};
use crate::backup;
use crate::competition::Competition;
use crate::competition::hands::OwnHands;
use crate::competition::rules::Rules;
use crate::fleet::lease::Lease;
use crate::fleet::shipper::Shipper;
use crate::http::readiness::Readiness;
use crate::http::state::AppState;
use crate::session::Sessions;
use crate::watch::{FleetKey, Hub, OtherHosts, RankingCache};
use anyhow::{Context, anyhow, bail};
use palmares_models::builtin::builtin_hands;
use palmares_models::hand::Hand;
use palmares_models::read::{self, LoadOptions, Loaded};
use palmares_net::auth::{self, Role, Token};
use palmares_net::config::{CompetitionMode, Config};
use palmares_net::process::lifecycle::Lifecycle;
use palmares_net::process::version;
use palmares_net::transport::InboundLimits;
use palmares_net::transport::guard::Guard;
use palmares_net::transport::trusted_proxies::TrustedProxies;
use palmares_store::files::objects::Objects;
use palmares_store::files::private_files::{read_secret, write_secret};
use palmares_store::names;
use palmares_store::{Host, NewAuditEntry, Store};
use palmares_tasks::{Task, inspect, task};
use palmares_worlds::clock::SessionClocks;
use palmares_worlds::compute::Compute;
use std::num::NonZero;
use std::path::Path;
use std::sync::Arc;

/// The requests that the server accepts, by the names under which it is served.
///
/// # Errors
/// A configured name or site cannot be compared with those of a request.
pub(super) fn guard(config: &Config) -> anyhow::Result<Guard> {
    let guard = Guard {
        loopback: config.listen.ip().is_loopback(),
        hosts: config.allowed_hosts.clone(),
        origins: config.allowed_origins.clone(),
    };
    guard.check_names()?;
    Ok(guard)
}

/// All parts, with this database.
pub(super) async fn app(
    config: &Config,
    guard: Guard,
    store: Store,
    tasks: Vec<Arc<Task>>,
    hands: Vec<Arc<Hand>>,
    lease: Arc<Lease>,
) -> anyhow::Result<AppState> {
    let rules = Rules::open(config, &store).await?;
    // Before anything is written: a server without the expected keys changes nothing.
    let objects = config.storage.as_deref().map(Objects::open).transpose()?.map(Arc::new);
    let archive = archive(config, &store, &hands, objects.clone()).await?;
    first_organizer(config, &store).await?;
    let settings = config.settings.clone();
    let cores = std::thread::available_parallelism().map_or(1, NonZero::get);
    let compute = Arc::new(Compute::new(cores, settings.max_worlds));
    compute.admission.set_paused(rules.is_paused());
    let inbound =
        Arc::new(InboundLimits::new(&settings, guard, TrustedProxies(config.trusted_proxies.clone())));
    let own_hands =
        Arc::new(OwnHands::new(&config.data_dir, config.hand_limits.clone(), tasks.clone(), objects));
    let sensing = config.sensing.clone();
    let hand_spread = config.hand_spread;
    let competition =
        Arc::new(Competition { rules, tasks, hands, own_hands, sensing, hand_spread, settings });
    let (hub, lifecycle) = (Arc::<Hub>::default(), Arc::<Lifecycle>::default());
    let clocks = Arc::<SessionClocks>::default();
    let ranking = Arc::new(RankingCache::new(store.clone(), competition.rules.official(), hub.clone()));
    for newest in store.announcements(1).await? {
        hub.announce_text(&newest);
    }
    let sessions = Arc::new(Sessions {
        store: store.clone(),
        competition: competition.clone(),
        compute: compute.clone(),
        archive: archive.clone(),
        hub: hub.clone(),
        lifecycle: lifecycle.clone(),
        clocks: clocks.clone(),
        registry: Default::default(),
        following: Default::default(),
        lease: lease.clone(),
        shipper: fleet_shipper(config, &store)?,
        adopting: Default::default(),
        saving: Default::default(),
    });
    let other_hosts = other_hosts(config, &store, &competition, &hub);
    let secrets =
        vec![("seed.secret", config.seed_secret.clone()), ("signing.key", config.signing_key.clone())];
    let backup = Arc::new(backup::Files { data_dir: config.data_dir.clone(), secrets });
    let readiness = Arc::new(Readiness::new(store.clone(), &config.data_dir));
    let auth = Arc::default();
    Ok(AppState {
        store,
        competition,
        compute,
        sessions,
        clocks,
        archive,
        hub,
        other_hosts,
        host_rows: Arc::default(),
        ranking,
        auth,
        inbound,
        lifecycle,
        lease,
        readiness,
        backup,
    })
}

/// This server as a host of its database.
pub(super) fn host(config: &Config, tasks: &[Arc<Task>], hands: &[Arc<Hand>]) -> Host {
    let tasks: Vec<_> = tasks.iter().map(|task| (&task.name, task.content_hash())).collect();
    let ranges = |hand: &Hand| config.hand_spread.then(|| hand.uncertain_hash());
    let hands: Vec<_> = hands.iter().map(|hand| (&hand.name, hand.content_hash(), ranges(hand))).collect();
    let mode: &str = config.mode.into();
    let common = serde_json::json!({
        "name": config.name, "mode": mode, "session_s": config.session_s, "sessions_per_team": config.sessions_per_team,
        "reset_cost_s": config.reset_cost_s, "scenes": config.scenes, "sensors_only": config.sensing.sensors_only(), "tasks": tasks,
        "hands": hands, "storage": config.storage,
    });
    Host {
        name: config.fleet.as_ref().map(|fleet| fleet.host.clone()),
        config_sha256: auth::sha256_hex(common.to_string().as_bytes()),
        build_hash: version::own().build_hash,
        internal_url: config.fleet.as_ref().and_then(|fleet| fleet.internal_url.clone()),
        places: config.settings.max_worlds,
    }
}

/// Stores the ticks of official runs, for the other hosts of a fleet.
fn fleet_shipper(config: &Config, store: &Store) -> anyhow::Result<Option<Shipper>> {
    let ships = config.fleet.is_some() && config.mode == CompetitionMode::Official;
    let shipper = ships.then(|| Shipper::start(store.clone())).transpose();
    shipper.context("cannot start the thread that stores the ticks of runs")
}

/// The runs of the other hosts of a fleet, for viewers. The key for signatures is common to all hosts.
fn other_hosts(
    config: &Config,
    store: &Store,
    competition: &Arc<Competition>,
    hub: &Arc<Hub>,
) -> Option<Arc<OtherHosts>> {
    config.fleet.as_ref()?;
    // Without replays there may be no key: then viewers have only the runs of their host.
    let key = std::fs::read_to_string(&config.signing_key).ok()?;
    let (store, competition, hub) = (store.clone(), competition.clone(), hub.clone());
    Some(Arc::new(OtherHosts::new(store, competition, hub, FleetKey::new(&key))))
}

/// The archive of replays; None on a practice server that does not record.
async fn archive(
    config: &Config,
    store: &Store,
    hands: &[Arc<Hand>],
    objects: Option<Arc<Objects>>,
) -> anyhow::Result<Option<Arc<Archive>>> {
    // Official runs are always recorded: they count only with a replay.
    if config.no_replays && config.mode == CompetitionMode::Practice {
        return Ok(None);
    }
    let practice_bytes = config.practice_replays_mb.saturating_mul(1 << 20);
    let keys = Keys::open(&config.signing_key, store, config.replace_signing_key).await?;
    let archive = Archive::open(&config.data_dir, keys, practice_bytes)
        .with_context(|| format!("cannot make the folder of replays in {}", config.data_dir.display()))?
        .sharing(objects);
    let own = &hands[hands.len() - config.hands.len()..];
    for (path, hand) in config.hands.iter().zip(own) {
        match palmares_replay::pack(path, hand) {
            Ok(files) => archive.add_hand(hand, Arc::new(files)),
            Err(error) => {
                tracing::warn!(%error, hand = hand.name, "replays with this hand cannot be verified")
            }
        }
    }
    Ok(Some(Arc::new(archive)))
}

/// Lets the first organizer in. The token is that of the configured file, which all hosts of a fleet have; without one the server makes a
/// token in the data directory, if the database has no organizer.
async fn first_organizer(config: &Config, store: &Store) -> anyhow::Result<()> {
    let what = |path: &Path| format!("organizer's token {}", path.display());
    if let Some(path) = &config.organizer_token
        && let Some(text) = read_secret(path).with_context(|| what(path))?
    {
        let token = Token::parse(text.trim());
        let token = token.with_context(|| format!("{}: expected a token, plm_…", what(path)))?;
        return auth::admit_organizer(store, &token, "organizer_token").await.with_context(|| what(path));
    }
    if store.has_organizer().await? {
        return Ok(());
    }
    let entry = NewAuditEntry {
        actor: "server",
        action: "token.issue",
        subject: "organizer",
        reason: Some("first start"),
    };
    let token = Token::random().context("no randomness for a token")?;
    let path = config.organizer_token_file();
    // A file for an earlier database is useless.
    let _ = std::fs::remove_file(&path);
    // Before the database: a token that nobody has would lock all organizers out.
    write_secret(&path, &token.reveal()).with_context(|| format!("{}: cannot be written", what(&path)))?;
    auth::add(store, &token, Role::Organizer, None, "first", false, &entry).await?;
    Ok(())
}

/// The items with the configured names; all without a configuration.
fn chosen<T>(
    field: &str,
    names: Option<&[String]>,
    all: Vec<Arc<T>>,
    name: impl Fn(&T) -> &str,
) -> anyhow::Result<Vec<Arc<T>>> {
    let Some(names) = names else { return Ok(all) };
    let find = |wanted: &String| {
        let found = all.iter().find(|one| name(one) == wanted).cloned();
        found.with_context(|| {
            let known: Vec<&str> = all.iter().map(|one| name(one)).collect();
            format!("{field}: no `{wanted}`; there are {}", known.join(", "))
        })
    };
    if names.is_empty() {
        bail!("{field}: name at least one, or leave the field out for all");
    }
    names.iter().map(find).collect()
}

/// The built-in tasks, and those from folders.
pub(super) fn tasks(config: &Config) -> anyhow::Result<Vec<Arc<Task>>> {
    let mut tasks = chosen("tasks", config.builtin_tasks.as_deref(), Task::builtin(), |task| &task.name)?;
    for path in &config.tasks {
        let task::Loaded { task, warnings } =
            Task::load(path).map_err(|error| anyhow!("a task of your own: {error}"))?;
        for warning in &warnings {
            tracing::warn!("{warning}");
        }
        // Names of tasks that are not played are taken too: replays refer to a task by name.
        let known = Task::builtin().into_iter().chain(tasks.iter().cloned());
        if known.map(|known| known.name.clone()).any(|name| name == task.name) {
            bail!(
                "{}: there is a task named `{}` already; give this one a name of its own in {}: name = \"...\"",
                path.display(),
                task.name,
                Task::FILE
            );
        }
        tasks.push(Arc::new(task));
    }
    Ok(tasks)
}

/// The built-in hands, and those from files.
pub(super) fn hands(config: &Config, tasks: &[Arc<Task>]) -> anyhow::Result<Vec<Arc<Hand>>> {
    let builtin = builtin_hands().to_vec();
    let mut hands = chosen("hands", config.builtin_hands.as_deref(), builtin, |hand| &hand.name)?;
    for path in &config.hands {
        // The error names the file and the cause.
        let Loaded { hand, sources, warnings } = read::hand(path, &LoadOptions::default())
            .map_err(|error| anyhow!("a hand of your own: {error}"))?;
        let beyond = inspect::beyond_limits(&hand, &sources, &config.hand_limits);
        if !beyond.is_empty() {
            let rows = inspect::join_reasons(&beyond);
            bail!(
                "a hand of your own is beyond the limits, which [hand_limits] in the file of --config sets:\n{rows}"
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
            bail!("a hand of your own: {}", inspect::join_reasons(&in_the_way));
        }
        hands.push(hand);
    }
    Ok(hands)
}
