//! `palmares hand show`: a hand as text, or its simulated closure as an image.

use crate::closure::{
    BrokenOff, CLOSING_BUDGET, Comparison, FreeHand, NotSettled, RAMP_S, REST_SPEED, VISIBLE_SPEED, compare,
};
use crate::describe::{describe, short};
use crate::draw::draw;
use crate::figure::{Curve, Figure, Panel};
use crate::fingers::fingers;
use crate::load::{hint, load_hand, parse_sigma};
use crate::push::PushArg;
use crate::table::columns;
use crate::view::view_of;
use anyhow::{Context, bail};
use clap::Args;
use palmares_models::hand::Hand;
use palmares_sim::Push;
use palmares_sim::statics::rest::{Equilibrium, Method};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

/// Sample period of the figure, s.
const SAMPLE_S: f64 = 5e-3;

/// Arguments of `hand show`.
#[derive(Debug, Args)]
pub struct ShowArgs {
    /// A URDF file, a folder or .zip with one, or the name of a built-in hand
    hand: String,
    /// Draw an image into this .svg or .png file
    #[arg(long, short, alias = "out", value_name = "FILE")]
    output: Option<PathBuf>,
    /// Motor positions to close to, from 0 (open) to 1: one for all motors, or one per motor
    #[arg(long, requires = "output", value_delimiter = ',', value_parser = parse_sigma, default_value = "0.6")]
    sigma: Vec<f64>,
    /// A constant force on a link's centre of mass after the hand has closed: link:fx,fy,fz in N, world frame.
    /// The hand's base frame equals the world frame
    #[arg(long, requires = "output", value_name = "LINK:FX,FY,FZ", allow_hyphen_values = true)]
    push: Vec<PushArg>,
}

/// A stage of the motion: closing, or being pushed.
struct Stage {
    name: &'static str,
    /// s
    from: f64,
    to: f64,
    /// The hand's coordinates at `to`.
    at_end: Vec<f64>,
    predicted: Option<Equilibrium>,
    /// Largest |q − predicted| at rest.
    error: Option<f64>,
    /// Reasons why no prediction applies.
    beyond: Vec<String>,
    /// Set if the simulation ended before the hand came to rest.
    broken_off: Option<BrokenOff>,
}

/// Samples of the motion.
#[derive(Default)]
struct Trace {
    time: Vec<f64>,
    q: Vec<Vec<f64>>,
    tension: Vec<Vec<f64>>,
}

impl Trace {
    fn sample(&mut self, free: &FreeHand) {
        let t = free.time_s();
        if self.time.last().is_none_or(|last| t - last >= SAMPLE_S * (1.0 - 1e-9)) {
            self.time.push(t);
            self.q.push(free.state().q.clone());
            self.tension.push(free.state().tension.clone());
        }
    }
}

/// Simulates, draws and prints a summary.
pub(crate) fn show(args: &ShowArgs) -> anyhow::Result<ExitCode> {
    let found = load_hand(&args.hand);
    let hand = found.with_context(|| hint(&args.hand).unwrap_or_else(|| args.hand.clone()))?.hand;
    let mut out = std::io::stdout().lock();
    let Some(file) = &args.output else {
        write!(out, "{}", describe(&hand, columns()))?;
        return Ok(ExitCode::SUCCESS);
    };
    let sigma = one_per_motor(&hand, &args.sigma)?;
    let pushes = args.push.iter().map(|push| push.on(&hand)).collect::<anyhow::Result<Vec<Push>>>()?;
    let mut free = FreeHand::new(&hand)?;
    let mut trace = Trace::default();
    trace.sample(&free);
    let mut left = CLOSING_BUDGET;
    let mut stages = vec![stage(&mut free, "closed", &sigma, &mut trace, &mut left)];
    if !pushes.is_empty() && stages[0].broken_off.is_none() {
        free.set_pushes(&pushes);
        stages.push(stage(&mut free, "pushed", &sigma, &mut trace, &mut left));
    }
    let figure = figure(&hand, &sigma, &pushes, &trace, &stages);
    draw(&figure, file)?;
    write!(out, "{}", summary(&stages))?;
    writeln!(out, "wrote {}", file.display())?;
    let broken = stages.iter().find_map(|stage| Some((stage.name, stage.broken_off?)));
    if let Some((name, why)) = broken {
        let sigmas = sigma.iter().map(|s| short(*s)).collect::<Vec<_>>().join(", ");
        bail!("hand '{}': {name} at σ = {sigmas}: {why}", hand.name);
    }
    Ok(ExitCode::SUCCESS)
}

pub(crate) fn one_per_motor(hand: &Hand, sigma: &[f64]) -> anyhow::Result<Vec<f64>> {
    let motors = hand.motors.len();
    match sigma {
        [one] => Ok(vec![*one; motors]),
        each if each.len() == motors => Ok(each.to_vec()),
        _ => bail!("--sigma has {} values; valid: one for all motors, or {motors}", sigma.len()),
    }
}

