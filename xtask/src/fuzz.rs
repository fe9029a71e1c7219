//! `cargo xtask fuzz`: libFuzzer on the targets of the crate `fuzz`, and the count of its executions.

use crate::cargo::{artifacts, cargo, executable};
use crate::workspace;
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use serde_json::{Map, Value, json};
use std::collections::BTreeSet;
use std::fs;
use std::io::{BufRead, BufReader};
use std::path::{Path, PathBuf};
use std::process::{Command, Stdio};
use std::time::{Duration, Instant};

/// The executions of all runs, by target.
const COUNTS: &str = "fuzz/executions.json";
/// Time between two lines of progress, and between two updates of the counts.
const SLICE: Duration = Duration::from_secs(60);
/// An execution that takes longer is a fault, s. It is generous for a machine that does other work, too.
const TIMEOUT_S: u32 = 10;
/// Memory above which an execution is a fault, MB.
const MEMORY_MB: u32 = 2048;
/// Largest kept input, bytes.
const KEPT_BYTES: u64 = 16 << 10;

#[derive(Args)]
pub(crate) struct FuzzOptions {
    /// A target, or `all`.
    target: String,
    /// Executions of each target.
    #[arg(long, default_value_t = 100_000)]
    executions: u64,
    /// Longest time for each target, s.
    #[arg(long)]
    seconds: Option<u64>,
    /// Afterwards keep the smallest set of inputs that reach all code reached, in `fuzz/corpus`.
    #[arg(long)]
    keep: bool,
}

/// Fuzzes; whether no fault was found.
pub(crate) fn run(options: &FuzzOptions) -> Result<bool> {
    let root = workspace::root();
    let known = targets(&root)?;
    let chosen: Vec<&String> =
        known.iter().filter(|name| options.target == "all" || **name == options.target).collect();
    if chosen.is_empty() {
        bail!("no target `{}`; there are all, {}", options.target, known.join(", "));
    }
    let program = build(&root)?;
    let mut sound = true;
    for target in chosen {
        let fuzzer = Fuzzer::new(&root, &program, target)?;
        sound &= fuzzer.run(options)?;
        if options.keep {
            fuzzer.keep()?;
        }
    }
    Ok(sound)
}

/// The targets: each has a folder of kept inputs, which a test checks.
fn targets(root: &Path) -> Result<Vec<String>> {
    let entries = fs::read_dir(root.join("fuzz/corpus")).context("fuzz/corpus")?;
    let mut names = entries
        .map(|entry| Ok(entry?.file_name().to_string_lossy().into_owned()))
        .collect::<std::io::Result<Vec<String>>>()?;
    names.sort();
    Ok(names)
}

/// Builds the fuzzer. Only crates of the workspace count their executions, so that their dependencies are those of a usual
/// release build.
fn build(root: &Path) -> Result<PathBuf> {
    let mut build = cargo();
    build.args([
        "build",
        "--release",
        "--package",
        "palmares-fuzz",
        "--features",
        "libfuzzer",
        "--bin",
        "fuzz",
    ]);
    build.env("RUSTC_WORKSPACE_WRAPPER", root.join("fuzz/rustc-with-coverage"));
    executable(&artifacts(&mut build)?, "fuzz")
}

/// libFuzzer on one target.
struct Fuzzer<'a> {
    root: &'a Path,
    program: &'a Path,
    target: &'a str,
    /// The inputs found, and the kept ones.
    found: PathBuf,
    kept: PathBuf,
    faults: PathBuf,
    dictionary: PathBuf,
}

impl<'a> Fuzzer<'a> {
    fn new(root: &'a Path, program: &'a Path, target: &'a str) -> Result<Self> {
        let folder = root.join("target/fuzz").join(target);
        let (found, faults) = (folder.join("found"), folder.join("faults"));
        fs::create_dir_all(&found)?;
        fs::create_dir_all(&faults)?;
        let kept = root.join("fuzz/corpus").join(target);
        let fuzzer = Fuzzer { root, program, target, found, kept, faults, dictionary: folder.join("words") };
        let seeded = fuzzer.command().env("PALMARES_FUZZ_SEEDS", &fuzzer.found).status()?;
        ensure!(seeded.success(), "the first inputs of {target} cannot be written");
        fuzzer.write_dictionary()?;
        Ok(fuzzer)
    }

    fn command(&self) -> Command {
        let mut command = Command::new(self.program);
        command.env("PALMARES_FUZZ_TARGET", self.target).current_dir(self.root);
        command
    }

    /// Writes the words of the kept and the first inputs, from which the fuzzer makes new ones.
    fn write_dictionary(&self) -> Result<()> {
        let mut words = BTreeSet::new();
        for folder in [&self.kept, &self.found] {
            for entry in fs::read_dir(folder)? {
                let input = fs::read(entry?.path())?;
                words.extend(words_of(&String::from_utf8_lossy(&input)));
            }
        }
        let lines: String = words.iter().take(2_000).map(|word| format!("\"{word}\"\n")).collect();
        Ok(fs::write(&self.dictionary, lines)?)
    }

