//! `palmares hand check`: loads a hand, compares its figures with the limits, and closes it in simulation.

use crate::closure::{AGREEMENT, CLOSING_BUDGET, Closure, Problem, close};
use crate::describe::{describe, short};
use crate::figures::figures;
use crate::load::{Found, LimitsOf, examine_hand, hint, parse_sigma};
use crate::stuck::stuck;
use crate::table::{columns, table, widest, wrapped};
use crate::views::draw_hand;
use clap::Args;
use palmares_models::error::{LoadWarning, Refused};
use palmares_models::hand::Hand;
use palmares_models::hand::describe::HandDescription;
use palmares_models::measure::HandLimits;
use palmares_sim::statics::equilibrium::{ClosedForm, NoClosedForm};
use palmares_sim::statics::rest::Method;
use palmares_tasks::Task;
use palmares_tasks::inspect::{self, FigureRow};
use serde::Serialize;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

/// Exit code of `--strict` with warnings.
const WARNED: u8 = 2;

/// Arguments of `hand check`.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// A URDF file, a folder or .zip with one, or the name of a built-in hand
    hand: String,
    /// Motor positions to close to, from 0 (open) to 1; the same for all motors
    #[arg(long, value_delimiter = ',', value_parser = parse_sigma, default_value = "0.25,0.5,0.75,1")]
    sigma: Vec<f64>,
    /// A competition's file; its [hand_limits] replace the default limits
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Also draw the hand from three sides into this .svg or .png file
    #[arg(long, short, alias = "out", value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print all warnings, not only the first two of each kind
    #[arg(long)]
    all: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
    /// Exit with code 2 if there are warnings
    #[arg(long)]
    strict: bool,
}

/// Result of the check.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Usability {
    Usable,
    Unusable,
}

#[derive(Debug, Serialize)]
struct Warning {
    file: String,
    element: String,
    message: String,
}

impl From<&LoadWarning> for Warning {
    fn from(w: &LoadWarning) -> Self {
        let file = w.file.display().to_string();
        Warning { file, element: w.element.clone(), message: w.message.clone() }
    }
}

/// Output of `--json`.
#[derive(Debug, Serialize)]
struct Report {
    verdict: Usability,
    /// Reasons why the hand is unusable.
    errors: Vec<String>,
    warnings: Vec<Warning>,
    hand: Option<HandDescription>,
    /// Figures of this hand, of the built-in hands, and the limits.
    figures: Vec<FigureRow>,
    closures: Vec<Closure>,
}

impl Report {
    fn new() -> Report {
        let (errors, warnings, figures, closures) = (vec![], vec![], vec![], vec![]);
        Report { verdict: Usability::Unusable, errors, warnings, hand: None, figures, closures }
    }
}

/// Checks a hand and prints the report.
pub(crate) fn check(args: &CheckArgs, limits_of: LimitsOf<'_>) -> anyhow::Result<ExitCode> {
    let limits = match &args.config {
        Some(file) => limits_of(file)?,
        None => HandLimits::default(),
    };
    let mut report = Report::new();
    let mut text = String::new();
    let width = columns();
    match examine_hand(&args.hand) {
        Err(Refused { errors, warnings }) => {
            report.errors.extend(errors.iter().map(|error| error.to_string().trim_end().to_owned()));
            report.errors.extend(hint(&args.hand));
            report.warnings = warnings.iter().map(Warning::from).collect();
            if !warnings.is_empty() {
                text += warned(&warnings, args.all).trim_start();
            }
        }
        Ok(Found { hand, sources, mut warnings }) => {
            report.hand = Some(hand.describe());
            report.figures = inspect::figures(&hand, &sources, &limits);
            report.errors = inspect::beyond_limits(&hand, &sources, &limits);
            text += &describe(&hand, width);
            let _ = write!(
                text,
                "\nFigures, compared with the built-in hands\n{}",
                figures(&hand.name, &report.figures, width)
            );
            let mut closed = "\nFree closure: not simulated, because of the errors below\n".to_owned();
            report.errors.extend(stuck(&hand));
            // Beyond the limits a hand may make the simulation fail or take very long.
            if report.errors.is_empty() {
                report.errors.extend(inspect::in_the_way(&hand, &Task::builtin()));
                warnings.extend(simulate(&hand, sources.urdf(), &args.sigma, &mut report));
                closed = closures(&hand, &report.closures, args.all, width);
            }
            report.warnings = warnings.iter().map(Warning::from).collect();
            text += &warned(&warnings, args.all);
            text += &closed;
            if let Some(file) = &args.output {
                draw_hand(&hand, file)?;
                let _ = writeln!(text, "\nwrote {}", file.display());
            }
        }
    }
    if report.errors.is_empty() {
        report.verdict = Usability::Usable;
    }
    let code = match report.verdict {
        Usability::Unusable => ExitCode::FAILURE,
        Usability::Usable if args.strict && !report.warnings.is_empty() => ExitCode::from(WARNED),
        Usability::Usable => ExitCode::SUCCESS,
    };
    let mut out = std::io::stdout().lock();
    if args.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&report)?)?;
    } else {
        write!(out, "{text}{}", conclusion(&args.hand, &report))?;
    }
    Ok(code)
}

