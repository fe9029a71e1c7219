//! `palmares-bench`: runs a case, prints its speed and its error.

use anyhow::Result;
use clap::{Args, Parser, Subcommand};
use palmares_bench::cases;
use palmares_bench::cases::grasp::Placement;
use palmares_bench::command::CaseOptions;
use palmares_bench::engine::OwnFactory;
use palmares_bench::hard_cases::HardCasesOptions;
use palmares_bench::record::{Record, list};
use palmares_bench::rigs;
use palmares_bench::robust::{self, heaps, placements};
use palmares_bench::study::StudyOptions;
use palmares_bench::sweep::SweepOptions;
use palmares_models::builtin::builtin_hands;
use palmares_tasks::identity;

/// Cases of the physics with known answers. `palmares-compare` plays them on other engines.
#[derive(Parser)]
#[command(version, about)]
struct Arguments {
    #[command(subcommand)]
    command: Command,
}

#[derive(Subcommand)]
enum Command {
    /// List the cases.
    List,
    /// Print the state hashes of the reference runs: the same for every build and machine.
    Fingerprint,
    /// Print the line that a page of measured results has: engine, models, commit, day and machine.
    Record {
        /// The part of the pages; docs/pages-of-record.md lists them.
        part: String,
        /// Only what the pages of the part depend on.
        #[arg(long)]
        fingerprint: bool,
    },
    /// Compare docs/pages-of-record.md with the pages; fails if it differs, or if a page has no record.
    Pages {
        /// Write it anew instead.
        #[arg(long)]
        write: bool,
    },
    /// Count the random or varied scenes that succeed.
    Robust(RobustOptions),
    /// Play cases at many steps and print how far they are from their bounds: hours for all of them at 200 steps.
    Sweep(SweepOptions),
    /// Play the hard cases at ten steps from up to eight starts, and print how far they are from their bounds.
    HardCases(HardCasesOptions),
    /// Show the parts, laws and times of known scenes, and what is worse without each law: 6 minutes on two cores.
    Model(StudyOptions),
    /// Run one case and print its report.
    Case(CaseOptions),
}

#[derive(Args)]
struct RobustOptions {
    /// Try the grid of placements of the grasp cases, and print which are kept through lift, hold and shaking
    /// at every step.
    #[arg(long)]
    placements: bool,
    /// With `--placements`: try every step even after one has failed.
    #[arg(long)]
    every_step: bool,
    /// Play this many random grasps, randomly disturbed.
    #[arg(long)]
    grasps: Option<u32>,
    /// Drop and kick this many random heaps of objects, and print the worst one.
    #[arg(long)]
    piles: Option<u32>,
    /// Give each built-in hand random commands, over this many seeds, on all cores.
    #[arg(long)]
    hands: Option<u64>,
    /// With `--hands`: only these hands, by name or by the path of a folder; can be repeated.
    #[arg(long)]
    hand: Vec<String>,
    /// With `--hands`: duration of each run, s.
    #[arg(long, default_value_t = 30.0)]
    seconds: f64,
    /// Seed of the random grasps, heaps and commands; the default is that of the tests.
    #[arg(long, default_value_t = robust::SEED)]
    seed: u64,
    /// With `--piles`: step, s.
    #[arg(long, default_value_t = 2e-3)]
    dt: f64,
    /// With `--piles`: duration of each, s.
    #[arg(long, default_value_t = 0.5)]
    time: f64,
}

fn main() -> Result<()> {
    match Arguments::parse().command {
        Command::List => {
            for case in cases::all() {
                println!("{:<24}{}", case.name, case.about);
            }
            Ok(())
        }
        Command::Fingerprint => {
            for run in identity::REFERENCE_RUNS {
                println!("{} {}", run.name, run.play(false)?);
            }
            Ok(())
        }
        Command::Record { part, fingerprint: true } => {
            println!("{}", list::fingerprint(&part)?);
            Ok(())
        }
        Command::Record { part, fingerprint: false } => {
            println!("{}", Record::now(&part)?.line());
            Ok(())
        }
        Command::Pages { write } => list::check(write),
        Command::Robust(options) => robust(&options),
        Command::Sweep(options) => options.run(),
        Command::HardCases(options) => options.run(),
        Command::Model(options) => options.run(),
        Command::Case(options) => options.run(&OwnFactory),
    }
}

fn robust(options: &RobustOptions) -> Result<()> {
    let RobustOptions { placements, every_step, grasps, piles, hands, ref hand, seconds, seed, dt, time } =
        *options;
    if placements {
        robust_placements(every_step)?;
    }
    if let Some(count) = hands {
        robust_hands(hand, seed, count, seconds)?;
    }
    if let Some(count) = grasps {
        let worst = robust::grasps::check(seed, count)?;
        println!("{count} disturbed grasps, 3 s at 1 to 8 ms, seed {seed}: all hold. {worst:#?}");
    }
    if let Some(count) = piles {
        let (worst, ms) = (heaps::check(seed, count, dt, time)?, dt * 1e3);
        println!("{count} heaps of 3 to 12 objects, {time} s at {ms} ms, seed {seed}: all hold. {worst:#?}");
    }
    Ok(())
}

fn robust_hands(names: &[String], seed: u64, count: u64, seconds: f64) -> Result<()> {
    let hands = match names {
        [] => builtin_hands().to_vec(),
        names => names.iter().map(|name| rigs::hand(name)).collect::<Result<_>>()?,
    };
    for hand in hands {
        let worst = robust::commands::check(&hand, seed, count, seconds)?;
        println!(
            "{}: {} runs of {seconds} s of random commands, seed {seed}: no fault; largest excess over a limit {:.4} rad or m, \
             fastest joint {:.1} rad/s or m/s, fastest object {:.2} m/s",
            hand.name, worst.runs, worst.limit_excess, worst.joint_rate, worst.object_speed
        );
    }
    Ok(())
}

fn robust_placements(every_step: bool) -> Result<()> {
    let grid = placements::grid();
    let mut good = 0;
    for placement in &grid {
        let outcomes = placements::outcomes(*placement, !every_step)?;
        let all =
            outcomes.len() == placements::STEPS_S.len() && outcomes.iter().all(|kept| *kept == [true; 2]);
        good += usize::from(all);
        let marks: Vec<String> = placements::STEPS_S
            .iter()
            .zip(&outcomes)
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
