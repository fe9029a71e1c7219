//! `palmares-bench`: run a case, print its speed and its error.

use anyhow::{Result, ensure};
use clap::{Parser, Subcommand};
use palmares_bench::cameras;
use palmares_bench::cases::grasp::Placement;
use palmares_bench::cases::{self, Setup};
use palmares_bench::child;
use palmares_bench::engine::EngineKind;
use palmares_bench::grasps;
use palmares_bench::mjcf;
use palmares_bench::report;
use palmares_bench::robust::{self, heaps, placements};
use std::path::PathBuf;

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
    /// Count how often random or varied scenes go well.
    Robust {
        /// Try the grid of placements of the grasp cases: kept through lift, hold and shaking at every step?
        #[arg(long)]
        placements: bool,
        /// With `--placements`: try every step even after one has failed.
        #[arg(long)]
        every_step: bool,
        /// Play this many random grasps, randomly disturbed.
        #[arg(long)]
        grasps: Option<u32>,
        /// Drop and kick this many random heaps of objects, and print the worst that was seen.
        #[arg(long)]
        piles: Option<u32>,
        /// Seed of the random grasps and heaps; the default is that of the tests.
        #[arg(long, default_value_t = robust::SEED)]
        seed: u64,
        /// With `--piles`: step, s.
        #[arg(long, default_value_t = 2e-3)]
        dt: f64,
        /// With `--piles`: how long each runs, s.
        #[arg(long, default_value_t = 0.5)]
        time: f64,
    },
    /// Count the grasps that engines keep, over drawn objects and placements and several steps.
    Grasps(grasps::command::Options),
    /// How long do cameras' pictures take, by pixels and objects?
    Cameras(cameras::Options),
    /// Write a task's scene as a file for MuJoCo, with what drives it.
    Mjcf(mjcf::Options),
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
        /// Named settings of a peer; what there is, and why, is in the report.
        #[arg(long)]
        settings: Option<String>,
        /// Which start: 0 is the scene as it is, in the others objects stand up to 0.1 mm aside.
        #[arg(long, default_value_t = 0)]
        start: u32,
        /// Print one JSON object instead of text.
        #[arg(long)]
        json: bool,
        /// Step of the reference run of cases without an analytic answer, s; 0 leaves it out.
        #[arg(long, default_value_t = 2e-5)]
        reference_dt: f64,
    },
    /// Compare the engines over scenes and steps, and write a report with tables, plots and JSON.
    Report {
        /// Peers to compare with, by commas.
        #[arg(long, value_delimiter = ',', default_value = "own,rapier,mujoco")]
        engines: Vec<String>,
        /// Gather outcomes into the file and time nothing: beside other work. The report that follows takes them from there.
        #[arg(long)]
        outcomes_only: bool,
        #[command(flatten)]
        options: report::Options,
    },
    /// Judge the runs of a report's JSON again, and write its page and pictures anew, without running anything.
    Page {
        /// The file.
        report: PathBuf,
    },
    /// Does what README.md and docs/physics.md say of the peers agree with the committed reports? Fails if not.
    Claims {
        /// Write it anew instead.
        #[arg(long)]
        write: bool,
        /// The repository.
        #[arg(long, default_value = ".")]
        root: PathBuf,
    },
    /// Play what the program that started this one asks for.
    #[command(name = child::COMMAND, hide = true)]
    Child,
    /// Read a report's JSON: is a peer ahead of ours anywhere at an equal or smaller error? Fails if so.
    Check {
        /// The file.
        report: PathBuf,
    },
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        What::List => {
            for case in cases::all() {
                println!("{:<24}{}", case.name, case.about);
            }
        }
        What::Fingerprint => println!("{}", palmares_bench::fingerprint::balls(false)?),
        What::Robust { placements, every_step, grasps, piles, seed, dt, time } => {
            if placements {
                robust_placements(every_step)?;
            }
            if let Some(count) = grasps {
                let worst = robust::grasps::check(seed, count)?;
                println!("{count} disturbed grasps, 3 s at 1 to 8 ms, seed {seed}: all hold. {worst:#?}");
            }
            if let Some(count) = piles {
                let (worst, ms) = (heaps::check(seed, count, dt, time)?, dt * 1e3);
                println!(
                    "{count} heaps of 3 to 12 objects, {time} s at {ms} ms, seed {seed}: all hold. {worst:#?}"
                );
            }
        }
        What::Cameras(options) => cameras::run(&options)?,
        What::Mjcf(options) => mjcf::run(&options)?,
        What::Grasps(options) => grasps::command::run(&options)?,
        What::Report { engines, outcomes_only, mut options } => {
            for name in engines {
                options.engines.extend(EngineKind::with_all_settings(&name)?);
            }
            if outcomes_only {
                report::runner::gather(&options)?;
            } else {
                report::write(&options)?;
            }
        }
        What::Page { report } => report::runner::rewrite(&report)?,
        What::Claims { write: true, root } => report::claims::write(&root)?,
        What::Claims { write: false, root } => {
            let stale = report::claims::stale(&root)?;
            ensure!(stale.is_empty(), "{}: `palmares-bench claims --write` writes it anew", stale.join(", "));
        }
        What::Child => child::serve()?,
        What::Check { report } => report::runner::check(&report)?,
        What::Case { name, dt, engine, settings, start, json, reference_dt } => {
            let reference_dt_s = (reference_dt > 0.0).then_some(reference_dt);
            let engine = EngineKind::from_names(&engine, settings.as_deref())?;
            let setup = Setup { engine, dt_s: dt, reference_dt_s, start };
            let (report, recorder) = cases::run(&name, &setup)?;
            if json {
                println!("{}", serde_json::to_string(&report)?);
            } else {
                let (mean, most) = recorder.newton();
                let t = report.us_per_step;
                println!(
                    "{} on {} ({}) at {} ms",
                    report.case,
                    report.engine,
                    report.settings,
                    report.dt_s * 1e3
                );
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

fn robust_placements(every_step: bool) -> Result<()> {
    let grid = placements::grid();
    let mut good = 0;
    for placement in &grid {
        let seen = placements::outcomes(*placement, !every_step)?;
        let all = seen.len() == placements::STEPS_S.len() && seen.iter().all(|kept| *kept == [true; 2]);
        good += usize::from(all);
        let marks: Vec<String> = placements::STEPS_S
            .iter()
            .zip(&seen)
            .map(|(dt, [cylinder, cuboid])| {
                let mark = |kept: bool| if kept { '+' } else { '-' };
                format!("{} ms {}{}", dt * 1e3, mark(*cylinder), mark(*cuboid))
            })
            .collect();
        let Placement { along_m, across_m, sigma } = placement;
        println!("along {along_m:.3} across {across_m:+.3} sigma {sigma:.2}: {}", marks.join(", "));
    }
    println!("{good} of {} placements keep cylinder and box at every step", grid.len());
    Ok(())
}
