//! The Python process in which an engine steps. It talks in frames of floats.

use anyhow::{Context, Result, bail};
use palmares_bench::engine::limit::{self, NotFinished};
use palmares_models::Vec3;
use palmares_sim::{ContactForce, Owner};
use std::cell::RefCell;
use std::io::{BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, ExitStatus, Stdio};
use std::rc::Rc;

/// An engine's program.
#[derive(Clone, Copy)]
pub(super) struct Program {
    /// The engine, as its authors write it.
    pub engine: &'static str,
    /// The environment variable that names its interpreter.
    pub python: &'static str,
    /// Its text.
    pub text: &'static str,
    /// The text of a program that prints the engine's version.
    pub version: &'static str,
}

impl Program {
    /// The interpreter: that of its environment variable, or `python3`.
    pub(super) fn interpreter(&self) -> String {
        std::env::var(self.python).unwrap_or_else(|_| "python3".into())
    }

    /// The installed version of the engine.
    ///
    /// # Errors
    /// No such interpreter, or it has no package of the engine.
    pub(super) fn version(&self) -> Result<String> {
        let python = self.interpreter();
        let output = Command::new(&python)
            .args(["-c", self.version])
            .stderr(Stdio::null())
            .output()
            .with_context(|| format!("cannot start `{python}`"))?;
        if !output.status.success() {
            bail!("`{python}` has no package {}", self.engine.to_lowercase());
        }
        Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
    }
}

thread_local! {
    static STARTED: RefCell<Option<Vec<SharedWorker>>> = const { RefCell::new(None) };
}

/// A process that a [`Recording`] may have, too.
pub(super) type SharedWorker = Rc<RefCell<Worker>>;

/// A process, which the present recording keeps.
pub(super) fn shared(worker: Worker) -> SharedWorker {
    let worker = Rc::new(RefCell::new(worker));
    STARTED.with_borrow_mut(|all| all.iter_mut().for_each(|all| all.push(Rc::clone(&worker))));
    worker
}

/// The scenes that a process has played in a case, to be played again in a tight loop of its own: a process that
/// waits for requests has cold caches, which would count against its engine.
pub struct Recording(Vec<SharedWorker>);

impl Recording {
    /// Runs a case and keeps its scenes.
    pub fn of<T>(case: impl FnOnce() -> T) -> (T, Self) {
        STARTED.set(Some(Vec::new()));
        let outcome = case();
        (outcome, Recording(STARTED.take().unwrap_or_default()))
    }

    /// Plays all scenes again, each for at most `longest_s` of CPU time. CPU time per step, s, averaged by their steps: all
    /// of it, and that of the same steps without the parts that other engines do not have.
    ///
    /// # Errors
    /// The process has stopped.
    pub fn replay(&mut self, longest_s: f64) -> Result<f64> {
        let (mut sum, mut steps) = (0.0, 0);
        for worker in &self.0 {
            let mut worker = worker.borrow_mut();
            sum += worker.steps as f64 * worker.replay(longest_s)?;
            steps += worker.steps;
        }
        Ok(sum / steps.max(1) as f64)
    }
}

/// A running process with one model.
pub(super) struct Worker {
    engine: &'static str,
    child: Child,
    to: Option<ChildStdin>,
    from: BufReader<ChildStdout>,
    /// Numbers of positions, velocities and controls.
    pub sizes: [usize; 3],
    /// Steps until now.
    pub steps: u64,
}

/// Numbers of the names of both shapes, place, normal from the first to the second, force on the second, gap.
type Touch = [f64; TOUCH];
const TOUCH: usize = 12;

/// The answer to a step.
pub(super) struct Frame {
    pub spent_s: f64,
    pub overlap_m: f64,
    pub warnings: u64,
    /// Positions, velocities, forces of controls.
    pub numbers: Vec<f64>,
}

impl Worker {
    /// Starts an engine with a scene.
    pub(super) fn start(program: &Program, document: &str) -> Result<Self> {
        let (engine, python) = (program.engine, program.interpreter());
        let mut child = Command::new(&python)
            .args(["-c", program.text])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start `{python}`"))?;
        let mut to = child.stdin.take().with_context(|| format!("no pipe to {engine}"))?;
        let from = BufReader::new(child.stdout.take().with_context(|| format!("no pipe from {engine}"))?);
        to.write_all(&(document.len() as u64).to_le_bytes())?;
        to.write_all(document.as_bytes())?;
        to.flush()?;
        let mut worker = Worker { engine, child, to: Some(to), from, sizes: [0; 3], steps: 0 };
        let fine = worker.read(1)?[0];
        if fine != 1.0 {
            let length = worker.read(1)?[0];
            let mut message = vec![0; length as usize];
            worker.from.read_exact(&mut message)?;
            bail!("{engine} refuses the scene: {}", String::from_utf8_lossy(&message));
        }
        let sizes = worker.read(3)?;
        worker.sizes = [sizes[0] as usize, sizes[1] as usize, sizes[2] as usize];
        Ok(worker)
    }

