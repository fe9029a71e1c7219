//! The report as a page to read.

use super::comparison::{Comparison, Run};
use super::plots::{at_one_ms, cases, largest_usable, picture};
use super::runner::LONGEST_S;
use crate::cases as scenes;
use std::fmt::Write;

/// Markdown.
pub(super) fn write(report: &Comparison) -> String {
    let mut page = String::new();
    head(&mut page, report);
    dominance(&mut page, report);
    stable(&mut page, report);
    ticks(&mut page, report);
    split(&mut page, report);
    settings(&mut page, report);
    for case in cases(report) {
        scene(&mut page, report, case);
    }
    page
}

/// Writing into a string cannot fail.
macro_rules! put {
    ($page:expr, $($argument:tt)*) => {{ let _ = writeln!($page, $($argument)*); }};
}

fn head(page: &mut String, report: &Comparison) {
    let machine = &report.machine;
    let load = machine.load.map_or(String::new(), |load| format!(", load {load:.1} at the beginning"));
    put!(page, "# Speed against error\n");
    put!(
        page,
        "Written by `cargo xtask report{}`; do not edit.\n",
        if report.quick { " --quick" } else { "" }
    );
    put!(
        page,
        "Commit {}; {}, {} threads, {}{load}; {:.0} s.\n",
        report.commit,
        machine.processor,
        machine.threads,
        machine.system,
        report.took_s
    );
    put!(
        page,
        "**How to read it.** Every scene runs with every step on every engine that can do it. The *error* is \
        that against the analytic answer or, where there is none, against the same scene on the same engine with a \
        far smaller step: then it says how much an engine's outcome depends on the step, not who is right. *CPU \
        time* is that of the stepping thread for one simulated second, the median of {} runs, without reading poses, \
        writing commands and reading the clock; errors and timings come from separate passes; in the latter the engines take turns, and a run ends after {LONGEST_S} s of CPU. MuJoCo's runs are played again in one \
        tight loop of its own, without the pipe. A run *can be used* if all numbers \
        stay finite, no step fails, an object that is to be held is held, and the error is below 0.2 rad, 30 mm or \
        50 %. Errors below 1 nrad, 0.1 µm and 0.001 % count as equal. Where a scene only asks that \
        something stays within a bound (*at most* in its table), a run beyond it cannot be used, and within it speed \
        alone decides. A run of a peer, or its \
        reference, that takes more than {} s by the clock on the wall is *not finished* and judged by nothing.\n",
        report.repeats,
        report.run_limit_s
    );
    if report.quick {
        put!(page, "This is a quick report: few cases and steps, coarse references.\n");
    }
    for left_out in &report.left_out {
        put!(page, "- left out: {left_out}");
    }
    for note in report.engines.iter().filter(|note| !note.ran) {
        put!(page, "- {} did not run: {}", note.name, note.version);
    }
    page.push('\n');
}

fn dominance(page: &mut String, report: &Comparison) {
    if report.verdicts.is_empty() {
        return;
    }
    let ahead = report.verdicts.iter().filter(|verdict| !verdict.holds()).count();
    put!(page, "## Is a peer ever ahead?\n");
    put!(
        page,
        "For every usable run of a peer: is there a run of ours with at most its error in at most its time? \
        In {} of {} comparisons there always is. `palmares-bench check` with the path of this folder's `report.json` \
        prints this table and fails where there is not.\n",
        report.verdicts.len() - ahead,
        report.verdicts.len()
    );
    put!(page, "| scene | peer | its usable steps | ours | verdict |\n|---|---|---|---|---|");
    for v in &report.verdicts {
        let (usable, own, words) = (v.usable, v.own_usable, v.words());
        put!(page, "| {} | {} | {usable} of {} | {own} | {words} |", v.case, v.peer, v.tried);
    }
    page.push('\n');
}

fn stable(page: &mut String, report: &Comparison) {
    if report.verdicts.is_empty() {
        return;
    }
    put!(page, "## Largest usable step\n\n![largest usable step](stable.svg)\n");
}

