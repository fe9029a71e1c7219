//! Replays verified by a Ray cluster.
//!
//! Python is the client of the cluster. It gets replays on its standard input, each a line of JSON with its index and size, then its
//! bytes. It writes a line of JSON for each verdict. So the machines of the cluster need no access to the sources.

use super::pool::Event;
use super::sources::Source;
use super::verdict::Verdict;
use crate::environment::variable;
use anyhow::{Context, anyhow, bail};
use palmares_replay::PublicKey;
use serde::Deserialize;
use serde_json::json;
use std::io::{BufRead, BufReader, Write};
use std::path::PathBuf;
use std::process::{Child, ChildStdin, Command, Stdio};
use std::sync::Arc;
use std::sync::mpsc::{Receiver, Sender, channel};

/// The module that is the client of the cluster.
const MODULE: &str = "palmares.program.verify_season";

/// The Python process. It ends when this is dropped, and its tasks with it.
pub(super) struct Cluster(Child);

impl Cluster {
    /// Waits until Python has left the cluster: it has returned all verdicts.
    pub(super) fn leave(mut self) {
        let _ = self.0.wait();
    }
}

impl Drop for Cluster {
    fn drop(&mut self) {
        let _ = self.0.kill();
        let _ = self.0.wait();
    }
}

/// A line from Python.
#[derive(Deserialize)]
#[serde(rename_all = "snake_case")]
enum Line {
    /// The cluster is there. The number of replays that it takes at once.
    Ready(usize),
    /// A verdict.
    Judged { index: usize, verdict: Verdict },
    /// The verification cannot go on.
    Failed(String),
}

/// Starts Python and sends it the sources.
///
/// # Errors
/// Python, the package or Ray is missing, or there is no cluster at the address.
pub(super) fn start(
    address: &str,
    key: Option<PublicKey>,
    tasks: &[PathBuf],
    sources: Arc<[Source]>,
    events: Sender<Event>,
) -> anyhow::Result<Cluster> {
    let python =
        variable("PALMARES_PYTHON").map_or("python3".into(), |name| name.to_string_lossy().into_owned());
    let server = crate::version::version();
    let mut command = Command::new(&python);
    command.args(["-m", MODULE, "--build"]).arg(format!("{}, build {}", server.version, server.build_hash));
    if !address.is_empty() {
        command.args(["--address", address]);
    }
    if let Some(key) = key {
        command.args(["--key", &key.to_string()]);
    }
    for task in tasks {
        command.arg("--task").arg(task);
    }
    let child = command.stdin(Stdio::piped()).stdout(Stdio::piped()).spawn();
    let needs = "--ray needs a Python with palmares[ray]; PALMARES_PYTHON names it";
    let mut cluster = Cluster(child.with_context(|| format!("{python} does not start: {needs}"))?);
    let (Some(stdin), Some(stdout)) = (cluster.0.stdin.take(), cluster.0.stdout.take()) else {
        bail!("{python} has no standard input")
    };
    let mut lines = BufReader::new(stdout).lines();
    let mut next = move || -> anyhow::Result<Option<Line>> {
        let Some(line) = lines.next().transpose()? else { return Ok(None) };
        serde_json::from_str(&line).map(Some).with_context(|| format!("from {MODULE}: {line}"))
    };
    let places = match next()? {
        Some(Line::Ready(places)) => places,
        Some(Line::Failed(message)) => bail!("{message}"),
        // Python has printed the reason.
        _ => bail!("{python} -m {MODULE} ended: {needs}"),
    };

    let (free, places_free) = channel();
    for _ in 0..places.max(1) {
        let _ = free.send(());
    }
    let judged = events.clone();
    let (of_reader, total) = (free.clone(), sources.len());
    let read = move || {
        let mut left = total;
        while left > 0 {
            let event = match next() {
                Ok(Some(Line::Judged { index, verdict })) => Event::Judged(index, verdict),
                Ok(Some(Line::Failed(message))) => Event::Failed(anyhow!(message)),
                Ok(Some(Line::Ready(_))) => continue,
                Ok(None) => Event::Failed(anyhow!("the client of the Ray cluster has ended")),
                Err(error) => Event::Failed(error),
            };
            let failed = matches!(event, Event::Failed(_));
            if judged.send(event).is_err() || failed {
                return;
            }
            left -= 1;
            let _ = of_reader.send(());
        }
    };
    std::thread::Builder::new().name("from-ray".into()).spawn(read)?;
    let send = move || feed(stdin, &sources, &places_free, &free, &events);
    std::thread::Builder::new().name("to-ray".into()).spawn(send)?;
    Ok(cluster)
}

/// Sends replays, each when there is a place for it.
fn feed(
    mut stdin: ChildStdin,
    sources: &[Source],
    places: &Receiver<()>,
    free: &Sender<()>,
    events: &Sender<Event>,
) {
    for (index, source) in sources.iter().enumerate() {
        if places.recv().is_err() {
            return;
        }
        let sent = match source.load() {
            Ok(bytes) => {
                let head = json!({"index": index, "bytes": bytes.len()});
                writeln!(stdin, "{head}").and_then(|()| stdin.write_all(&bytes)).and_then(|()| stdin.flush())
            }
            Err(error) => {
                let verdict = Verdict::Unreadable { message: format!("{error:#}") };
                let _ = events.send(Event::Judged(index, verdict));
                let _ = free.send(());
                Ok(())
            }
        };
        // The reader reports why Python has ended.
        if sent.is_err() {
            return;
        }
    }
}
