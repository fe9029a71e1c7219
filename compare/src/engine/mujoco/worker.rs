//! The Python process that steps MuJoCo.

use anyhow::{Context, Result, bail};
use palmares_sim::Push;
use std::io::{BufReader, Read, Write};
use std::process::{Child, ChildStdin, ChildStdout, Command, Stdio};

const PROGRAM: &str = include_str!("../../../python/mujoco_worker.py");

/// The interpreter: the environment variable `PALMARES_MUJOCO_PYTHON`, or `python3`.
pub fn python() -> String {
    std::env::var("PALMARES_MUJOCO_PYTHON").unwrap_or_else(|_| "python3".into())
}

/// The installed version of MuJoCo.
///
/// # Errors
/// No such interpreter, or it has no package `mujoco`.
pub fn version() -> Result<String> {
    let output = Command::new(python())
        .args(["-c", "import mujoco, numpy; print(mujoco.__version__)"])
        .stderr(Stdio::null())
        .output()
        .with_context(|| format!("cannot start `{}`", python()))?;
    if !output.status.success() {
        bail!("`{}` has no package mujoco", python());
    }
    Ok(String::from_utf8_lossy(&output.stdout).trim().to_owned())
}

/// A running process with one model.
pub(super) struct Worker {
    child: Child,
    to: Option<ChildStdin>,
    from: BufReader<ChildStdout>,
    /// nq, nv, nu.
    pub sizes: [usize; 3],
    /// Steps until now.
    pub steps: u64,
}

/// Numbers of the names of both shapes, place, normal from the first to the second, force on the second, gap.
pub(super) type Touch = [f64; TOUCH];
const TOUCH: usize = 12;

/// The answer to a step.
pub(super) struct Frame {
    pub spent_s: f64,
    pub overlap_m: f64,
    pub warnings: u64,
    /// qpos, qvel, actuator forces.
    pub numbers: Vec<f64>,
}

impl Worker {
    pub(super) fn start(document: &str) -> Result<Self> {
        let mut child = Command::new(python())
            .args(["-c", PROGRAM])
            .stdin(Stdio::piped())
            .stdout(Stdio::piped())
            .spawn()
            .with_context(|| format!("cannot start `{}`", python()))?;
        let mut to = child.stdin.take().context("no pipe to MuJoCo")?;
        let from = BufReader::new(child.stdout.take().context("no pipe from MuJoCo")?);
        to.write_all(&(document.len() as u64).to_le_bytes())?;
        to.write_all(document.as_bytes())?;
        to.flush()?;
        let mut worker = Worker { child, to: Some(to), from, sizes: [0; 3], steps: 0 };
        let fine = worker.read(1)?[0];
        if fine != 1.0 {
            let length = worker.read(1)?[0];
            let mut message = vec![0; length as usize];
            worker.from.read_exact(&mut message)?;
            bail!("MuJoCo refuses the scene: {}", String::from_utf8_lossy(&message));
        }
        let sizes = worker.read(3)?;
        worker.sizes = [sizes[0] as usize, sizes[1] as usize, sizes[2] as usize];
        Ok(worker)
    }

    pub(super) fn push(&mut self, q: &[f64], v: &[f64]) -> Result<()> {
        self.write(b'P', &[q, v])
    }

    /// Turns the base servo on or off for the steps that follow.
    pub(super) fn servo(&mut self, on: bool) -> Result<()> {
        self.write(b'B', &[&[f64::from(u8::from(on))]])
    }

    /// The forces on the hand from outside in the steps that follow.
    pub(super) fn forces(&mut self, pushes: &[Push]) -> Result<()> {
        let row = |push: &Push| {
            let [point, force] = [push.point, push.force].map(|vector| vector.to_array());
            [vec![push.link as f64], point.to_vec(), force.to_vec()].concat()
        };
        let rows: Vec<f64> = pushes.iter().flat_map(row).collect();
        self.write(b'F', &[&[pushes.len() as f64], &rows])
    }

    pub(super) fn step(&mut self, control: &[f64]) -> Result<Frame> {
        self.write(b'S', &[control])?;
        self.steps += 1;
        let [nq, nv, nu] = self.sizes;
        let mut numbers = self.read(3 + nq + nv + nu)?;
        let rest = numbers.split_off(3);
        Ok(Frame { spent_s: numbers[0], overlap_m: numbers[1], warnings: numbers[2] as u64, numbers: rest })
    }

    /// Contacts of the last step, each as a [`Touch`].
    pub(super) fn contacts(&mut self) -> Result<Vec<Touch>> {
        self.write(b'C', &[])?;
        let count = self.read(1)?[0] as usize;
        let numbers = self.read(TOUCH * count)?;
        Ok(numbers.chunks_exact(TOUCH).filter_map(|it| it.try_into().ok()).collect())
    }

    /// CPU time per step, s, of a run of all steps until now, of at most `longest_s`: all of it, and without the parts that
    /// other engines do not have.
    pub(super) fn replay(&mut self, longest_s: f64) -> Result<[f64; 2]> {
        self.write(b'R', &[&[longest_s]])?;
        let spent = self.read(2)?;
        Ok([spent[0], spent[1]])
    }

    fn write(&mut self, op: u8, parts: &[&[f64]]) -> Result<()> {
        let mut frame = vec![op];
        frame.extend(parts.iter().copied().flatten().flat_map(|x| x.to_le_bytes()));
        let to = self.to.as_mut().context("MuJoCo has been stopped")?;
        to.write_all(&frame).and_then(|()| to.flush()).context("MuJoCo has stopped")
    }

    fn read(&mut self, count: usize) -> Result<Vec<f64>> {
        let mut bytes = vec![0; 8 * count];
        self.from.read_exact(&mut bytes).context("MuJoCo has stopped; see its message above")?;
        let number = |chunk: &[u8]| {
            let mut number = [0; 8];
            number.copy_from_slice(chunk);
            f64::from_le_bytes(number)
        };
        Ok(bytes.chunks_exact(8).map(number).collect())
    }
}

impl Drop for Worker {
    fn drop(&mut self) {
        // The end of its input ends the process.
        drop(self.to.take());
        let _ = self.child.wait();
    }
}