    pub(super) fn push(&mut self, q: &[f64], v: &[f64]) -> Result<()> {
        self.write(b'P', &[q, v])
    }

    pub(super) fn step(&mut self, control: &[f64]) -> Result<Frame> {
        self.write(b'S', &[control])?;
        self.steps += 1;
        let [nq, nv, nu] = self.sizes;
        let mut numbers = self.read(3 + nq + nv + nu)?;
        let rest = numbers.split_off(3);
        Ok(Frame { spent_s: numbers[0], overlap_m: numbers[1], warnings: numbers[2] as u64, numbers: rest })
    }

    /// Contacts of the last step. `owners` are those of the shapes, by number.
    pub(super) fn contacts(&mut self, owners: &[Owner]) -> Result<Vec<ContactForce>> {
        self.write(b'C', &[])?;
        let count = self.read(1)?[0] as usize;
        let numbers = self.read(TOUCH * count)?;
        let touches = numbers.chunks_exact(TOUCH).filter_map(|it| it.try_into().ok());
        touches.map(|touch: Touch| self.force(&touch, owners)).collect()
    }

    fn force(&self, touch: &Touch, owners: &[Owner]) -> Result<ContactForce> {
        let owner = |number: f64| {
            let known = owners.get(number as usize).copied();
            known.with_context(|| format!("{} reported a shape that the scene does not have", self.engine))
        };
        let vector = |at: usize| Vec3::new(touch[at], touch[at + 1], touch[at + 2]);
        Ok(ContactForce {
            a: owner(touch[0])?,
            b: owner(touch[1])?,
            colliders: (touch[0] as u32, touch[1] as u32),
            position: vector(2),
            friction_at: vector(2),
            normal: vector(5),
            force: vector(8),
            torque: Vec3::ZERO,
            distance: touch[11],
        })
    }

    /// CPU time per step, s, of a run of all steps until now, of at most `longest_s`: all of it, and without the parts that
    /// other engines do not have.
    pub(super) fn replay(&mut self, longest_s: f64) -> Result<f64> {
        self.write(b'R', &[&[longest_s]])?;
        Ok(self.read(1)?[0])
    }

    /// Sends a request.
    pub(super) fn write(&mut self, op: u8, parts: &[&[f64]]) -> Result<()> {
        let mut frame = vec![op];
        frame.extend(parts.iter().copied().flatten().flat_map(|x| x.to_le_bytes()));
        let engine = self.engine;
        let to = self.to.as_mut().with_context(|| format!("{engine} has been stopped"))?;
        to.write_all(&frame).and_then(|()| to.flush()).with_context(|| format!("{engine} has stopped"))
    }

    fn read(&mut self, count: usize) -> Result<Vec<f64>> {
        let mut bytes = vec![0; 8 * count];
        if let Err(error) = self.from.read_exact(&mut bytes) {
            drop(self.to.take());
            if self.child.wait().is_ok_and(|status| out_of_time(&status)) {
                return Err(NotFinished { allowed_s: limit::allowed_s().unwrap_or_default() }.into());
            }
            return Err(error).with_context(|| format!("{} has stopped; see its message above", self.engine));
        }
        let number = |chunk: &[u8]| {
            let mut number = [0; 8];
            number.copy_from_slice(chunk);
            f64::from_le_bytes(number)
        };
        Ok(bytes.chunks_exact(8).map(number).collect())
    }
}

/// Whether a process ended because it used more CPU time than it allowed itself.
fn out_of_time(status: &ExitStatus) -> bool {
    #[cfg(unix)]
    {
        /// SIGXCPU, on Linux and macOS.
        const OUT_OF_TIME: i32 = 24;
        std::os::unix::process::ExitStatusExt::signal(status) == Some(OUT_OF_TIME)
    }
    #[cfg(not(unix))]
    {
        let _ = status;
        false
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // The end of its input ends the process.
        drop(self.to.take());
        let _ = self.child.wait();
    }
}
