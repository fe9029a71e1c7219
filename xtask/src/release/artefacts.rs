//! The files of a release: built, then checked as a user would.

use super::command::{git, output};
use super::version::Version;
use crate::cargo::cargo;
use crate::python::{Environment, project};
use crate::{viewer, wheel, workspace};
use anyhow::{Context, Result, ensure};
use sha2::{Digest, Sha256};
use std::fs;
use std::path::{Path, PathBuf};
use std::process::Command;
use std::time::Instant;

/// The system that wheel and program are built for.
const TARGET: &str = "x86_64-unknown-linux-gnu";
/// The oldest glibc that both run with: that of RHEL 8 and Debian 10; RHEL 9 has 2.34.
const GLIBC: (u32, u32) = (2, 28);

/// Links against an older glibc than this machine's; reads what a wheel needs.
const TOOLS: [&str; 2] = ["ziglang==0.17.1", "auditwheel==6.8.2"];

/// Their folder and their names.
pub(super) struct Artefacts {
    version: Version,
    folder: PathBuf,
}

impl Artefacts {
    /// Empties the folder if its files were built from another commit.
    pub(super) fn new(version: Version, dry_run: bool) -> Result<Self> {
        let folder = workspace::root().join(format!("target/release-{version}"));
        let (stamp, head) = (folder.join(".commit"), git(&["rev-parse", "HEAD"])?);
        if !dry_run && !fs::read_to_string(&stamp).is_ok_and(|made_from| made_from == head) {
            if folder.exists() {
                fs::remove_dir_all(&folder).with_context(|| format!("{}", folder.display()))?;
            }
            fs::create_dir_all(&folder).with_context(|| format!("{}", folder.display()))?;
            fs::write(&stamp, head)?;
        }
        Ok(Artefacts { version, folder })
    }

    pub(super) fn folder(&self) -> &Path {
        &self.folder
    }

    fn wheel(&self) -> String {
        let (major, minor) = GLIBC;
        format!("palmares-{}-cp311-abi3-manylinux_{major}_{minor}_x86_64.whl", self.version)
    }

    fn sdist(&self) -> String {
        format!("palmares-{}.tar.gz", self.version)
    }

    /// The program's folder, and the name of its archive without the end.
    fn program(&self) -> String {
        format!("palmares-{}-linux-x86_64", self.version)
    }

    fn bill(&self) -> String {
        format!("palmares-{}.cdx.json", self.version)
    }

    /// All of them.
    pub(super) fn names(&self) -> [String; 6] {
        let program = format!("{}.tar.gz", self.program());
        [self.wheel(), self.sdist(), program, self.bill(), "SHA256SUMS".into(), "NOTES.md".into()]
    }

    /// Builds the missing files, and checks all of them. `section` is that of the changelog.
    pub(super) fn build(&self, section: &str) -> Result<()> {
        let mut environment = None;
        step("tools", || {
            let made = Environment::prepare()?;
            let mut pip = made.python();
            pip.args(["-m", "pip", "install", "--quiet", "--disable-pip-version-check"]).args(TOOLS);
            output(&mut pip, &project())?;
            environment = Some(made);
            viewer::run()
        })?;
        let environment = environment.context("no Python environment")?;
        step("licences", wheel::write_licences)?;
        let [wheel, sdist, program, bill, sums, notes] = self.names();
        self.make(&sdist, |parts| wheel::maturin(&environment, &["sdist"], parts))?;
        self.make(&wheel, |parts| {
            let manylinux = format!("manylinux_{}_{}", GLIBC.0, GLIBC.1);
            let portable = ["build", "--release", "--locked", "--zig", "--compatibility", &manylinux];
            wheel::maturin(&environment, &[&portable[..], &["--target", TARGET]].concat(), parts)
        })?;
        self.make(&program, |parts| self.build_program(&environment, parts))?;
        self.make(&bill, |parts| {
            let inner = unpacked(&environment, &self.folder.join(&wheel), parts)?;
            let info = inner.join(format!("palmares-{}.dist-info/sboms", self.version));
            let bill_of_wheel = first_file(&info, "json")?;
            Ok(fs::rename(bill_of_wheel, parts.join(&bill)).map(drop)?)
        })?;

        step("check: glibc", || self.check_glibc(&environment))?;
        step("check: sources in the source distribution", || self.check_sdist())?;
        step("check: the program of the archive", || self.check_program())?;
        wheel::try_it(&self.folder.join(&wheel))?;

        let files = [&wheel, &sdist, &program, &bill];
        let mut list = String::new();
        for name in files {
            let digest = Sha256::digest(fs::read(self.folder.join(name))?);
            let digest: String = digest.iter().map(|byte| format!("{byte:02x}")).collect();
            list.push_str(&format!("{digest}  {name}\n"));
        }
        fs::write(self.folder.join(sums), &list)?;
        fs::write(self.folder.join(notes), self.notes(section, &list))?;
        for name in self.names() {
            let bytes = fs::metadata(self.folder.join(&name))?.len();
            println!("{:9.1} kB  {name}", bytes as f64 / 1000.0);
        }
        Ok(())
    }