/// Closes the hand: with all motors at each σ, and with each motor alone. Returns warnings about its motion.
fn simulate(hand: &Arc<Hand>, file: &Path, sigma: &[f64], report: &mut Report) -> Vec<LoadWarning> {
    let motors = hand.motors.len();
    let mut warnings = Vec::new();
    if motors == 0 {
        return warnings;
    }
    let mut targets: Vec<Vec<f64>> = sigma.iter().map(|&s| vec![s; motors]).collect();
    if motors > 1 {
        let most = sigma.iter().copied().fold(0.0, f64::max);
        targets.extend((0..motors).map(|m| (0..motors).map(|k| if k == m { most } else { 0.0 }).collect()));
    }
    let mut left = CLOSING_BUDGET;
    for target in targets {
        match close(hand, &target, &mut left) {
            Err(error) => {
                report.errors.push(format!("hand '{}': {error}", hand.name));
                return warnings;
            }
            Ok(closure) => {
                let failed = closure.broken_off.and_then(|why| Some((why.fault?, why)));
                let known = |known: &Closure| known.broken_off.and_then(|why| why.fault);
                if let Some((fault, why)) = failed
                    && report.closures.iter().any(|closure| known(closure) == Some(fault))
                {
                    let (at, step, code) = (sigmas(&target), why.step, fault.code());
                    report
                        .errors
                        .push(format!("hand '{}': the same at σ = {at}, at step {step} ({code})", hand.name));
                } else if closure.disagrees() {
                    report.errors.push(format!(
                        "hand '{}': at σ = {} simulation and prediction differ by {:.1e}, more than {AGREEMENT:e}",
                        hand.name,
                        sigmas(&target),
                        closure.error.unwrap_or(f64::NAN)
                    ));
                } else {
                    let at = sigmas(&target);
                    for problem in closure.problems() {
                        match problem {
                            Problem::Unusable(why) => {
                                report.errors.push(format!("hand '{}': at σ = {at} {why}", hand.name));
                            }
                            Problem::Unusual { joint, why } => warnings.push(LoadWarning {
                                file: file.to_owned(),
                                element: format!("joint '{joint}'"),
                                message: format!("at σ = {at} {why}"),
                            }),
                        }
                    }
                }
                report.closures.push(closure);
            }
        }
        if left == 0 {
            // The closure that spent the budget has reported it.
            return warnings;
        }
    }
    warnings
}

fn sigmas(sigma: &[f64]) -> String {
    sigma.iter().map(|s| short(*s)).collect::<Vec<_>>().join(" ")
}

fn warned(warnings: &[LoadWarning], all: bool) -> String {
    let mut out = format!("\nWarnings: {}\n", warnings.len());
    let lines = warnings.iter().map(|w| (w.message.as_str(), w.to_string()));
    for line in if all { lines.map(|(_, line)| line).collect() } else { first_of_each_kind(lines) } {
        let _ = writeln!(out, "  {line}");
    }
    out
}

/// Number of printed lines that differ only in names and numbers.
const MAX_PER_KIND: usize = 2;

