//! `palmares-bench`: run a case, print its speed and its error.

use anyhow::Result;
use clap::{Parser, Subcommand};
use palmares_bench::cases::{self, Setup};
use palmares_bench::engine::EngineKind;

/// Speed against error of the hand emulator.
#[derive(Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    command: What,
}

#[derive(Subcommand)]
enum What {
    /// List the cases.
    List,
    /// Print the state hash of five scripted seconds of balls: the same for every build and machine.
    Fingerprint,
    /// Run one case and print its report.
    Case {
        /// Name of the case; see `palmares-bench list`.
        name: String,
        /// Step, s.
        #[arg(long, default_value_t = 1e-3)]
        dt: f64,
        /// Engine to run it on.
        #[arg(long, default_value = "own")]
        engine: String,
        /// Print one JSON object instead of text.
        #[arg(long)]
        json: bool,
        /// Step of the reference run of cases without an analytic answer, s; 0 leaves it out.
        #[arg(long, default_value_t = 2e-5)]
        reference_dt: f64,
    },
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        What::List => {
            for case in cases::all() {
                println!("{:<24}{}", case.name, case.about);
            }
        }
        What::Fingerprint => println!("{}", palmares_bench::fingerprint::balls()?),
        What::Case { name, dt, engine, json, reference_dt } => {
            let reference_dt_s = (reference_dt > 0.0).then_some(reference_dt);
            let setup = Setup { engine: EngineKind::from_name(&engine)?, dt_s: dt, reference_dt_s };
            let (report, recorder) = cases::run(&name, &setup)?;
            if json {
                println!("{}", serde_json::to_string(&report)?);
            } else {
                let (mean, most) = recorder.newton();
                let t = report.us_per_step;
                println!("{} on {} at {} ms", report.case, report.engine, report.dt_s * 1e3);
                println!("  speed      {:.1} x real time, {:.1} us per step", report.rtf, t.total);
                println!(
                    "  split      dynamics {:.1}, collision {:.1}, solver {:.1}, worst {:.0} us",
                    t.dynamics, t.collision, t.solver, t.worst
                );
                println!("  Newton     {mean:.2} iterations on average, {most} at most");
                let value = report.error.value.map_or("not computed".into(), |x| format!("{x:.3e}"));
                println!("  {:<10} {value} {}", report.error.name, report.error.unit);
                println!("  invariants {}", serde_json::to_string(&report.invariants)?);
            }
        }
    }
    Ok(())
}