    /// Makes one file, unless it is there. A file has its name only when it is complete.
    fn make(&self, name: &str, body: impl FnOnce(&Path) -> Result<()>) -> Result<()> {
        let file = self.folder.join(name);
        if file.exists() {
            println!("{name} is there already");
            return Ok(());
        }
        step(name, || {
            let parts = tempfile::tempdir_in(&self.folder).context("cannot make a folder")?;
            body(parts.path())?;
            let made = parts.path().join(name);
            ensure!(made.exists(), "{name} was not made, but {}", names_in(parts.path())?.join(", "));
            Ok(fs::rename(made, &file)?)
        })
    }

    /// The program as maturin builds it, which then looks for libraries that are not on every Linux.
    fn build_program(&self, environment: &Environment, parts: &Path) -> Result<()> {
        let manifest = workspace::root().join("cli/Cargo.toml");
        let manifest = manifest.to_str().context("the path of this repository is not UTF-8")?;
        let manylinux = format!("manylinux_{}_{}", GLIBC.0, GLIBC.1);
        let build =
            ["build", "--release", "--locked", "--zig", "--compatibility", &manylinux, "--target", TARGET];
        let program = ["--manifest-path", manifest, "--bindings", "bin", "--strip"];
        wheel::maturin(environment, &[&build[..], &program[..]].concat(), parts)?;
        let inner = unpacked(environment, &first_file(parts, "whl")?, parts)?;
        let folder = parts.join(self.program());
        fs::create_dir(&folder)?;
        let place = folder.join("palmares");
        fs::rename(inner.join(format!("palmares-{}.data/scripts/palmares", self.version)), &place)?;
        #[cfg(unix)]
        fs::set_permissions(&place, std::os::unix::fs::PermissionsExt::from_mode(0o755))?;
        for name in ["README.md", "CHANGELOG.md"] {
            fs::copy(workspace::root().join(name), folder.join(name)).with_context(|| name.to_owned())?;
        }
        let licences = project().join(wheel::LICENCES);
        for name in names_in(&licences)? {
            fs::copy(licences.join(&name), folder.join(&name))?;
        }
        let time = git(&["show", "--no-patch", "--format=%cI", "HEAD"])?;
        let mut tar = Command::new("tar");
        tar.args(["--create", "--gzip", "--sort=name", "--owner=0", "--group=0", "--numeric-owner"]);
        tar.arg(format!("--mtime={time}"))
            .arg(format!("--file={}.tar.gz", self.program()))
            .arg(self.program());
        output(&mut tar, parts).map(drop)
    }

