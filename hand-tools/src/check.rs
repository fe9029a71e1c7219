//! `palmares hand check`.

use crate::closure::{AGREEMENT, CLOSING_WORK, Closure, Trouble, close};
use crate::describe::{describe, short};
use crate::figures::figures;
use crate::load::{Found, LimitsOf, hint, load_hand, parse_sigma};
use crate::table::table;
use crate::views::draw_hand;
use clap::Args;
use palmares_models::error::LoadWarning;
use palmares_models::hand::Hand;
use palmares_models::hand::describe::HandDescription;
use palmares_models::measure::HandLimits;
use palmares_sim::statics::prediction::Method;
use palmares_tasks::Task;
use palmares_tasks::inspect::{self, FigureRow};
use serde::Serialize;
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::{Path, PathBuf};
use std::process::ExitCode;
use std::sync::Arc;

/// The exit code of `--strict` when there are warnings.
const WARNED: u8 = 2;

/// Which hand, and how to report.
#[derive(Debug, Args)]
pub struct CheckArgs {
    /// A URDF file, a folder or .zip with one, or the name of a hand that comes with the program
    hand: String,
    /// Motor positions to close to, from 0 (open) to 1; all motors go there together
    #[arg(long, value_delimiter = ',', value_parser = parse_sigma, default_value = "0.25,0.5,0.75,1")]
    sigma: Vec<f64>,
    /// A competition's file; its [hand_limits] hold instead of the program's
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Also draw the hand from three sides; a name that ends in .svg or .png
    #[arg(long, short, alias = "out", value_name = "FILE")]
    output: Option<PathBuf>,
    /// Print every warning, also where many say the same
    #[arg(long)]
    all: bool,
    /// Print one JSON object instead of text
    #[arg(long)]
    json: bool,
    /// Warnings make the exit code 2
    #[arg(long)]
    strict: bool,
}

