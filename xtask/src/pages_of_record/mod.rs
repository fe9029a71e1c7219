//! `cargo xtask pages-of-record`: measures and writes every page of measured results, and continues where it stopped.

mod declared;
mod finished_parts;
mod parts;
mod tools;

use crate::workspace;
use anyhow::{Context, Result, bail, ensure};
use clap::Args;
use declared::DeclaredPart;
use finished_parts::FinishedParts;
use std::fs;
use std::time::Instant;
use tools::{Anew, Tools};

#[derive(Args)]
pub(crate) struct RecordPagesOptions {
    /// Name the parts, their usual time and what is finished with the present engine; measure nothing.
    #[arg(long)]
    list: bool,
    /// Only these parts, by commas.
    #[arg(long, value_delimiter = ',')]
    only: Vec<String>,
    /// Play each part in its shortest form, into target/pages-of-record: whether all of it works.
    #[arg(long)]
    quick: bool,
    /// Measure again what is finished.
    #[arg(long)]
    again: bool,
    /// Play all runs of other engines, also those that the pages have with the same key: hours.
    #[arg(long)]
    peers_anew: bool,
    /// Keep the outcomes of other engines and time their runs again.
    #[arg(long, conflicts_with = "peers_anew")]
    times_anew: bool,
}

/// Runs the parts that are not finished with the present engine; a part that fails does not keep the others from being made.
pub(crate) fn run(options: &RecordPagesOptions) -> Result<()> {
    let parts = chosen(declared::parts()?, &options.only)?;
    let anew = match (options.peers_anew, options.times_anew) {
        (true, _) => Anew::Peers,
        (false, true) => Anew::Times,
        (false, false) => Anew::Sentinels,
    };
    let tools = Tools::new(options.quick, anew)?;
    let mut finished_parts = FinishedParts::read(&tools.folder, options.quick)?;
    let mut open = Vec::new();
    for part in &parts {
        let fingerprint = tools.fingerprint(&part.name)?;
        let finished = finished_parts.finished(&part.name, &fingerprint);
        if options.list {
            println!("{}", listed(part, &finished_parts, finished));
        }
        if options.again || !finished {
            open.push((part, fingerprint));
        }
    }
    println!(
        "{} of {} parts are to be made, {}",
        open.len(),
        parts.len(),
        usual_time(&finished_parts, &open)
    );
    if options.list || open.is_empty() {
        return Ok(());
    }
    golden(&tools)?;
    let mut failed = Vec::new();
    for (place, (part, fingerprint)) in open.iter().enumerate() {
        let rest = usual_time(&finished_parts, &open[place..]);
        let DeclaredPart { name, about, .. } = part;
        println!("\n== {name}: {about}; part {} of {}, with those after it {rest}", place + 1, open.len());
        let begun = Instant::now();
        match parts::make(part, &tools) {
            Ok(()) => {
                let took_min = begun.elapsed().as_secs_f64() / 60.0;
                finished_parts.finish(name, fingerprint, took_min)?;
                println!("== {name} took {}", duration(took_min));
            }
            Err(error) => {
                eprintln!("error: part `{name}`: {error:#}");
                failed.push(name.as_str());
            }
        }
    }
    if !options.quick {
        tools.write_list()?;
    }
    ensure!(
        failed.is_empty(),
        "not made: {}; see above. The other parts are finished: the same command goes on with these",
        failed.join(", ")
    );
    Ok(())
}

/// The parts of these names, all without names.
fn chosen(parts: Vec<DeclaredPart>, only: &[String]) -> Result<Vec<DeclaredPart>> {
    let names = || parts.iter().map(|part| &*part.name).collect::<Vec<_>>().join(", ");
    if let Some(unknown) = only.iter().find(|name| !parts.iter().any(|part| part.name == **name)) {
        bail!("no part `{unknown}`; parts: {}", names());
    }
    Ok(parts.into_iter().filter(|part| only.is_empty() || only.contains(&part.name)).collect())
}

fn listed(part: &DeclaredPart, finished_parts: &FinishedParts, finished: bool) -> String {
    let status = match finished {
        true => "finished".to_owned(),
        false => finished_parts.usual_minutes(part).map_or_else(|| "not timed".to_owned(), duration),
    };
    format!("{:<14}{status:<10}{}: {}", part.name, part.about, part.pages.join(", "))
}

/// The usual time of these parts together, in words.
fn usual_time(finished_parts: &FinishedParts, open: &[(&DeclaredPart, String)]) -> String {
    let times: Vec<Option<f64>> = open.iter().map(|(part, _)| finished_parts.usual_minutes(part)).collect();
    let timed: Vec<f64> = times.iter().flatten().copied().collect();
    let not_timed = match times.len() - timed.len() {
        0 => "",
        _ if timed.is_empty() => return "not timed yet".to_owned(),
        _ => " and what parts take that are not timed yet",
    };
    format!("usually {}{not_timed}", duration(timed.iter().sum()))
}

/// A duration in words.
fn duration(minutes: f64) -> String {
    if minutes < 90.0 { format!("{minutes:.0} min") } else { format!("{:.1} h", minutes / 60.0) }
}

/// The engine must be that of `tasks/golden`, after which pages name it.
fn golden(tools: &Tools) -> Result<()> {
    for line in tools.output(tools.bench().arg("fingerprint"))?.lines() {
        let (name, played) =
            line.split_once(' ').context("`palmares-bench fingerprint` prints names and hashes")?;
        let file = format!("tasks/golden/{name}.txt");
        let golden = fs::read_to_string(workspace::root().join(&file)).with_context(|| file.clone())?;
        ensure!(
            golden.trim() == played,
            "the engine's reference run `{name}` ends in {played}, {file} has {}: write the new one first",
            golden.trim()
        );
    }
    Ok(())
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_declared_part_can_be_made_and_every_command_is_of_a_part() {
        let parts = declared::parts().expect("pages.toml");
        for part in &parts {
            assert!(parts::COMMANDS.iter().any(|(name, _)| *name == part.name), "{}", part.name);
        }
        for (name, _) in parts::COMMANDS {
            assert!(parts.iter().any(|part| part.name == name), "{name} is not in pages.toml");
        }
    }

    #[test]
    fn parts_are_chosen_by_name() {
        let parts = || declared::parts().expect("pages.toml");
        let names = |only: &[&str]| -> Result<Vec<String>> {
            let only: Vec<String> = only.iter().map(|name| (*name).to_owned()).collect();
            Ok(chosen(parts(), &only)?.into_iter().map(|part| part.name).collect())
        };
        assert_eq!(names(&["grasps", "report"]).expect("known"), ["report", "grasps"]);
        assert_eq!(names(&[]).expect("all").len(), parts().len());
        let error = names(&["grasp"]).expect_err("unknown").to_string();
        assert!(error.starts_with("no part `grasp`; parts: report, "), "{error}");
    }

    #[test]
    fn long_durations_are_in_hours() {
        assert_eq!((duration(75.2), duration(360.0)), ("75 min".to_owned(), "6.0 h".to_owned()));
    }
}