fn ticks(page: &mut String, report: &Comparison) {
    put!(page, "## Emulated transmission against plain actuation\n");
    put!(
        page,
        "The 2016 paper's Fig. 5: the time of every 10 ms tick while the hand closes on a pan and lifts it, \
        with the tendon's transmission and with a servo on every joint (steps of 1 ms).\n"
    );
    put!(page, "| actuation | mean tick | worst tick | pan lifted |\n|---|---|---|---|");
    for way in &report.ticks {
        let mean = way.ms.iter().sum::<f64>() / way.ms.len().max(1) as f64;
        let worst = way.ms.iter().fold(0.0, |most: f64, ms| most.max(*ms));
        let lifted = if way.lifted { "yes" } else { "no" };
        put!(page, "| {} | {mean:.3} ms | {worst:.3} ms | {lifted} |", way.about);
    }
    put!(page, "\n![time of every tick](ticks.svg)\n");
}

fn split(page: &mut String, report: &Comparison) {
    put!(page, "## Where our time goes\n\nThe bars grow with the square root of the time.\n");
    put!(page, "![time split](split.svg)\n");
    put!(
        page,
        "| scene | µs a step | dynamics | collision | solver | slowest step |\n|---|---|---|---|---|---|"
    );
    for run in cases(report).into_iter().filter_map(|case| at_one_ms(report, case)) {
        let t = &run.us_per_step;
        put!(
            page,
            "| {} at {} ms | {:.1} | {:.1} | {:.1} | {:.1} | {:.0} |",
            run.case,
            run.dt_ms,
            t.total,
            t.dynamics,
            t.collision,
            t.solver,
            t.worst
        );
    }
    page.push('\n');
}

fn settings(page: &mut String, report: &Comparison) {
    put!(page, "## The engines and their settings\n");
    for note in report.engines.iter().filter(|note| note.ran) {
        put!(page, "**{}** {}; reference runs at {} ms", note.name, note.version, note.reference_ms);
        for line in &note.settings {
            put!(page, "- {line}");
        }
        page.push('\n');
    }
}

fn scene(page: &mut String, report: &Comparison, case: &str) {
    let about = scenes::all().find(|it| it.name == case).map_or("", |it| it.about);
    put!(page, "## {case}\n\n{about}\n\n![{case}]({})\n", picture(case));
    let engines: Vec<&str> = report.engines.iter().filter(|note| note.ran).map(|note| &*note.name).collect();
    let runs: Vec<&Run> = report.runs.iter().filter(|run| run.case == case).collect();
    let figure = runs.iter().find_map(|run| run.error.as_ref());
    let (name, unit) = figure.map_or(("error", ""), |figure| (&figure.name, &figure.unit));
    let most =
        figure.and_then(|figure| figure.within).map_or(String::new(), |most| format!(", at most {most}"));
    put!(
        page,
        "| engine | step | {name} [{unit}]{most} | CPU ms a second | between | times real time | deepest overlap |"
    );
    put!(page, "|---|---|---|---|---|---|---|");
    for engine in &engines {
        runs.iter().filter(|run| run.engine == *engine).for_each(|run| row(page, run));
    }
    page.push('\n');
    let largest =
        engines.iter().filter(|engine| runs.iter().any(|run| run.engine == **engine)).map(|engine| {
            let largest = largest_usable(report, case, engine);
            format!("{engine} {}", largest.map_or("none".to_owned(), |dt| format!("{dt} ms")))
        });
    put!(page, "Largest usable step: {}.\n", largest.collect::<Vec<_>>().join(", "));
}

fn row(page: &mut String, run: &Run) {
    let value = run.error.as_ref().and_then(|figure| figure.value);
    let value = value.map_or("–".to_owned(), |x| format!("{x:.2e}"));
    let trouble = run.trouble.as_ref().map_or(String::new(), |why| format!(" ({why})"));
    let depth = run.invariants.max_penetration_mm.map_or("–".to_owned(), |mm| format!("{mm:.3} mm"));
    if run.cpu_s > 0.0 {
        let [least, most] = run.cpu_s_between.map(|s| 1e3 * s);
        put!(
            page,
            "| {} | {} ms | {value}{trouble} | {:.2} | {least:.2} … {most:.2} | {:.0} | {depth} |",
            run.engine,
            run.dt_ms,
            1e3 * run.cpu_s,
            1.0 / run.cpu_s
        );
    } else {
        put!(page, "| {} | {} ms | {value}{trouble} | – | – | – | {depth} |", run.engine, run.dt_ms);
    }
}
