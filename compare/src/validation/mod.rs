//! `palmares-compare validate`: published measurements on real hands beside the same measurement on ours, as docs/validation.

mod barrett;
mod ends;
mod fingertips;
mod grips;
mod outcome;
mod page;
mod plot;
mod press;
mod recording;
mod softhand;
mod studies;

use anyhow::{Context, Result};
use clap::Args;
use outcome::{Effort, Outcome};
use palmares_bench::cases::Setup;
use serde_json::{Map, Value};
use std::fs;
use std::path::PathBuf;
use studies::STUDIES;

/// The measurements to make, and the place of their page.
#[derive(Args, Clone, Debug)]
pub struct ValidationOptions {
    /// Steps of 2 ms and few placements: half a minute.
    #[arg(long)]
    quick: bool,
    /// End with one line of JSON on standard output: every measurement with the published value, mean and range of ours.
    #[arg(long)]
    json: bool,
    /// Folder of the page.
    #[arg(long, default_value = "target/validation")]
    out: PathBuf,
    /// Only these measurements, by commas; all if not given.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// A recording of a Yale T42, one JSON object per episode; docs/validation says how to make it of the published files.
    #[arg(long)]
    t42: Option<PathBuf>,
}

/// Measures everything, writes the page and prints the line.
///
/// # Errors
/// The engine fails, a study is unknown, or a file cannot be written.
pub fn run(options: &ValidationOptions) -> Result<()> {
    let dt_s = if options.quick { 2e-3 } else { 1e-3 };
    let effort = Effort { setup: Setup::own(dt_s), few: options.quick };
    let mut outcomes = measure(effort, &options.only)?;
    if let Some(path) = &options.t42 {
        let measured = recording::measure(&effort, path)?;
        outcomes.push(Outcome { study: &recording::STUDY, measured, ends: None });
    }
    fs::create_dir_all(&options.out).with_context(|| format!("{}", options.out.display()))?;
    page::write(&outcomes, effort, &options.out)?;
    if options.json {
        println!("{}", line(&outcomes));
    }
    Ok(())
}

/// Plays the studies of these names, or all.
pub(crate) fn measure(effort: Effort, only: &[String]) -> Result<Vec<Outcome>> {
    for name in only {
        let known = || STUDIES.iter().map(|study| study.key).collect::<Vec<_>>().join(", ");
        anyhow::ensure!(
            STUDIES.iter().any(|study| study.key == name),
            "unknown measurement `{name}`; known: {}",
            known()
        );
    }
    let chosen = STUDIES.iter().filter(|study| only.is_empty() || only.iter().any(|name| name == study.key));
    let mut outcomes = Vec::new();
    for study in chosen {
        eprintln!("{}", study.key);
        let measured = (study.measure)(&effort).with_context(|| study.key.to_owned())?;
        let ends = match study.ends.filter(|_| !effort.few) {
            Some(ends) => ends(&effort).with_context(|| study.key.to_owned())?,
            None => None,
        };
        if !measured.is_empty() {
            outcomes.push(Outcome { study, measured, ends });
        }
    }
    Ok(outcomes)
}

/// All outcomes as one line of JSON.
pub(crate) fn line(outcomes: &[Outcome]) -> Value {
    let entries = outcomes.iter().map(|outcome| (outcome.study.key.to_owned(), outcome.entry()));
    Value::Object(entries.collect::<Map<_, _>>())
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Every measurement that holds its object has finite numbers in order; keys are unique, and each names its source.
    #[test]
    fn a_coarse_validation_is_finite_and_complete() {
        let effort = Effort { setup: Setup::own(4e-3), few: true };
        let outcomes = measure(effort, &[]).expect("everything can be measured");
        let line = line(&outcomes);
        let entries = line.as_object().expect("an object");
        assert_eq!(entries.len(), outcomes.len(), "two measurements have one key");
        for key in ["softhand_split_cylinder", "softhand_disc_torque", "softhand_motor_power"] {
            assert!(entries.contains_key(key), "{key}");
        }
        for (key, entry) in entries {
            let number = |name: &str| entry[name].as_f64();
            let Some(mean) = number("ours_mean") else {
                assert_eq!(entry["lost"], entry["placements"], "{key}: no mean although something was held");
                continue;
            };
            let (least, most) = (number("ours_min"), number("ours_max"));
            let (least, most) = least.zip(most).unwrap_or_else(|| panic!("{key}: no range"));
            assert!(least <= mean + 1e-9 && mean <= most + 1e-9, "{key}: {least} {mean} {most}");
        }
        for outcome in &outcomes {
            assert!(!outcome.study.source.is_empty() && !outcome.study.why.is_empty());
        }
    }

    #[test]
    fn an_unknown_measurement_is_refused_with_the_known_ones() {
        let effort = Effort { setup: Setup::own(4e-3), few: true };
        let error = measure(effort, &["softhand_spit".into()]).err().expect("refused").to_string();
        assert!(error.contains("softhand_split_cylinder"), "{error}");
    }
}
