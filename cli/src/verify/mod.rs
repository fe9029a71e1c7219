//! `palmares verify`: one replay, or all of a season.

mod file;
mod pool;
mod ray;
mod runs;
mod sources;
mod verdict;

use crate::progress::{self, Progress};
use anyhow::Context;
use clap::Args;
pub(crate) use file::load;
use palmares_replay::PublicKey;
use palmares_tasks::Task;
use pool::{Event, Judge};
use runs::RunTable;
use serde_json::{Value, json};
use sources::Source;
use std::collections::BTreeMap;
use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;
use std::sync::mpsc::{RecvTimeoutError, Sender, channel};
use std::time::{Duration, Instant};
use verdict::Verdict;

/// Exit code after Ctrl-C, as a shell reports it.
const INTERRUPTED: u8 = 130;
/// Time between two looks at the progress.
const LOOK: Duration = Duration::from_millis(250);

/// Options of `palmares verify`.
#[derive(Args, Debug)]
pub(crate) struct VerifyOptions {
    /// Replays: files; folders, with all `.mcap` files below them; or s3://BUCKET/PREFIX, with the address and the credentials of
    /// AWS_ENDPOINT_URL, AWS_REGION, AWS_ACCESS_KEY_ID and AWS_SECRET_ACCESS_KEY, as for the server's `storage`
    #[arg(required = true, value_name = "SOURCE")]
    sources: Vec<PathBuf>,
    /// Expected public key of the server, 64 hexadecimal digits: `replay_key` in GET /v1/competition. Without it the signer is
    /// printed but not checked
    #[arg(long, value_name = "HEX")]
    key: Option<PublicKey>,
    /// Your own task, if runs are of one: a folder with a task.toml. May be given several times
    #[arg(long = "task", value_name = "PATH")]
    tasks: Vec<PathBuf>,
    /// Print one JSON object per replay; for folders and buckets also a last one, `summary`
    #[arg(long)]
    json: bool,
    /// Number of replays at once [default: the number of cores]
    #[arg(long, value_name = "N", conflicts_with = "ray", value_parser = clap::value_parser!(u16).range(1..))]
    jobs: Option<u16>,
    /// Skip the replays that are verified in this file: the output of an earlier --json
    #[arg(long, value_name = "FILE")]
    resume: Option<PathBuf>,
    /// Compare the replays with this table of runs: the output of `palmares admin export runs`, CSV or JSON. A run without its replay,
    /// a replay with another score or digest, and a replay that no run names are differences. A data directory with SQLite is compared
    /// with its own table
    #[arg(long, value_name = "FILE")]
    runs: Option<PathBuf>,
    /// Verify on the machines of a Ray cluster: that of this machine, a new one on this machine alone, or that at ADDRESS. Needs
    /// Python with palmares[ray]; PALMARES_PYTHON names it if it is not `python3`
    #[arg(long, value_name = "ADDRESS", num_args = 0..=1, require_equals = true, default_missing_value = "")]
    ray: Option<String>,
}

/// Verifies every replay and prints the results.
pub(crate) fn verify(options: &VerifyOptions) -> anyhow::Result<ExitCode> {
    let mut sources = sources::find(&options.sources)?;
    let table = match (&options.runs, options.sources.as_slice()) {
        (Some(path), _) => Some(RunTable::read(path)?),
        (None, [source]) => RunTable::of(source)?,
        (None, _) => None,
    };
    let mut verified = options.resume.as_deref().map(verified_in).transpose()?.unwrap_or_default();
    let found: Vec<String> = sources.iter().map(Source::name).collect();
    sources.retain(|source| !verified.contains_key(&source.name()));
    // An earlier output may have other sources; they are dropped.
    verified.retain(|name, _| found.contains(name));
    let skipped = found.len() - sources.len();
    let season = options.ray.is_some()
        || options.resume.is_some()
        || options.sources.iter().any(|source| sources::has_many(source));
    let sources: Arc<[Source]> = sources.into();

    let (events, inbox) = channel();
    // Before the pool: a Ctrl-C while it starts is the same.
    stop_at_ctrl_c(events.clone())?;
    let cluster = match &options.ray {
        Some(address) => Some(ray::start(address, options.key, &options.tasks, sources.clone(), events)?),
        None => {
            let judge = Judge { key: options.key, tasks: own_tasks(&options.tasks)? };
            let cores = || std::thread::available_parallelism().map_or(1, usize::from);
            pool::start(options.jobs.map_or_else(cores, usize::from), judge, sources.clone(), &events)?;
            None
        }
    };

    let began = Instant::now();
    let mut tally = Tally { total: sources.len(), skipped, ..Tally::default() };
    let mut progress = Progress::new(season || sources.len() > 1, sources.len(), "replays");
    // Results are printed in the order of the sources.
    let (mut waiting, mut printed) = (BTreeMap::new(), 0);
    let print = |progress: &mut Progress, index: usize, verdict: &Verdict| -> anyhow::Result<()> {
        let name = sources[index].name();
        let line =
            if options.json { verdict.json(&name) } else { verdict.text(&name, options.key.is_some()) };
        progress.clear();
        writeln!(std::io::stdout().lock(), "{line}")?;
        Ok(())
    };
    while tally.done() < sources.len() {
        match inbox.recv_timeout(LOOK) {
            Ok(Event::Judged(index, verdict)) => {
                tally.add(&verdict);
                if table.is_some() && matches!(verdict, Verdict::Verified { .. }) {
                    verified.insert(sources[index].name(), verdict.clone());
                }
                waiting.insert(index, verdict);
                while let Some(verdict) = waiting.remove(&printed) {
                    print(&mut progress, printed, &verdict)?;
                    printed += 1;
                }
            }
            Ok(Event::Interrupted) => {
                tally.interrupted = true;
                break;
            }
            Ok(Event::Failed(error)) => {
                progress.clear();
                return Err(error);
            }
            Err(RecvTimeoutError::Timeout) => {}
            Err(RecvTimeoutError::Disconnected) => break,
        }
        let others = tally.done() - tally.verified;
        let remark = (others > 0).then(|| format!("{others} not verified"));
        progress.show(tally.done(), remark.as_deref(), began.elapsed());
    }
    for (index, verdict) in &waiting {
        print(&mut progress, *index, verdict)?;
    }
    progress.clear();
    match cluster {
        Some(cluster) if !tally.interrupted => cluster.leave(),
        _ => {}
    }
    if let Some(table) = table.filter(|_| !tally.interrupted) {
        let differences = table.compare(&found, &verified);
        for difference in &differences {
            let line = if options.json { difference.json().to_string() } else { difference.text() };
            writeln!(std::io::stdout().lock(), "{line}")?;
        }
        tally.compared = Some((table.place().to_owned(), differences.len()));
    }
    if season || tally.interrupted || tally.compared.is_some() {
        if options.json {
            writeln!(std::io::stdout().lock(), "{}", tally.json(began.elapsed()))?;
        }
        // The reader of a pipe may have ended.
        let _ = writeln!(std::io::stderr(), "{}", tally.text(began.elapsed()));
    }
    Ok(match tally.interrupted {
        true => ExitCode::from(INTERRUPTED),
        false if tally.verified == tally.total && tally.differences() == 0 => ExitCode::SUCCESS,
        false => ExitCode::FAILURE,
    })
}

