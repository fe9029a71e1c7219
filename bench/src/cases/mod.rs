//! The cases, by name.

pub mod balls;
pub mod friction;
pub mod grasp;
pub mod synergy;

use crate::recorder::Recorder;
use crate::report::{Figure, Invariants, Report};
use anyhow::{Result, bail};

/// What a case returns beside its times.
pub struct Finding {
    /// The case's own figure.
    pub error: Figure,
    /// Its checks.
    pub invariants: Invariants,
}

/// How to run a case.
#[derive(Clone, Copy, Debug)]
pub struct Setup {
    /// Step, s.
    pub dt_s: f64,
    /// Step of the reference run for cases without an analytic answer; `None` leaves it out.
    pub reference_dt_s: Option<f64>,
}

/// A named case.
pub struct Case {
    /// Its name.
    pub name: &'static str,
    /// One line.
    pub about: &'static str,
    run: fn(&Setup, &mut Recorder) -> Result<Finding>,
}

/// Every case there is.
pub const CASES: &[Case] = &[
    Case {
        name: "softhand_free",
        about: "SoftHand closes on air; joint error against the reference while it moves",
        run: synergy::free,
    },
    Case {
        name: "softhand_cylinder",
        about: "SoftHand closes on a 0.1 kg cylinder, lifts, holds and shakes it",
        run: grasp::cylinder,
    },
    Case {
        name: "softhand_box",
        about: "SoftHand closes on a 0.5 kg box, lifts, holds and shakes it",
        run: grasp::cuboid,
    },
    Case {
        name: "softhand_balls",
        about: "SoftHand reaches into a box of ten 1 kg balls, closes and lifts; self-collision on",
        run: balls::softhand_balls,
    },
    Case {
        name: "syn_free_close",
        about: "SoftHand closed on air at rest against the closed form of adaptive synergies",
        run: synergy::free_close,
    },
    Case {
        name: "syn_push_locked_motor",
        about: "closed SoftHand, motor locked, 1 N on the index fingertip, against the closed form",
        run: synergy::push_locked_motor,
    },
    Case {
        name: "incline_critical",
        about: "block on a slope of 0.99 mu (creep) and 1.2 mu (acceleration)",
        run: friction::incline_critical,
    },
    Case {
        name: "slide_stop",
        about: "cube thrown along a floor in three directions stops after v0^2/(2 mu g)",
        run: friction::slide_stop,
    },
    Case {
        name: "rolling_cylinder",
        about: "cylinder rolls along a floor for 10 s and keeps its energy",
        run: friction::rolling_cylinder,
    },
];

/// Runs one case.
pub fn run(name: &str, engine: &str, setup: &Setup) -> Result<(Report, Recorder)> {
    let Some(case) = CASES.iter().find(|case| case.name == name) else {
        let names: Vec<&str> = CASES.iter().map(|case| case.name).collect();
        bail!("unknown case `{name}`; known cases: {}", names.join(", "));
    };
    if engine != "own" {
        bail!("unknown engine `{engine}`; known engines: own");
    }
    if !(setup.dt_s > 0.0 && setup.dt_s <= 0.1) {
        bail!("step {} s is out of range; it must be positive and at most 0.1 s", setup.dt_s);
    }
    let mut recorder = Recorder::default();
    let finding = (case.run)(setup, &mut recorder)?;
    let report = Report {
        case: name.to_owned(),
        engine: engine.to_owned(),
        dt_s: setup.dt_s,
        rtf: recorder.rtf(setup.dt_s),
        us_per_step: recorder.times(),
        error: finding.error,
        invariants: finding.invariants,
    };
    Ok((report, recorder))
}

/// Quintic ramp from 0 to 1 over x in [0, 1], and its slope: smooth in velocity and acceleration.
pub fn ramp(x: f64) -> (f64, f64) {
    let x = x.clamp(0.0, 1.0);
    (x * x * x * (10.0 - 15.0 * x + 6.0 * x * x), 30.0 * x * x * (1.0 - x) * (1.0 - x))
}

/// Number of steps of `dt_s` in `time_s`.
pub fn steps(time_s: f64, dt_s: f64) -> u64 {
    (time_s / dt_s).round() as u64
}