    fn check_glibc(&self, environment: &Environment) -> Result<()> {
        let wheel = self.folder.join(self.wheel());
        let mut audit = environment.python();
        let found = output(audit.args(["-m", "auditwheel", "show"]).arg(&wheel), &project())?;
        let wanted = format!("manylinux_{}_{}_x86_64", GLIBC.0, GLIBC.1);
        // auditwheel names the most portable tag; an older one than wanted is as good.
        println!(
            "{}",
            found.lines().map(str::trim).filter(|line| !line.is_empty()).collect::<Vec<_>>().join("\n")
        );
        ensure!(found.contains("manylinux"), "auditwheel does not find {wanted} in {}", wheel.display());
        let parts = tempfile::tempdir_in(&self.folder)?;
        let module = unpacked(environment, &wheel, parts.path())?.join("palmares/_native.abi3.so");
        let program = self.unpacked_program(parts.path())?;
        for file in [module, program] {
            let (major, minor) =
                newest_glibc(&fs::read(&file).with_context(|| format!("{}", file.display()))?);
            let name = file.file_name().unwrap_or_default().display();
            println!("{name} needs glibc {major}.{minor}");
            ensure!((major, minor) <= GLIBC, "{name} needs a newer glibc than {}.{}", GLIBC.0, GLIBC.1);
        }
        Ok(())
    }

    /// Unpacks the archive and returns where the program is.
    fn unpacked_program(&self, folder: &Path) -> Result<PathBuf> {
        let archive = self.folder.join(format!("{}.tar.gz", self.program()));
        output(Command::new("tar").arg("--extract").arg("--file").arg(archive), folder)?;
        Ok(folder.join(self.program()).join("palmares"))
    }

    fn check_program(&self) -> Result<()> {
        let parts = tempfile::tempdir_in(&self.folder)?;
        let program = self.unpacked_program(parts.path())?;
        let version = output(Command::new(program).arg("--version"), parts.path())?;
        ensure!(version == format!("palmares {}", self.version), "the program calls itself {version:?}");
        Ok(())
    }

    /// Whether all crates that the Python module is built from are in it. Building it takes minutes: cargo reads it only.
    fn check_sdist(&self) -> Result<()> {
        let parts = tempfile::tempdir_in(&self.folder)?;
        let archive = self.folder.join(self.sdist());
        output(Command::new("tar").arg("--extract").arg("--file").arg(archive), parts.path())?;
        let sources = parts.path().join(format!("palmares-{}", self.version));
        let mut tree = cargo();
        tree.args([
            "tree",
            "--offline",
            "--package",
            "palmares-native",
            "--edges",
            "normal",
            "--prefix",
            "none",
        ]);
        let packages = output(&mut tree, &sources)?;
        let mut own: Vec<&str> = packages.lines().filter(|line| line.contains(" (/")).collect();
        own.sort_unstable();
        own.dedup();
        ensure!(own.iter().any(|line| line.starts_with("palmares-sim ")), "no engine in it:\n{packages}");
        let missing = missing_includes(&sources)?;
        ensure!(missing.is_empty(), "it lacks files that its sources include:\n{}", missing.join("\n"));
        println!("it has the sources of {} crates", own.len());
        Ok(())
    }

    fn notes(&self, section: &str, sums: &str) -> String {
        let (version, wheel, program) = (self.version, self.wheel(), self.program());
        let (major, minor) = GLIBC;
        format!(
            "# Palmares {version}\n\n{section}\n\n## Files\n\n\
             - `{wheel}`: client, engine, program and pages, for Python 3.11 or newer on Linux x86-64 with glibc {major}.{minor} or \
             newer. `pip install {wheel}`, then `palmares demo`.\n\
             - `{program}.tar.gz`: the program alone.\n\
             - `{sdist}`: the sources of the wheel. To build it needs Rust.\n\
             - `{bill}`: all crates of the wheel, as CycloneDX.\n\n```\n{sums}```\n",
            sdist = self.sdist(),
            bill = self.bill()
        )
    }
}

/// Announces a step, runs it and prints its time.
fn step(name: &str, body: impl FnOnce() -> Result<()>) -> Result<()> {
    println!("== {name}");
    let begun = Instant::now();
    body().with_context(|| name.to_owned())?;
    println!("   {:.1} s", begun.elapsed().as_secs_f64());
    Ok(())
}