/// The first lines of each kind, and the number of further ones. Messages of a kind differ only in names and numbers.
fn first_of_each_kind<'a>(lines: impl Iterator<Item = (&'a str, String)>) -> Vec<String> {
    let mut kinds: Vec<(String, Vec<String>)> = Vec::new();
    for (message, line) in lines {
        let kind = kind_of(message);
        match kinds.iter_mut().find(|(known, _)| *known == kind) {
            Some((_, of_kind)) => of_kind.push(line),
            None => kinds.push((kind, vec![line])),
        }
    }
    let mut out = Vec::new();
    for (_, mut of_kind) in kinds {
        let more = of_kind.len().saturating_sub(MAX_PER_KIND);
        // A single further line is printed instead of a line about it.
        if more > 1 {
            of_kind.truncate(MAX_PER_KIND);
            of_kind.push(format!("... and {more} more like this (--all prints them)"));
        }
        out.append(&mut of_kind);
    }
    out
}

/// A message without its names and numbers.
fn kind_of(message: &str) -> String {
    let mut outside = true;
    let plain = |c: char| !c.is_ascii_digit() && c != '.';
    message
        .chars()
        .filter(|&c| {
            outside ^= c == '\'';
            outside && plain(c)
        })
        .collect()
}

/// Columns of the short table of closures that stay together.
const OF_A_CLOSURE: usize = 4;

fn closures(hand: &Hand, closures: &[Closure], all: bool, width: Option<usize>) -> String {
    if closures.is_empty() {
        return "\nFree closure: not simulated, the hand has no motor\n".to_owned();
    }
    let head = |names: &[&str]| names.iter().map(|name| (*name).to_owned()).collect::<Vec<String>>();
    let mut rows = vec![head(&["σ", "rest (s)", "law", "max |q - predicted|"])];
    rows[0].extend(hand.tendons.iter().flat_map(|t| [format!("f {}", t.name), "predicted".to_owned()]));
    // For many tendons: the largest tension.
    let mut largest = vec![head(&["σ", "rest (s)", "law", "max |Δq|", "max |Δf|", "max f", "of tendon"])];
    let mut notes = String::new();
    // Reasons that hold at every σ are printed once.
    let always = |reason: &String| closures.iter().all(|c| c.beyond_closed_form.contains(reason));
    for reason in closures[0].beyond_closed_form.iter().filter(|reason| always(reason)) {
        let _ = writeln!(notes, "  at every σ the closed form does not apply: {reason}");
    }
    if let Err(NoClosedForm::NoSpring { coordinate, .. }) = ClosedForm::new(hand) {
        let _ = writeln!(
            notes,
            "  at every σ the closed form does not apply: joint '{coordinate}' has no spring"
        );
    }
    for c in closures {
        let error = match c.error {
            Some(error) if c.beyond.is_empty() => format!("{error:.1e}"),
            _ => "-".to_owned(),
        };
        let law = match c.law {
            Some(Method::ClosedForm) => "closed form",
            Some(Method::Newton) => "Newton",
            None => "-",
        };
        let rest = c.rest_s.map_or("-".to_owned(), |t| format!("{t:.2}"));
        let mut row = vec![label(hand, &c.sigma), rest, law.to_owned(), error];
        largest.push(row.iter().cloned().chain(largest_tension(hand, c)).collect());
        for (k, f) in c.tension.iter().enumerate() {
            row.push(tension(*f));
            row.push(c.predicted_tension.as_ref().map_or("-".to_owned(), |p| tension(p[k])));
        }
        rows.push(row);
        let mut explain = |heading: &str, reasons: &[String]| {
            if reasons.is_empty() {
                return;
            }
            let _ = writeln!(notes, "  σ = {}: {heading}", label(hand, &c.sigma));
            let lines = reasons.iter().map(|reason| (reason.as_str(), reason.clone()));
            for reason in if all { reasons.to_vec() } else { first_of_each_kind(lines) } {
                let _ = writeln!(notes, "    {reason}");
            }
        };
        if let Some(band) = &c.band {
            let pairs = band.opening_tension.iter().zip(&band.closing_tension).zip(&hand.tendons);
            let limits =
                pairs.map(|((low, high), t)| format!("{} {} to {}", t.name, tension(*low), tension(*high)));
            let off =
                band.closing_q.iter().zip(&band.opening_q).map(|(a, b)| (a - b).abs()).fold(0.0, f64::max);
            let lines = [
                format!(
                    "tensions at rest after opening, and after closing: {}",
                    limits.collect::<Vec<_>>().join(", ")
                ),
                format!(
                    "joints rest up to {} apart; predicted is the rest with the present friction",
                    short(off)
                ),
            ];
            explain("cables or joints rub:", &lines);
        }
        let here: Vec<String> = c.beyond_closed_form.iter().filter(|r| !always(r)).cloned().collect();
        explain("the closed form does not apply:", &here);
        let balance = match c.unbalanced_nm {
            Some(torque) => format!(" (the simulated forces balance to {torque:.1e} N·m)"),
            None => String::new(),
        };
        explain(&format!("no prediction applies{balance}:"), &c.beyond);
    }
    let whole = table(&rows);
    if width.is_none_or(|width| widest(&whole) <= width) {
        return format!("\nFree closure, simulated and predicted (f: tensions)\n{whole}{notes}");
    }
    let rows = wrapped(&largest, OF_A_CLOSURE, 1, width);
    format!(
        "\nFree closure, simulated and predicted (f: tensions, Δ: difference); --json has all\n{rows}{notes}"
    )
}

