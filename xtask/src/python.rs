//! The Python environment of the client, in `client-py/.venv`.

use crate::workspace;
use anyhow::{Context, Result, bail, ensure};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};

/// A virtual environment with the client and its tools installed.
pub(crate) struct Environment {
    bin: PathBuf,
}

impl Environment {
    /// Makes the environment, or takes the existing one if `pyproject.toml` has not changed since.
    pub(crate) fn prepare() -> Result<Self> {
        let project = project();
        let venv = project.join(".venv");
        let environment = Environment { bin: venv.join(if cfg!(windows) { "Scripts" } else { "bin" }) };

        let wanted =
            fs::read_to_string(project.join("pyproject.toml")).context("client-py/pyproject.toml")?;
        let stamp = venv.join("installed-from.toml");
        let usable = fs::read_to_string(&stamp).is_ok_and(|made_for| made_for == wanted)
            && succeeds(environment.python().args(["-c", "import palmares"]));
        if usable {
            return Ok(environment);
        }
        let python = interpreter()?;
        if !succeeds(environment.python().args(["-m", "pip", "--version"])) {
            create(&python, &venv)?;
        }
        let mut pip = environment.python();
        pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(needed(&wanted)?);
        // The caller reads the standard output of this program.
        let status = pip.stdout(Stdio::null()).status().context("cannot start pip")?;
        ensure!(
            status.success(),
            "pip could not install what the Python client needs (see above); \
             it needs to reach a package index once"
        );
        environment.link(&project.join("src"))?;
        fs::write(&stamp, wanted)?;
        Ok(environment)
    }

    /// Lets it import the packages in `folder` from there.
    fn link(&self, folder: &Path) -> Result<()> {
        let where_to = "import sysconfig; print(sysconfig.get_path('purelib'), end='')";
        let output = self.python().args(["-c", where_to]).output().context("cannot start Python")?;
        let packages = PathBuf::from(String::from_utf8(output.stdout).context("Python's path of packages")?);
        fs::write(packages.join("palmares.pth"), format!("{}\n", folder.display()))
            .with_context(|| format!("{}", packages.display()))
    }

    /// The folder of its programs.
    pub(crate) fn folder(&self) -> &Path {
        &self.bin
    }

    /// One of its programs, started in `client-py/`.
    pub(crate) fn tool(&self, name: &str) -> Command {
        let mut command = Command::new(self.bin.join(name));
        command.current_dir(project());
        command
    }

    /// The environment's interpreter, started in `client-py/`.
    pub(crate) fn python(&self) -> Command {
        let mut command = Command::new(self.interpreter());
        command.current_dir(project());
        command
    }

    /// The environment's interpreter.
    pub(crate) fn interpreter(&self) -> PathBuf {
        self.bin.join(if cfg!(windows) { "python.exe" } else { "python" })
    }
}

/// Packages that `pyproject.toml` names, those of the tools too. The package itself is not installed: its compiled part
/// is built by cargo alone, where it is needed.
fn needed(pyproject: &str) -> Result<Vec<String>> {
    let project: toml::Table = pyproject.parse().context("client-py/pyproject.toml")?;
    let project = project.get("project").context("client-py/pyproject.toml: no `project`")?;
    let lists =
        [project.get("dependencies"), project.get("optional-dependencies").and_then(|all| all.get("dev"))];
    let packages = lists.into_iter().flatten().filter_map(toml::Value::as_array).flatten();
    Ok(packages.filter_map(|name| name.as_str().map(str::to_owned)).collect())
}

/// The folder of the Python client.
pub(crate) fn project() -> PathBuf {
    workspace::root().join("client-py")
}

/// A Python of at least 3.11.
pub(crate) fn interpreter() -> Result<String> {
    let named = std::env::var("PALMARES_PYTHON").ok();
    let usual = ["python3", "python3.14", "python3.13", "python3.12", "python3.11", "python"];
    let candidates: Vec<&str> = named.as_deref().map_or_else(|| usual.to_vec(), |name| vec![name]);
    let recent = "import sys; sys.exit(sys.version_info < (3, 11))";
    for name in &candidates {
        if succeeds(Command::new(name).args(["-c", recent])) {
            return Ok((*name).to_owned());
        }
    }
    bail!(
        "no Python 3.11 or newer found (tried {}). Install it (Debian, Ubuntu: apt install python3 python3-venv), \
         or name one in the environment variable PALMARES_PYTHON",
        candidates.join(", ")
    )
}

/// Creates a virtual environment. Debian ships Python without ensurepip.
pub(crate) fn create(python: &str, venv: &Path) -> Result<()> {
    if succeeds(Command::new(python).args(["-m", "venv", "--clear"]).arg(venv)) {
        return Ok(());
    }
    if succeeds(Command::new(python).args(["-m", "virtualenv", "--clear"]).arg(venv)) {
        return Ok(());
    }
    let version = Command::new(python)
        .args(["-c", "import sys; print('%d.%d' % sys.version_info[:2])"])
        .output()
        .map(|output| String::from_utf8_lossy(&output.stdout).trim().to_owned())
        .unwrap_or_else(|_| "3".to_owned());
    bail!(
        "`{python} -m venv` failed: this Python comes without ensurepip. On Debian and Ubuntu install it with \
         `apt install python{version}-venv`; elsewhere `{python} -m pip install virtualenv` helps"
    )
}

/// Whether a command runs and exits with 0. Its output is dropped.
pub(crate) fn succeeds(command: &mut Command) -> bool {
    command
        .stdin(Stdio::null())
        .stdout(Stdio::null())
        .stderr(Stdio::null())
        .status()
        .is_ok_and(|status| status.success())
}