/// Unpacks a wheel into a folder of its name.
fn unpacked(environment: &Environment, wheel: &Path, folder: &Path) -> Result<PathBuf> {
    let place = folder.join("unpacked");
    output(environment.python().args(["-m", "zipfile", "-e"]).arg(wheel).arg(&place), folder)?;
    Ok(place)
}

fn first_file(folder: &Path, end: &str) -> Result<PathBuf> {
    let names = names_in(folder)?;
    let name = names.iter().find(|name| Path::new(name).extension().is_some_and(|is| is == end));
    Ok(folder.join(name.with_context(|| format!("no .{end} in {}", folder.display()))?))
}

fn names_in(folder: &Path) -> Result<Vec<String>> {
    let entries = fs::read_dir(folder).with_context(|| format!("{}", folder.display()))?;
    let mut names: Vec<String> =
        entries.filter_map(|entry| entry.ok()?.file_name().into_string().ok()).collect();
    names.sort();
    Ok(names)
}

/// Files that sources include at compile time and that are not there. Tests are not compiled from a source distribution.
fn missing_includes(folder: &Path) -> Result<Vec<String>> {
    let mut missing = Vec::new();
    for name in names_in(folder)? {
        let path = folder.join(&name);
        if path.is_dir() && name != "tests" {
            missing.extend(missing_includes(&path)?);
        } else if name.ends_with(".rs") && name != "tests.rs" {
            let text = fs::read_to_string(&path).with_context(|| format!("{}", path.display()))?;
            let compiled = text.split("#[cfg(test)]").next().unwrap_or_default();
            let included = compiled.split("include_").skip(1).filter_map(|rest| {
                let (kind, rest) = rest.split_once("!(\"")?;
                ["str", "bytes"].contains(&kind).then(|| rest.split('"').next().unwrap_or_default())
            });
            missing.extend(
                included.filter(|file| !folder.join(file).exists()).map(|file| format!("{name}: {file}")),
            );
        }
    }
    Ok(missing)
}

/// The newest version of glibc that a program or library names: `GLIBC_2.28`.
fn newest_glibc(bytes: &[u8]) -> (u32, u32) {
    const NAME: &[u8] = b"GLIBC_";
    let names = bytes.windows(NAME.len()).enumerate().filter(|(_, window)| *window == NAME);
    let versions = names.filter_map(|(at, _)| {
        let rest = bytes.get(at + NAME.len()..)?;
        let end = rest.iter().position(|byte| !byte.is_ascii_digit() && *byte != b'.')?;
        let mut numbers = std::str::from_utf8(&rest[..end]).ok()?.split('.').map(str::parse);
        Some((numbers.next()?.ok()?, numbers.next()?.ok()?))
    });
    versions.max().unwrap_or_default()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_file_that_the_sources_include_is_missed() {
        let folder = tempfile::tempdir().expect("a folder");
        let text = "const A: &str = include_str!(\"../a.txt\");\n#[cfg(test)]\nconst B: &str = include_str!(\"b.txt\");\n";
        fs::create_dir(folder.path().join("src")).expect("a folder");
        fs::write(folder.path().join("src/lib.rs"), text).expect("a file");
        assert_eq!(missing_includes(folder.path()).expect("read"), ["lib.rs: ../a.txt"]);
        fs::write(folder.path().join("a.txt"), "").expect("a file");
        assert!(missing_includes(folder.path()).expect("read").is_empty());
    }

    #[test]
    fn the_newest_glibc_is_found() {
        let bytes = b"\0GLIBC_2.9\0GLIBC_2.28\0GLIBC_2.2.5\0GLIBC_PRIVATE\0GLIBC_ABI_DT_RELR\0";
        assert_eq!(newest_glibc(bytes), (2, 28));
        assert_eq!(newest_glibc(b"static"), (0, 0));
    }
}
