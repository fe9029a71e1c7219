//! `cargo xtask release`: a version, from its number to the files that are published.

mod artefacts;
mod changelog;
mod command;
mod version;

use crate::workspace;
use anyhow::{Context, Result, ensure};
use clap::Args;
use command::git;
use std::process::Command;
use std::time::Instant;
use version::Version;

/// Changed files in an error.
const SHOWN: usize = 10;

#[derive(Args)]
#[command(after_help = AFTER_HELP)]
pub(crate) struct ReleaseOptions {
    /// The new version, as in 0.2.0
    version: Version,
    /// Check everything and print each change; write nothing
    #[arg(long)]
    dry_run: bool,
}

const AFTER_HELP: &str = "\
1. Writes the version into all files that name it, moves \"Unreleased\" of CHANGELOG.md into its section, and commits both.
2. Builds wheel, source distribution, program, bill of materials, notes and checksums into target/release-X.Y.Z.
3. Checks them: glibc, a demo with the installed wheel, the sources that the source distribution contains.

It publishes nothing, and prints the commands that do. After a failure, run it again: it continues, and keeps the files that
are complete. It runs on Linux x86-64, needs git, tar, Python 3.11 and the network, and installs the other tools into client-py/.venv.";

/// Makes a release.
pub(crate) fn run(options: &ReleaseOptions) -> Result<()> {
    let begun = Instant::now();
    let wanted = options.version;
    ensure!(
        cfg!(all(target_os = "linux", target_arch = "x86_64")),
        "a release is built on Linux x86-64; .github/workflows/release.yml builds the wheels of other systems"
    );
    for (tool, package) in [("git", "git"), ("tar", "tar")] {
        let there = Command::new(tool).arg("--version").output().is_ok_and(|output| output.status.success());
        ensure!(there, "`{tool}` is missing; install it (Debian, Ubuntu: apt install {package})");
    }
    crate::python::interpreter()?;
    let dirty = git(&["status", "--porcelain"])?;
    let shown: Vec<&str> = dirty.lines().take(SHOWN).collect();
    ensure!(
        dirty.is_empty(),
        "commit or remove {} changed files first, so that the release is a commit:\n{}",
        dirty.lines().count(),
        shown.join("\n")
    );

    let current = version::current()?;
    let path = workspace::root().join("CHANGELOG.md");
    let log = std::fs::read_to_string(&path).context("CHANGELOG.md")?;
    if current == wanted && changelog::section(&log, wanted).is_some() {
        println!("version {wanted} is committed; its files follow");
    } else {
        version::check_order(current, wanted)?;
        let now = jiff::Timestamp::now().to_string();
        let released = changelog::released(&log, wanted, now.get(..10).context("no date")?)?;
        let mut files = version::changed(current, wanted)?;
        files.push(("CHANGELOG.md", released));
        for (path, text) in &files {
            println!(
                "{path}: {}",
                first_changed(&std::fs::read_to_string(workspace::root().join(path))?, text)
            );
        }
        if !options.dry_run {
            version::write(&files)?;
            commit(wanted)?;
        }
    }
    let artefacts = artefacts::Artefacts::new(wanted, options.dry_run)?;
    if options.dry_run {
        println!("would build in {}:", artefacts.folder().display());
        artefacts.names().iter().for_each(|name| println!("  {name}"));
        println!("nothing was written");
        return Ok(());
    }
    let text = std::fs::read_to_string(&path).context("CHANGELOG.md")?;
    let section = changelog::section(&text, wanted).context("CHANGELOG.md lost its section")?;
    artefacts.build(section)?;
    println!("\nall in {:.0} s, in {}", begun.elapsed().as_secs_f64(), artefacts.folder().display());
    println!("to publish:\n  git tag -a v{wanted} -m 'Palmares {wanted}' && git push origin HEAD v{wanted}");
    println!("the pushed tag starts .github/workflows/release.yml, which builds again and uploads a draft");
    Ok(())
}

/// The first line that differs, in its new form.
fn first_changed<'a>(before: &str, after: &'a str) -> &'a str {
    let changed = after.lines().zip(before.lines()).find(|(after, before)| after != before);
    changed.map_or("no change", |(after, _)| if after.is_empty() { "a new section" } else { after.trim() })
}

fn commit(version: Version) -> Result<()> {
    git(&["commit", "--quiet", "--all", "--message", &format!("Version {version}")])?;
    println!("committed as {}", git(&["rev-parse", "--short=12", "HEAD"])?);
    Ok(())
}