/// How it ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
enum Verdict {
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

/// What `--json` prints.
#[derive(Debug, Serialize)]
struct Report {
    verdict: Verdict,
    /// Why it is unusable.
    errors: Vec<String>,
    warnings: Vec<Warning>,
    hand: Option<HandDescription>,
    /// Beside those of the program's hands and the limits.
    figures: Vec<FigureRow>,
    closures: Vec<Closure>,
}

impl Report {
    fn new() -> Report {
        let (errors, warnings, figures, closures) = (vec![], vec![], vec![], vec![]);
        Report { verdict: Verdict::Unusable, errors, warnings, hand: None, figures, closures }
    }
}

/// Checks and prints; the exit code says how it ended.
pub(crate) fn check(args: &CheckArgs, limits_of: LimitsOf<'_>) -> anyhow::Result<ExitCode> {
    let limits = match &args.config {
        Some(file) => limits_of(file)?,
        None => HandLimits::default(),
    };
    let mut report = Report::new();
    let mut text = String::new();
    match load_hand(&args.hand) {
        Err(error) => {
            report.errors.push(error.to_string().trim_end().to_owned());
            report.errors.extend(hint(&args.hand));
        }
        Ok(Found { hand, sources, mut warnings }) => {
            report.hand = Some(hand.describe());
            report.figures = inspect::figures(&hand, &sources, &limits);
            report.errors = inspect::beyond_limits(&hand, &sources, &limits);
            text += &describe(&hand);
            let _ = write!(
                text,
                "\nFigures beside those of the program's hands\n{}",
                figures(&hand.name, &report.figures)
            );
            let mut closed = "\nFree closure: not simulated, the hand is beyond the limits\n".to_owned();
            // A hand that is a machine may break the simulation, or keep it busy for ever.
            if report.errors.is_empty() {
                report.errors.extend(inspect::in_the_way(&hand, &Task::builtin()));
                warnings.extend(simulate(&hand, sources.urdf(), &args.sigma, &mut report));
                closed = closures(&hand, &report.closures, args.all);
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
        report.verdict = Verdict::Usable;
    }
    let code = match report.verdict {
        Verdict::Unusable => ExitCode::FAILURE,
        Verdict::Usable if args.strict && !report.warnings.is_empty() => ExitCode::from(WARNED),
        Verdict::Usable => ExitCode::SUCCESS,
    };
    let mut out = std::io::stdout().lock();
    if args.json {
        writeln!(out, "{}", serde_json::to_string_pretty(&report)?)?;
    } else {
        write!(out, "{text}{}", verdict(&args.hand, &report))?;
    }
    Ok(code)
}

/// Closes the hand: all motors together at every σ, and each of several alone. Returns what is odd about how it moves.
fn simulate(hand: &Arc<Hand>, file: &Path, sigma: &[f64], report: &mut Report) -> Vec<LoadWarning> {
    let motors = hand.motors.len();
    let mut odd = Vec::new();
    if motors == 0 {
        return odd;
    }
    let mut targets: Vec<Vec<f64>> = sigma.iter().map(|&s| vec![s; motors]).collect();
    if motors > 1 {
        let most = sigma.iter().copied().fold(0.0, f64::max);
        targets.extend((0..motors).map(|m| (0..motors).map(|k| if k == m { most } else { 0.0 }).collect()));
    }
    let mut left = CLOSING_WORK;
    for target in targets {
        match close(hand, &target, &mut left) {
            Err(error) => {
                report.errors.push(format!("hand '{}': {error}", hand.name));
                return odd;
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
                        .push(format!("hand '{}': at σ = {at} too, at step {step} ({code})", hand.name));
                } else if closure.disagrees() {
                    report.errors.push(format!(
                        "hand '{}': at σ = {} simulation and prediction differ by {:.1e}, more than {AGREEMENT:e}",
                        hand.name,
                        sigmas(&target),
                        closure.error.unwrap_or(f64::NAN)
                    ));
                } else {
                    let at = sigmas(&target);
                    for trouble in closure.troubles() {
                        match trouble {
                            Trouble::Unusable(why) => {
                                report.errors.push(format!("hand '{}': at σ = {at} {why}", hand.name));
                            }
                            Trouble::Odd { joint, why } => odd.push(LoadWarning {
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
            // The first closure that had not enough has said so.
            return odd;
        }
    }
    odd
}

fn sigmas(sigma: &[f64]) -> String {
    sigma.iter().map(|s| short(*s)).collect::<Vec<_>>().join(" ")
}

fn warned(warnings: &[LoadWarning], all: bool) -> String {
    let mut out = format!("\nWarnings: {}\n", warnings.len());
    let lines = warnings.iter().map(|w| (w.message.as_str(), w.to_string()));
    for line in if all { lines.map(|(_, line)| line).collect() } else { of_each_kind(lines) } {
        let _ = writeln!(out, "  {line}");
    }
    out
}

/// So many lines that differ only in names and numbers are printed.
const OF_A_KIND: usize = 2;

/// The first few of each kind of line, and how many more there are. A kind is a message but for names and numbers.
fn of_each_kind<'a>(lines: impl Iterator<Item = (&'a str, String)>) -> Vec<String> {
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
        let more = of_kind.len().saturating_sub(OF_A_KIND);
        // A line that says that one is left out can as well be that one.
        if more > 1 {
            of_kind.truncate(OF_A_KIND);
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

fn closures(hand: &Hand, closures: &[Closure], all: bool) -> String {
    if closures.is_empty() {
        return "\nFree closure: not simulated, the hand has no motor\n".to_owned();
    }
    let mut rows = vec![vec!["σ", "rest (s)", "law", "max |q - predicted|"]]
        .into_iter()
        .map(|row| row.into_iter().map(str::to_owned).collect::<Vec<String>>())
        .collect::<Vec<_>>();
    rows[0].extend(hand.tendons.iter().flat_map(|t| [format!("f {}", t.name), "predicted".to_owned()]));
    let mut notes = String::new();
    // Said once, not for every σ.
    let always = |reason: &String| closures.iter().all(|c| c.beyond_closed_form.contains(reason));
    for reason in closures[0].beyond_closed_form.iter().filter(|reason| always(reason)) {
        let _ = writeln!(notes, "  at every σ the closed form does not apply: {reason}");
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
        let mut row = vec![sigmas(&c.sigma), rest, law.to_owned(), error];
        for (k, f) in c.tension.iter().enumerate() {
            row.push(tension(*f));
            row.push(c.predicted_tension.as_ref().map_or("-".to_owned(), |p| tension(p[k])));
        }
        rows.push(row);
        let mut explain = |heading: &str, reasons: &[String]| {
            if reasons.is_empty() {
                return;
            }
            let _ = writeln!(notes, "  σ = {}: {heading}", sigmas(&c.sigma));
            let lines = reasons.iter().map(|reason| (reason.as_str(), reason.clone()));
            for reason in if all { reasons.to_vec() } else { of_each_kind(lines) } {
                let _ = writeln!(notes, "    {reason}");
            }
        };
        let here: Vec<String> = c.beyond_closed_form.iter().filter(|r| !always(r)).cloned().collect();
        explain("the closed form does not apply:", &here);
        let balance = match c.unbalanced_nm {
            Some(torque) => format!(" (simulated forces balance to {torque:.1e} N·m)"),
            None => String::new(),
        };
        explain(&format!("no prediction applies{balance}:"), &c.beyond);
    }
    format!("\nFree closure, simulated and predicted (f: tensions)\n{}{notes}", table(&rows))
}

/// A tension, without the sign of what is nothing but rounding.
fn tension(f: f64) -> String {
    let text = format!("{f:.6}");
    if text == "-0.000000" { "0.000000".to_owned() } else { text }
}

fn verdict(name: &str, report: &Report) -> String {
    let mut out = String::new();
    for error in &report.errors {
        let _ = writeln!(out, "error: {error}");
    }
    let _ = match (report.verdict, report.warnings.len()) {
        (Verdict::Unusable, _) => writeln!(out, "\n{name}: not usable"),
        (Verdict::Usable, 0) => writeln!(out, "\n{name}: usable"),
        (Verdict::Usable, 1) => writeln!(out, "\n{name}: usable, with 1 warning"),
        (Verdict::Usable, n) => writeln!(out, "\n{name}: usable, with {n} warnings"),
    };
    out
}
