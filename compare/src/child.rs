//! Plays a [`Task`] within a limit of time: in this process or, where the engine cannot be interrupted within a step, in a
//! child process of this program, which ends when its time is over.

use crate::engine::{EngineKind, NotPlayed};
use crate::played::Played;
use crate::trials::family::{Family, HandKind, Trial};
use crate::trials::play::play;
use anyhow::{Context, Result, anyhow, bail, ensure};
use palmares_bench::cases::{self, Setup};
use palmares_bench::engine::limit::{self, NotFinished};
use serde::de::DeserializeOwned;
use serde::{Deserialize, Serialize};
use serde_json::Value;
use std::cell::RefCell;
use std::io::{BufRead, BufReader, Write};
use std::process::{ChildStdin, ChildStdout, Command, Stdio};

/// Name of the command that makes a child of this program.
pub const COMMAND: &str = "child";

/// A case or a grasp to play.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub enum Task {
    /// A case; its answer is [`Played`].
    Case {
        /// Its name.
        name: String,
        /// Step of the reference run, s, where one is wanted.
        reference_dt_s: Option<f64>,
        /// Number of the start.
        start: u32,
    },
    /// A grasp that was drawn; its answer is [`Fate`](crate::trials::play::Fate).
    Grasp {
        /// The hand.
        hand: String,
        /// The family.
        family: String,
        /// The grasp's place in it.
        index: usize,
        /// Distance of the object from its drawn place, µm.
        aside_um: f64,
    },
}

/// A task, and the engine that plays it.
#[derive(Debug, Serialize, Deserialize)]
struct Request {
    task: Task,
    engine: String,
    settings: String,
    /// Step, s.
    dt_s: f64,
    /// CPU time of a peer's run, s.
    limit_s: f64,
}

/// Reason why there is no answer.
#[derive(Clone, Debug, PartialEq, Eq, Serialize, Deserialize, thiserror::Error)]
#[error("{said}")]
pub struct Failure {
    /// Message of the engine or the case.
    pub said: String,
    /// Whether the run only did not end in its time.
    pub unfinished: bool,
    /// Whether the engine's adapter does not pass on what the scene needs.
    pub not_played: bool,
}

impl From<anyhow::Error> for Failure {
    fn from(error: anyhow::Error) -> Self {
        let (unfinished, not_played) = (error.is::<NotFinished>(), error.is::<NotPlayed>());
        Failure { said: format!("{error:#}"), unfinished, not_played }
    }
}

impl Task {
    /// Plays it with a step of `dt_s` within `limit_s` of CPU time, both in s.
    ///
    /// # Errors
    /// No child can be started, which says nothing about the engine. The inner error: the engine or the case fails, or does
    /// not end in its time.
    pub fn play<T>(self, engine: EngineKind, dt_s: f64, limit_s: f64) -> Result<Result<T, Failure>>
    where
        T: DeserializeOwned,
    {
        let [name, settings] = [engine.name(), engine.settings()].map(str::to_owned);
        let request = Request { task: self, engine: name, settings, dt_s, limit_s };
        let answer = match engine.always_returns() {
            true => request.play().map_err(Failure::from),
            false => request.ask()?,
        };
        Ok(match answer {
            Ok(answer) => Ok(serde_json::from_value(answer).context("an answer of another kind")?),
            Err(failure) => Err(failure),
        })
    }
}

impl Request {
    fn play(&self) -> Result<Value> {
        let engine = EngineKind::from_names(&self.engine, Some(&self.settings))?;
        let setup = Setup::new(engine.factory(), self.dt_s);
        limit::within(self.limit_s, || match &self.task {
            Task::Case { name, reference_dt_s, start } => {
                let setup = Setup { reference_dt_s: *reference_dt_s, start: *start, ..setup };
                let (report, _) = cases::run(name, &setup)?;
                Ok(serde_json::to_value(Played::of(report))?)
            }
            Task::Grasp { hand, family, index, aside_um } => {
                let trials = Trial::of(HandKind::from_name(hand)?, Family::from_name(family)?, index + 1)?;
                let mut trial = trials.into_iter().nth(*index).context("the family has no such grasp")?;
                trial.lie.along_m += 1e-6 * aside_um;
                Ok(serde_json::to_value(play(&setup, &trial, |_, _| Ok(()))?)?)
            }
        })
    }

    /// The answer of this thread's child.
    fn ask(&self) -> Result<Result<Value, Failure>> {
        CHILD.with_borrow_mut(|slot| {
            let child = match slot {
                Some(child) => child,
                None => slot.insert(Child::start()?),
            };
            if let Some(answer) = child.ask(self)? {
                return Ok(answer);
            }
            let status = slot.take().map(|mut child| child.process.wait()).transpose()?;
            Ok(Err(match status {
                Some(status) if status.code() == Some(limit::EXIT_CODE) => {
                    anyhow::Error::new(NotFinished { allowed_s: self.limit_s }).into()
                }
                Some(status) => anyhow!("the process ended ({status})").into(),
                None => bail!("the child process has gone"),
            }))
        })
    }
}

thread_local! {
    static CHILD: RefCell<Option<Child>> = const { RefCell::new(None) };
}

struct Child {
    process: std::process::Child,
    to: Option<ChildStdin>,
    from: BufReader<ChildStdout>,
}

impl Child {
    fn start() -> Result<Self> {
        let program = std::env::current_exe().context("the path of this program is unknown")?;
        let is_bench = program.file_stem().is_some_and(|name| name == "palmares-compare");
        ensure!(is_bench, "{} is not palmares-compare, which alone can be its own child", program.display());
        let mut process = Command::new(&program)
            .arg(COMMAND)
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start {}", program.display()))?;
        let to = process.stdin.take();
        let from = BufReader::new(process.stdout.take().context("no pipe from the child process")?);
        Ok(Child { process, to, from })
    }

    /// `None` where the process has ended instead of answering.
    fn ask(&mut self, request: &Request) -> Result<Option<Result<Value, Failure>>> {
        let to = self.to.as_mut().context("no pipe to the child process")?;
        writeln!(to, "{}", serde_json::to_string(request)?)?;
        let mut line = String::new();
        if self.from.read_line(&mut line)? == 0 {
            return Ok(None);
        }
        Ok(Some(serde_json::from_str(&line)?))
    }
}

impl Drop for Child {
    fn drop(&mut self) {
        // The end of its input ends the process.
        drop(self.to.take());
        let _ = self.process.wait();
    }
}

/// A child: plays the requests from its standard input, one a line, and answers with one line each. If a step
/// outlasts its run's limit, it ends with [`limit::EXIT_CODE`].
///
/// # Errors
/// A line is no request, or the parent has gone.
pub fn serve() -> Result<()> {
    limit::enforce();
    let mut out = std::io::stdout();
    for line in std::io::stdin().lock().lines() {
        let request: Request = serde_json::from_str(&line?).context("no request of palmares-compare")?;
        let answer: Result<Value, Failure> = request.play().map_err(Failure::from);
        writeln!(out, "{}", serde_json::to_string(&answer)?)?;
        out.flush()?;
    }
    Ok(())
}