/// The number of replays by verdict.
#[derive(Debug, Default)]
struct Tally {
    total: usize,
    skipped: usize,
    verified: usize,
    unreadable: usize,
    /// By reason.
    refused: BTreeMap<String, usize>,
    interrupted: bool,
    /// The table of runs, and the number of differences from it.
    compared: Option<(String, usize)>,
}

impl Tally {
    fn differences(&self) -> usize {
        self.compared.as_ref().map_or(0, |(_, differences)| *differences)
    }

    fn add(&mut self, verdict: &Verdict) {
        match verdict {
            Verdict::Verified { .. } => self.verified += 1,
            Verdict::Refused { reason, .. } => *self.refused.entry(reason.clone()).or_default() += 1,
            Verdict::Unreadable { .. } => self.unreadable += 1,
        }
    }

    fn refused(&self) -> usize {
        self.refused.values().sum()
    }

    fn done(&self) -> usize {
        self.verified + self.unreadable + self.refused()
    }

    fn json(&self, elapsed: Duration) -> Value {
        json!({"summary": {
            "replays": self.total, "done": self.done(), "verified": self.verified, "refused": self.refused(),
            "reasons": self.refused, "unreadable": self.unreadable, "skipped": self.skipped,
            "interrupted": self.interrupted, "elapsed_s": elapsed.as_secs_f64(),
            "runs": self.compared.as_ref().map(|(place, _)| place), "differences": self.differences(),
        }})
    }

    fn text(&self, elapsed: Duration) -> String {
        let mut text = if self.interrupted { "interrupted: ".to_owned() } else { String::new() };
        text += &format!(
            "{} of {} replays in {}: {} verified, {} refused",
            self.done(),
            self.total,
            progress::duration(elapsed),
            self.verified,
            self.refused()
        );
        if !self.refused.is_empty() {
            let reasons = self.refused.iter().map(|(reason, count)| format!("{reason} {count}"));
            text += &format!(" ({})", reasons.collect::<Vec<_>>().join(", "));
        }
        text += &format!(", {} unreadable", self.unreadable);
        if self.skipped > 0 {
            text += &format!("; {} skipped: verified earlier", self.skipped);
        }
        if let Some((place, differences)) = &self.compared {
            text += &format!("; compared with the runs in {place}: {differences} differences");
        }
        text
    }
}

/// The replays that are verified in the output of an earlier `--json`, by name. Its last line may be cut off.
fn verified_in(file: &Path) -> anyhow::Result<BTreeMap<String, Verdict>> {
    let text = std::fs::read_to_string(file).with_context(|| format!("--resume {}", file.display()))?;
    let lines = text.lines().filter_map(|line| serde_json::from_str::<Value>(line).ok());
    let verified = lines.filter_map(|line| {
        let name = line["file"].as_str()?.to_owned();
        let verdict: Verdict = serde_json::from_value(line).ok()?;
        matches!(verdict, Verdict::Verified { .. }).then_some((name, verdict))
    });
    Ok(verified.collect())
}

/// Without the server's libraries Ctrl-C ends the process at once.
#[cfg(not(feature = "server"))]
fn stop_at_ctrl_c(_: Sender<Event>) -> anyhow::Result<()> {
    Ok(())
}

/// Reports the first Ctrl-C; the second ends the process.
#[cfg(feature = "server")]
fn stop_at_ctrl_c(events: Sender<Event>) -> anyhow::Result<()> {
    let runtime = tokio::runtime::Builder::new_current_thread().enable_all().build()?;
    let wait = move || {
        runtime.block_on(async {
            for _ in 0..2 {
                if tokio::signal::ctrl_c().await.is_err() {
                    return;
                }
                if events.send(Event::Interrupted).is_err() {
                    return;
                }
            }
            std::process::exit(i32::from(INTERRUPTED));
        });
    };
    std::thread::Builder::new().name("ctrl-c".into()).spawn(wait)?;
    Ok(())
}

/// Tasks from folders.
pub(crate) fn own_tasks(paths: &[PathBuf]) -> anyhow::Result<Vec<Arc<Task>>> {
    paths.iter().map(|path| Ok(Arc::new(Task::load(path)?.task))).collect()
}