/// The largest error of a tension, and the largest tension with its tendon.
fn largest_tension(hand: &Hand, closure: &Closure) -> [String; 3] {
    let f = &closure.tension;
    let off = closure.predicted_tension.as_ref().map(|predicted| {
        f.iter().zip(predicted).map(|(f, predicted)| (f - predicted).abs()).fold(0.0, f64::max)
    });
    let most = (0..f.len()).max_by(|a, b| f[*a].abs().total_cmp(&f[*b].abs()));
    let or = |text: Option<String>| text.unwrap_or_else(|| "-".to_owned());
    [
        or(off.map(|off| format!("{off:.1e}"))),
        or(most.map(|k| tension(f[k]))),
        or(most.map(|k| hand.tendons[k].name.clone())),
    ]
}

/// The motors' positions, shorter for many motors: those of all, or of the one that moves.
fn label(hand: &Hand, sigma: &[f64]) -> String {
    let moved: Vec<usize> = (0..sigma.len()).filter(|&k| sigma[k] != 0.0).collect();
    match (sigma, moved.as_slice()) {
        ([first, _, _, ..], _) if sigma.iter().all(|s| s == first) => format!("all {}", short(*first)),
        ([_, _, _, ..], &[one]) => format!("{} {}", hand.motors[one].name, short(sigma[one])),
        _ => sigmas(sigma),
    }
}

/// A tension; a rounded −0 has no sign.
fn tension(f: f64) -> String {
    let text = format!("{f:.6}");
    if text == "-0.000000" { "0.000000".to_owned() } else { text }
}

fn conclusion(name: &str, report: &Report) -> String {
    let mut out = String::new();
    for error in &report.errors {
        let _ = writeln!(out, "error: {error}");
    }
    let moved = report.hand.as_ref().is_none_or(|hand| !hand.motors.is_empty());
    let usable = if moved { "usable" } else { "can be loaded, but no motor moves it" };
    let _ = match (report.verdict, report.warnings.len()) {
        (Usability::Unusable, _) => writeln!(out, "\n{name}: not usable"),
        (Usability::Usable, 0) => writeln!(out, "\n{name}: {usable}"),
        (Usability::Usable, 1) => writeln!(out, "\n{name}: {usable}, with 1 warning"),
        (Usability::Usable, n) => writeln!(out, "\n{name}: {usable}, with {n} warnings"),
    };
    out
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn newton_has_a_reason_also_for_servos() {
        let hand = Hand::builtin("leap").expect("it is built in");
        let closure = Closure {
            law: Some(Method::Newton),
            ..close(&hand, &vec![0.5; hand.motors.len()], &mut 1).expect("played")
        };
        let text = closures(&hand, &[closure], false, Some(80));
        assert!(text.contains("at every σ the closed form does not apply: joint '"), "{text}");
        assert!(text.contains("has no spring"), "{text}");
    }
}