/// Steps until no motion is visible; then continues without samples until the hand rests, for the comparison.
fn stage(free: &mut FreeHand, name: &'static str, sigma: &[f64], trace: &mut Trace, left: &mut u64) -> Stage {
    let from = free.time_s();
    let mut rest = free.settle(sigma, VISIBLE_SPEED, left, |free| trace.sample(free));
    let to = free.time_s();
    let before = free.state().clone();
    let mut at_end = before.q.clone();
    if let Err(NotSettled::BrokenOff(_)) = rest {
        // The state of a failed world may not be finite.
        at_end.clone_from(trace.q.last().unwrap_or(&before.q));
    } else {
        rest = free.settle(sigma, REST_SPEED, left, |_| {});
    }
    let broken_off = match rest {
        Err(NotSettled::BrokenOff(why)) => Some(why),
        _ => None,
    };
    let Comparison { predicted, error, beyond } = compare(free, &rest);
    free.restore(before);
    Stage { name, from, to, at_end, predicted, error, beyond, broken_off }
}

fn figure(hand: &Arc<Hand>, sigma: &[f64], pushes: &[Push], trace: &Trace, stages: &[Stage]) -> Figure {
    let predicted = |value: &dyn Fn(&Equilibrium) -> f64| -> Vec<(f64, f64, f64)> {
        let known = stages.iter().filter_map(|p| Some((p, p.predicted.as_ref()?)));
        known
            .map(|(p, e)| {
                // The first dashes begin during the motors' ramp.
                let from = if p.from == 0.0 { 0.5 * RAMP_S } else { p.from };
                (from, p.to, value(e))
            })
            .collect()
    };
    let mut panels = Vec::new();
    for group in fingers(hand) {
        let curve = |(c, name): &(usize, String)| Curve {
            name: name.clone(),
            values: trace.q.iter().map(|q| q[*c]).collect(),
            predicted: predicted(&|e| e.q[*c]),
        };
        panels.push(Panel {
            title: group.title.clone(),
            axis: format!("q ({})", group.unit),
            curves: group.members.iter().map(curve).collect(),
        });
    }
    if !hand.tendons.is_empty() {
        let curve = |(k, tendon): (usize, &palmares_models::hand::Tendon)| Curve {
            name: tendon.name.clone(),
            values: trace.tension.iter().map(|f| f[k]).collect(),
            predicted: predicted(&|e| e.tension[k]),
        };
        panels.push(Panel {
            title: if hand.tendons.len() == 1 { "tension".into() } else { "tensions".into() },
            axis: "f (N or N·m)".into(),
            curves: hand.tendons.iter().enumerate().map(curve).collect(),
        });
    }
    let sigmas = sigma.iter().map(|s| short(*s)).collect::<Vec<_>>().join(", ");
    let mut notes = vec!["simulated: solid; predicted at rest: dashed, ring".to_owned()];
    for push in pushes {
        let [x, y, z] = push.force.to_array().map(short);
        notes.push(format!("pushed on {}: {x}, {y}, {z} N", hand.links[push.link].name));
    }
    notes.extend(stages.iter().map(outcome));
    let open = view_of(hand, &trace.q[0], "open".into());
    let ends = stages.iter().map(|stage| view_of(hand, &stage.at_end, stage.name.to_owned()));
    Figure {
        views: std::iter::once(open).chain(ends).collect(),
        title: format!("{}, σ = {sigmas}", hand.name),
        notes,
        time: trace.time.clone(),
        across: "t (s)",
        marks: stages.iter().skip(1).map(|p| (p.from, p.name.to_owned())).collect(),
        panels,
    }
}

/// One line about a stage.
fn outcome(stage: &Stage) -> String {
    let first = |reasons: &[String]| match reasons {
        [] => String::new(),
        [only] => format!(": {only}"),
        [first, more @ ..] => format!(": {first}, and {} more", more.len()),
    };
    let name = stage.name;
    match (&stage.predicted, stage.error) {
        (Some(predicted), Some(error)) if stage.beyond.is_empty() => {
            let law = match predicted.method {
                Method::ClosedForm => "closed form".to_owned(),
                Method::Newton => format!("Newton's method{}", first(&predicted.beyond_closed_form)),
            };
            format!("{name}: largest |q − predicted| at rest {error:.1e} ({law})")
        }
        _ => format!("{name}: no prediction applies{}", first(&stage.beyond)),
    }
}

fn summary(stages: &[Stage]) -> String {
    let mut out = String::new();
    for stage in stages {
        let _ = writeln!(out, "{}", outcome(stage));
    }
    out
}
