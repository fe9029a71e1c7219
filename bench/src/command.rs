//! The command `case`, which both programs have: ours plays its own engine, `palmares-compare` any.

use crate::cases::{self, Setup};
use crate::engine::EngineFactory;
use crate::rigs;
use anyhow::Result;
use clap::Args;

/// The case, its setup and its output.
#[derive(Args, Clone, Debug)]
pub struct CaseOptions {
    /// Name of the case; `palmares-bench list` prints them.
    name: String,
    /// Step, s.
    #[arg(long, default_value_t = 1e-3)]
    dt: f64,
    /// Start of the scene: 0 is the scene as it is, in the others objects are up to 0.1 mm aside.
    #[arg(long, default_value_t = 0)]
    start: u32,
    /// Print one JSON object instead of text.
    #[arg(long)]
    json: bool,
    /// Step of the reference run of cases without an analytic answer, s; 0 leaves it out.
    #[arg(long, default_value_t = 2e-5)]
    reference_dt: f64,
    /// Hand of the cases that measure one, by name or by the path of a folder; the case's own if not given.
    #[arg(long)]
    hand: Option<String>,
}

impl CaseOptions {
    /// Runs the case on an engine and prints its report.
    ///
    /// # Errors
    /// There is no such case, the step is out of range, or the engine fails.
    pub fn run(&self, engine: &'static dyn EngineFactory) -> Result<()> {
        let reference_dt_s = (self.reference_dt > 0.0).then_some(self.reference_dt);
        // A setup is copied to every scene of a case, and the program ends with the case.
        let hand = match &self.hand {
            Some(name) => Some(&*Box::leak(Box::new(rigs::hand(name)?))),
            None => None,
        };
        let setup = Setup { engine, dt_s: self.dt, reference_dt_s, start: self.start, hand };
        let (report, recorder) = cases::run(&self.name, &setup)?;
        if self.json {
            println!("{}", serde_json::to_string(&report)?);
            return Ok(());
        }
        let (mean, most) = recorder.newton();
        let t = report.us_per_step;
        println!("{} on {} ({}) at {} ms", report.case, report.engine, report.settings, report.dt_s * 1e3);
        println!("  speed      {:.1} x real time, {:.1} us per step", report.rtf, t.total);
        println!(
            "  split      dynamics {:.1}, collision {:.1}, solver {:.1}, worst {:.0} us",
            t.dynamics, t.collision, t.solver, t.worst
        );
        println!("  Newton     {mean:.2} iterations on average, {most} at most");
        let value = report.error.value.map_or("not computed".into(), |x| format!("{x:.3e}"));
        println!("  {:<10} {value} {}", report.error.name, report.error.unit);
        for measured in &report.measured {
            print!("{measured}");
        }
        println!("  invariants {}", serde_json::to_string(&report.invariants)?);
        Ok(())
    }
}
