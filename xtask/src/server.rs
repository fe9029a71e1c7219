//! A server started for a demonstration, and stopped when it is over.

use anyhow::{Context, Result, bail};
use serde_json::Value;
use std::fs::{self, File};
use std::io::{BufRead, BufReader, Read, Write};
use std::net::TcpStream;
use std::path::Path;
use std::process::{Child, ChildStdout, Command, Stdio};
use std::thread::sleep;
use std::time::{Duration, Instant};

const STOP_WITHIN: Duration = Duration::from_secs(40);

/// A running `palmares serve`. Dropping it kills it; [`Server::stop`] lets it finish its work first.
pub(crate) struct Server {
    child: Child,
    /// Kept open: a server whose standard output is closed could fail at its next line.
    _stdout: BufReader<ChildStdout>,
    address: String,
}

impl Server {
    /// Starts the program on a free port with its files in `directory`, and waits until it listens.
    pub(crate) fn start(program: &Path, directory: &Path) -> Result<Self> {
        let log_path = directory.join("server.log");
        let log = File::create(&log_path).with_context(|| format!("cannot write {}", log_path.display()))?;
        let mut child = Command::new(program)
            .args(["serve", "--listen", "127.0.0.1:0", "--data-dir"])
            .arg(directory)
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(log)
            .spawn()
            .with_context(|| format!("cannot start {}", program.display()))?;
        let mut stdout = BufReader::new(child.stdout.take().context("the server has no standard output")?);
        let mut line = String::new();
        stdout.read_line(&mut line)?;
        let Some(address) = line.trim().strip_prefix("listening on http://") else {
            let _ = child.kill();
            let _ = child.wait();
            let said = fs::read_to_string(&log_path).unwrap_or_default();
            bail!("the server did not start; it said:\n{line}{said}");
        };
        Ok(Server { child, _stdout: stdout, address: address.to_owned() })
    }

    /// Where it listens: `http://127.0.0.1:40123`.
    pub(crate) fn url(&self) -> String {
        format!("http://{}", self.address)
    }

    /// The JSON found at a path.
    pub(crate) fn get_json(&self, path: &str) -> Result<Value> {
        let body = get(&self.address, path)?;
        serde_json::from_str(&body).with_context(|| format!("{path} did not answer with JSON: {body}"))
    }

    /// Asks the server to end (SIGTERM) and waits; kills it when it does not.
    pub(crate) fn stop(mut self) -> Result<()> {
        if cfg!(unix) {
            // std can only kill, and a dependency for one signal is not worth it.
            let _ = Command::new("kill").args(["-TERM", &self.child.id().to_string()]).status();
            let start = Instant::now();
            while start.elapsed() < STOP_WITHIN {
                match self.child.try_wait()? {
                    Some(status) if status.success() => return Ok(()),
                    Some(status) => bail!("the server ended with {status}"),
                    None => sleep(Duration::from_millis(20)),
                }
            }
            bail!("the server did not end within {STOP_WITHIN:?} of SIGTERM and was killed");
        }
        Ok(())
    }
}

/// A GET by hand: HTTP/1.0 means that the answer ends where the connection does.
pub(crate) fn get(address: &str, path: &str) -> Result<String> {
    let mut stream = TcpStream::connect(address)?;
    stream.set_read_timeout(Some(Duration::from_secs(10)))?;
    write!(stream, "GET {path} HTTP/1.0\r\nHost: {address}\r\n\r\n")?;
    let mut answer = String::new();
    stream.read_to_string(&mut answer)?;
    let (head, body) = answer.split_once("\r\n\r\n").context("not an HTTP answer")?;
    let status = head.lines().next().unwrap_or_default();
    if status.split(' ').nth(1) != Some("200") {
        bail!("{path} answered {status}");
    }
    Ok(body.to_owned())
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
    }
}