    /// Fuzzes in slices; after each it adds to the counts. Whether no fault was found.
    fn run(&self, options: &FuzzOptions) -> Result<bool> {
        let start = Instant::now();
        let mut done = 0;
        while done < options.executions {
            let left = match options.seconds {
                Some(seconds) => Duration::from_secs(seconds).saturating_sub(start.elapsed()),
                None => SLICE,
            };
            if left.as_secs() == 0 {
                break;
            }
            let Slice { executions, coverage, sound } =
                self.slice(options.executions - done, left.min(SLICE))?;
            done += executions;
            add(&self.root.join(COUNTS), self.target, executions)?;
            let speed = done as f64 / start.elapsed().as_secs_f64();
            println!("{}: {done} executions, {speed:.0} a second, {coverage}", self.target);
            if !sound {
                println!("{}: FAULT, on the newest input in {}", self.target, self.faults.display());
                return Ok(false);
            }
        }
        Ok(true)
    }

    fn slice(&self, executions: u64, time: Duration) -> Result<Slice> {
        let mut command = self.command();
        command.args([&self.found, &self.kept]).stderr(Stdio::piped());
        command.arg(format!("-runs={executions}")).arg(format!("-max_total_time={}", time.as_secs()));
        command.arg(format!("-timeout={TIMEOUT_S}")).arg(format!("-rss_limit_mb={MEMORY_MB}"));
        command.arg(format!("-dict={}", self.dictionary.display()));
        command.arg(format!("-artifact_prefix={}/", self.faults.display()));
        command.args(["-print_final_stats=1", "-reload=0", "-len_control=20"]);
        let mut child = command.spawn().context("the fuzzer does not start")?;
        let mut slice = Slice { executions: 0, coverage: String::new(), sound: false };
        let mut last = Vec::new();
        for line in BufReader::new(child.stderr.take().context("no output")?).split(b'\n') {
            let line = String::from_utf8_lossy(&line?).into_owned();
            if let Some(number) = line.strip_prefix("stat::number_of_executed_units:") {
                slice.executions = number.trim().parse()?;
            } else if let Some(at) = line.find("cov: ").filter(|_| line.starts_with('#')) {
                slice.coverage = line[at..].split(" exec/s").next().unwrap_or_default().to_owned();
            } else if !line.starts_with('#') && !line.starts_with("stat::") {
                last.push(line);
            }
        }
        slice.sound = child.wait()?.success();
        if !slice.sound {
            println!("{}", last.join("\n"));
        }
        Ok(slice)
    }

    /// Replaces the kept inputs by the smallest set that reaches the same code.
    fn keep(&self) -> Result<()> {
        let small = tempfile::tempdir()?;
        let mut merge = self.command();
        merge.args(["-set_cover_merge=1", "-use_counters=0"]).arg(format!("-max_len={KEPT_BYTES}"));
        let merged =
            merge.arg(small.path()).args([&self.kept, &self.found]).stderr(Stdio::null()).status()?;
        ensure!(merged.success(), "the inputs of {} cannot be reduced", self.target);
        fs::remove_dir_all(&self.kept)?;
        fs::create_dir_all(&self.kept)?;
        for entry in fs::read_dir(small.path())? {
            let entry = entry?;
            fs::copy(entry.path(), self.kept.join(entry.file_name()))?;
        }
        Ok(())
    }
}

/// The result of a part of a run.
struct Slice {
    executions: u64,
    coverage: String,
    sound: bool,
}

/// The words of a text that may be names or values.
fn words_of(text: &str) -> impl Iterator<Item = String> + '_ {
    let part = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '.' | '-');
    text.split(move |c| !part(c)).filter(|word| (2..=24).contains(&word.len())).map(str::to_owned)
}

/// Adds executions to a target's count.
fn add(file: &Path, target: &str, executions: u64) -> Result<()> {
    let mut counts: Map<String, Value> = match fs::read_to_string(file) {
        Ok(text) => serde_json::from_str(&text).with_context(|| file.display().to_string())?,
        Err(_) => Map::new(),
    };
    let before = counts.get(target).and_then(|count| count["executions"].as_u64()).unwrap_or(0);
    let today = jiff::Zoned::now().date().to_string();
    counts.insert(
        target.to_owned(),
        json!({"engine": "libFuzzer", "executions": before + executions, "last_run": today}),
    );
    Ok(fs::write(file, format!("{}\n", serde_json::to_string_pretty(&counts)?))?)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn executions_are_added_up() {
        let folder = tempfile::tempdir().expect("a folder");
        let file = folder.path().join("counts.json");
        add(&file, "a", 5).expect("written");
        add(&file, "b", 1).expect("written");
        add(&file, "a", 7).expect("written");
        let counts: Value = serde_json::from_str(&fs::read_to_string(&file).expect("a file")).expect("JSON");
        assert_eq!((&counts["a"]["executions"], &counts["b"]["executions"]), (&json!(12), &json!(1)));
    }

    #[test]
    fn words_are_names_and_values() {
        let words: Vec<String> = words_of("<mass value=\"0.02\"/> x {\"op\":1}").collect();
        assert_eq!(words, ["mass", "value", "0.02", "op"]);
    }
}
