//! `palmares hand show`: a hand as text, and with its closure as a picture.

use crate::closure::{
    AT_REST, AT_SIGHT, Alone, BrokenOff, CLOSING_WORK, Comparison, RAMP_S, Restless, compare,
};
use crate::describe::{describe, short};
use crate::draw::draw;
use crate::figure::{Curve, Figure, Panel};
use crate::fingers::fingers;
use crate::load::{hint, load_hand, parse_sigma};
use crate::push::PushArg;
use crate::view::look;
use anyhow::{Context, bail};
use clap::Args;
use palmares_models::hand::Hand;
use palmares_sim::Push;
use palmares_sim::statics::prediction::{Equilibrium, Method};
use std::fmt::Write as _;
use std::io::Write as _;
use std::path::PathBuf;
use std::process::ExitCode;
use std::sync::Arc;

/// The picture has a sample about every so often, s.
const SAMPLE_S: f64 = 5e-3;

/// Which hand, how it is moved and where the picture goes.
#[derive(Debug, Args)]
pub struct ShowArgs {
    /// A URDF file, a folder or .zip with one, or the name of a hand that comes with the program
    hand: String,
    /// Draw a picture into this file; a name that ends in .svg or .png
    #[arg(long, short, alias = "out", value_name = "FILE")]
    output: Option<PathBuf>,
    /// Motor positions to close to, from 0 (open) to 1: one for all motors, or one for each
    #[arg(long, requires = "output", value_delimiter = ',', value_parser = parse_sigma, default_value = "0.6")]
    sigma: Vec<f64>,
    /// A constant force on a link's centre of mass once the hand has closed: link:fx,fy,fz in N, world frame.
    /// The hand stands with its base frame on the world's
    #[arg(long, requires = "output", value_name = "LINK:FX,FY,FZ", allow_hyphen_values = true)]
    push: Vec<PushArg>,
}

/// One stage of the motion: closing, or being pushed.
struct Phase {
    name: &'static str,
    /// s
    from: f64,
    to: f64,
    /// The hand's coordinates at `to`.
    at_end: Vec<f64>,
    predicted: Option<Equilibrium>,
    /// Largest |q − predicted| at rest.
    error: Option<f64>,
    /// Why no prediction applies.
    beyond: Vec<String>,
    /// Why the hand was not simulated until it rests.
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
    fn sample(&mut self, alone: &Alone) {
        let t = alone.time_s();
        if self.time.last().is_none_or(|last| t - last >= SAMPLE_S * (1.0 - 1e-9)) {
            self.time.push(t);
            self.q.push(alone.state().q.clone());
            self.tension.push(alone.state().tension.clone());
        }
    }
}

/// Simulates, draws and prints what was drawn.
pub(crate) fn show(args: &ShowArgs) -> anyhow::Result<ExitCode> {
    let found = load_hand(&args.hand);
    let hand = found.with_context(|| hint(&args.hand).unwrap_or_else(|| args.hand.clone()))?.hand;
    let mut out = std::io::stdout().lock();
    let Some(file) = &args.output else {
        write!(out, "{}", describe(&hand))?;
        return Ok(ExitCode::SUCCESS);
    };
    let sigma = one_per_motor(&hand, &args.sigma)?;
    let pushes = args.push.iter().map(|push| push.on(&hand)).collect::<anyhow::Result<Vec<Push>>>()?;
    let mut alone = Alone::new(&hand)?;
    let mut trace = Trace::default();
    trace.sample(&alone);
    let mut left = CLOSING_WORK;
    let mut phases = vec![phase(&mut alone, "closed", &sigma, &mut trace, &mut left)];
    if !pushes.is_empty() && phases[0].broken_off.is_none() {
        alone.set_pushes(&pushes);
        phases.push(phase(&mut alone, "pushed", &sigma, &mut trace, &mut left));
    }
    let figure = figure(&hand, &sigma, &pushes, &trace, &phases);
    draw(&figure, file)?;
    write!(out, "{}", summary(&phases))?;
    writeln!(out, "wrote {}", file.display())?;
    let broken = phases.iter().find_map(|phase| Some((phase.name, phase.broken_off?)));
    if let Some((name, why)) = broken {
        let sigmas = sigma.iter().map(|s| short(*s)).collect::<Vec<_>>().join(", ");
        bail!("hand '{}': {name} at σ = {sigmas}: {why}", hand.name);
    }
    Ok(ExitCode::SUCCESS)
}

