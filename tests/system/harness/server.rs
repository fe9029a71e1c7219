//! The real program in a process of its own.

use std::io::{BufRead, BufReader, Read};
use std::path::{Path, PathBuf};
use std::process::{Child, Command, ExitStatus, Stdio};
use std::sync::OnceLock;
use tempfile::TempDir;

/// The program under test: that of PALMARES_SERVER_BIN or, without it, a build by the same cargo, profile and target
/// directory as the tests.
pub(crate) fn program() -> &'static Path {
    static PROGRAM: OnceLock<Result<PathBuf, String>> = OnceLock::new();
    // The failure is kept as well: one failed build is enough.
    match PROGRAM.get_or_init(build) {
        Ok(program) => program,
        Err(why) => panic!("palmares does not build: {why}"),
    }
}

fn build() -> Result<PathBuf, String> {
    if let Some(program) = std::env::var_os("PALMARES_SERVER_BIN") {
        return Ok(program.into());
    }
    let own = std::env::current_exe().map_err(|error| error.to_string())?;
    // target/<profile>/deps/system-…
    let profile = own.parent().and_then(Path::parent).ok_or("no profile directory")?;
    let target = profile.parent().ok_or("no target directory")?;
    let mut build = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    build.args(["build", "--quiet", "--package", "palmares", "--bin", "palmares"]);
    build.arg("--manifest-path").arg(concat!(env!("CARGO_MANIFEST_DIR"), "/../Cargo.toml"));
    build.arg("--target-dir").arg(target);
    if profile.ends_with("release") {
        build.arg("--release");
    }
    match build.status() {
        Ok(status) if status.success() => {
            Ok(profile.join(format!("palmares{}", std::env::consts::EXE_SUFFIX)))
        }
        Ok(status) => Err(status.to_string()),
        Err(error) => Err(error.to_string()),
    }
}

/// A running server. Dropping it kills it.
pub(crate) struct Server {
    child: Child,
    /// `127.0.0.1:43211`
    address: String,
    folder: TempDir,
    log: Option<std::thread::JoinHandle<String>>,
}

impl Server {
    /// A server with an empty data directory.
    pub(crate) fn start() -> Self {
        Self::start_with(&[])
    }

    /// The same with more arguments.
    pub(crate) fn start_with(arguments: &[&str]) -> Self {
        Self::start_in(TempDir::new().expect("temporary directory"), arguments)
    }

    /// A server on a data directory that exists.
    pub(crate) fn start_in(folder: TempDir, arguments: &[&str]) -> Self {
        Self::spawn(Command::new(program()), folder, arguments)
    }

    /// The same with more environment variables.
    pub(crate) fn start_in_environment(folder: TempDir, arguments: &[&str], more: &[(&str, &str)]) -> Self {
        let mut command = Command::new(program());
        command.envs(more.iter().copied());
        Self::spawn(command, folder, arguments)
    }

    /// A server that a shell starts after another command: `ulimit -n 64`.
    pub(crate) fn start_limited(before: &str) -> Self {
        let mut shell = Command::new("sh");
        shell.arg("-c").arg(format!("{before} && exec \"$0\" \"$@\"")).arg(program());
        Self::spawn(shell, TempDir::new().expect("temporary directory"), &[])
    }

    fn spawn(mut command: Command, folder: TempDir, arguments: &[&str]) -> Self {
        let listen = if arguments.contains(&"--listen") { &[][..] } else { &["--listen", "127.0.0.1:0"] };
        let mut child = command
            .arg("serve")
            .args(listen)
            .arg("--data-dir")
            .arg(folder.path())
            .args(arguments)
            .env_remove("DATABASE_URL")
            .env("RUST_LOG", "palmares=debug")
            .stdin(Stdio::null())
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .expect("palmares starts");
        // Read all the time: a full pipe would stop the server.
        let mut stderr = child.stderr.take().expect("piped");
        let log = std::thread::spawn(move || {
            let mut text = String::new();
            let _ = stderr.read_to_string(&mut text);
            text
        });
        let mut line = String::new();
        BufReader::new(child.stdout.take().expect("piped")).read_line(&mut line).expect("stdout");
        let Some(address) = line.trim().strip_prefix("listening on http://").map(str::to_owned) else {
            let _ = child.kill();
            panic!("no address, but {line:?}; it said:\n{}", log.join().unwrap_or_default());
        };
        Server { child, address, folder, log: Some(log) }
    }

    /// Its address: `127.0.0.1:43211`.
    pub(crate) fn address(&self) -> &str {
        &self.address
    }

    /// Its database file.
    pub(crate) fn database(&self) -> PathBuf {
        self.folder.path().join("palmares.sqlite")
    }

    /// Its data directory.
    pub(crate) fn folder(&self) -> &Path {
        self.folder.path()
    }

    /// The most memory that it has held at once, MiB; none where the system has no `/proc`.
    pub(crate) fn most_memory_mib(&self) -> Option<u64> {
        let status = std::fs::read_to_string(format!("/proc/{}/status", self.child.id())).ok()?;
        let line = status.lines().find_map(|line| line.strip_prefix("VmHWM:"))?;
        Some(line.trim().strip_suffix("kB")?.trim().parse::<u64>().ok()? / 1024)
    }

    /// SIGKILL: no goodbye of any kind. Returns the data directory.
    pub(crate) fn kill(mut self) -> TempDir {
        self.child.kill().expect("kill");
        self.child.wait().expect("wait");
        self.take_folder()
    }

    /// Sends a signal by name.
    pub(crate) fn signal(&self, name: &str) {
        let status = Command::new("kill").args([&format!("-{name}"), &self.child.id().to_string()]).status();
        assert!(status.expect("kill runs").success());
    }

    /// Waits for the end after a signal. Returns how it ended, its log and the data directory.
    pub(crate) fn wait(mut self) -> (ExitStatus, String, TempDir) {
        let status = self.child.wait().expect("wait");
        let log = self.log.take().map(|log| log.join().expect("log")).unwrap_or_default();
        (status, log, self.take_folder())
    }

    fn take_folder(&mut self) -> TempDir {
        std::mem::replace(&mut self.folder, TempDir::new().expect("temporary directory"))
    }
}

impl Drop for Server {
    fn drop(&mut self) {
        let _ = self.child.kill();
        let _ = self.child.wait();
        // Shown only when the test fails.
        if let Some(Ok(log)) = self.log.take().map(std::thread::JoinHandle::join) {
            println!("--- the server's log\n{log}");
        }
    }
}