fn one_per_motor(hand: &Hand, sigma: &[f64]) -> anyhow::Result<Vec<f64>> {
    let motors = hand.motors.len();
    match sigma {
        [one] => Ok(vec![*one; motors]),
        each if each.len() == motors => Ok(each.to_vec()),
        _ => bail!("--sigma has {} values; valid: one for all motors, or {motors}", sigma.len()),
    }
}

/// Steps until nothing is seen to move; then, off the record, until the hand rests to compare.
fn phase(alone: &mut Alone, name: &'static str, sigma: &[f64], trace: &mut Trace, left: &mut u64) -> Phase {
    let from = alone.time_s();
    let mut rest = alone.settle(sigma, AT_SIGHT, left, |alone| trace.sample(alone));
    let to = alone.time_s();
    let before = alone.state().clone();
    let mut at_end = before.q.clone();
    if let Err(Restless::BrokenOff(_)) = rest {
        // What a world failed with may be no numbers.
        at_end.clone_from(trace.q.last().unwrap_or(&before.q));
    } else {
        rest = alone.settle(sigma, AT_REST, left, |_| {});
    }
    let broken_off = match rest {
        Err(Restless::BrokenOff(why)) => Some(why),
        _ => None,
    };
    let Comparison { predicted, error, beyond } = compare(alone, sigma, &rest);
    alone.restore(before);
    Phase { name, from, to, at_end, predicted, error, beyond, broken_off }
}

fn figure(hand: &Arc<Hand>, sigma: &[f64], pushes: &[Push], trace: &Trace, phases: &[Phase]) -> Figure {
    let predicted = |value: &dyn Fn(&Equilibrium) -> f64| -> Vec<(f64, f64, f64)> {
        let known = phases.iter().filter_map(|p| Some((p, p.predicted.as_ref()?)));
        known
            .map(|(p, e)| {
                // The first dashes begin while the motors are on their way.
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
    notes.extend(phases.iter().map(outcome));
    let open = look(hand, &trace.q[0], "open".into());
    let ends = phases.iter().map(|phase| look(hand, &phase.at_end, phase.name.to_owned()));
    Figure {
        views: std::iter::once(open).chain(ends).collect(),
        title: format!("{}, σ = {sigmas}", hand.name),
        notes,
        time: trace.time.clone(),
        marks: phases.iter().skip(1).map(|p| (p.from, p.name.to_owned())).collect(),
        panels,
    }
}

/// One line about a phase.
fn outcome(phase: &Phase) -> String {
    let first = |reasons: &[String]| match reasons {
        [] => String::new(),
        [only] => format!(": {only}"),
        [first, more @ ..] => format!(": {first}, and {} more", more.len()),
    };
    let name = phase.name;
    match (&phase.predicted, phase.error) {
        (Some(predicted), Some(error)) if phase.beyond.is_empty() => {
            let law = match predicted.method {
                Method::ClosedForm => "closed form".to_owned(),
                Method::Newton => format!("Newton's method{}", first(&predicted.beyond_closed_form)),
            };
            format!("{name}: largest |q − predicted| at rest {error:.1e} ({law})")
        }
        _ => format!("{name}: no prediction applies{}", first(&phase.beyond)),
    }
}

fn summary(phases: &[Phase]) -> String {
    let mut out = String::new();
    for phase in phases {
        let _ = writeln!(out, "{}", outcome(phase));
    }
    out
}
