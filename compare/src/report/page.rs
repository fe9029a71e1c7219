//! The report as a page to read.

use super::comparison::{Choice, Comparison, OTHERWISE_MM, Run, Sentinels, Starts};
use super::dominance::{PeerResult, SettingsResult, Verdict};
use super::passes::{BY_STARTS, ENOUGH_S, FEW_STARTS, LONGEST_S, STARTS};
use super::plots::{at_one_ms, cases, largest_usable, picture, without};
use crate::peer_key::Kept;
use palmares_bench::cases::{self as scenes, ASIDE_M};
use palmares_bench::rigs::softhand_in_words;
use palmares_bench::{overlap, record};
use std::collections::BTreeMap;
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
    let hand = softhand_in_words();
    let load =
        report.record.machine.load.map_or(String::new(), |load| format!("Load {load:.1} at the beginning; "));
    put!(page, "# {}\n", title(&report.part));
    put!(
        page,
        "Written by `cargo xtask report{}`; do not edit.\n",
        if report.quick { " --quick" } else { "" }
    );
    put!(page, "{}\n\n{load}{:.0} s.\n", report.record.line(), report.took_s);
    put!(
        page,
        "Every engine that can do a scene plays it at every step, a peer with each of its \
        [settings](#the-engines-and-their-settings) that can end otherwise there. {hand} How to read the tables:\n",
    );
    let (repeats, limit_s, limit_by) = (report.repeats, report.run_limit_s, report.run_limit_by.words());
    for line in [
        "*Does it*: all numbers stay finite and no step fails. An object that is to be held is held. A figure with a bound (*at \
         most* in its table) stays within it. An error against an analytic answer is below 0.2 rad, 30 mm, 15 mm/s or half of \
         what is measured."
            .to_owned(),
        format!(
            "*Overlap*: no two shapes overlap by more than {} of the width of the thinnest body that moves, object or link. A body \
             that has sunk in so far is pushed out through the far side. A scene that begins with a deeper overlap may deepen it \
             by a tenth.",
            overlap::PART
        ),
        "*Differs from its own fine run*: where there is no analytic answer, the figure is the difference from the same scene on \
         the same engine with a far smaller step. It says how much an outcome depends on the step, not which engine is right, and \
         makes no run useless. More than a metre apart a run *ends otherwise*."
            .to_owned(),
    ]
    .into_iter()
    .chain(starts(report))
    .chain([
        format!(
            "*CPU time*: that of the stepping thread for one simulated second, the median of {repeats} runs, fewer where they take \
             more than {ENOUGH_S} s. It has no start of a process, no reading of poses and clocks, no writing of commands. Only what \
             does its scene is timed. The engines take turns, and a run ends after {LONGEST_S} s of CPU. MuJoCo's and \
             Drake's runs are played again in a tight loop of their own, without the pipe."
        ),
        "MuJoCo's time is that without `multiccd` where the run is the same without it, bit for bit, and ends sooner. rapier's is \
         without the tendon, which the adapter computes."
            .to_owned(),
        "Errors below 1 nrad, 0.1 µm and 0.001 % count as equal. Within a bound speed alone decides.".to_owned(),
        format!(
            "*Unfinished*: a run of a peer, or its reference, takes more than {limit_s} s {limit_by}. *Not played*: the scene \
             needs what the peer's adapter does not pass on. Both count neither for nor against anyone."
        ),
    ]) {
        put!(page, "- {line}");
    }
    page.push('\n');
    if let Some(words) = kept(report) {
        put!(page, "{words}\n");
    }
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

/// How a report plays its scenes from many starts; none where it has no such scene.
fn starts(report: &Comparison) -> Option<String> {
    let of_report = cases(report);
    let names = BY_STARTS.into_iter().filter(|name| of_report.contains(name));
    let names: Vec<String> = names.map(|name| format!("`{name}`")).collect();
    (!names.is_empty()).then(|| {
        format!(
            "*Starts*: in {}, where a start decides, every object stands up to {} mm aside along x and along y. The error is the \
             share of starts from which a run fails. A run *does it* where at most half of them fail. There are {STARTS} starts, \
             {FEW_STARTS} at steps below 1 ms and where the first {FEW_STARTS} agree.",
            names.join(", "),
            1e3 * ASIDE_M
        )
    })
}

/// What a part of the pages of record is about.
fn title(part: &str) -> String {
    let parts = record::pages::parts();
    parts.into_iter().find(|it| it.name == part).map_or("Speed against error".to_owned(), |part| part.about)
}

/// Where the runs of peers are from that were not played for this page.
fn kept(report: &Comparison) -> Option<String> {
    let mut origins: BTreeMap<(&str, &str), (usize, Option<f64>)> = BTreeMap::new();
    for Kept { commit, date, time_factor } in report.runs.iter().filter_map(|run| run.kept.as_ref()) {
        let (count, factor) = origins.entry((date, commit)).or_default();
        (*count, *factor) = (*count + 1, time_factor.or(*factor));
    }
    if origins.is_empty() {
        return None;
    }
    let of = |((date, commit), (count, factor)): (&(&str, &str), &(usize, Option<f64>))| {
        let times = factor.map_or(String::new(), |factor| format!(", times × {factor:.3}"));
        format!("{count} runs of commit {commit} of {date}{times}")
    };
    let origins: Vec<String> = origins.iter().map(of).collect();
    let sentinels = match report.sentinels {
        None => String::new(),
        Some(Sentinels { played, time_ratio: None, .. }) => {
            format!("; {played} of them, played again, have the same outcomes")
        }
        Some(Sentinels { played, spread, .. }) => format!(
            "; {played} of them, played again, have the same outcomes and give the factor of the times, within {:.1} % in the middle \
             half",
            100.0 * spread
        ),
    };
    Some(format!(
        "Peers do not change with our engine, and their runs are kept: {}{sentinels}.",
        origins.join("; ")
    ))
}

fn dominance(page: &mut String, report: &Comparison) {
    if report.results.is_empty() {
        return;
    }
    let all = report.results.len();
    let count = |verdict| report.results.iter().filter(|result| result.verdict() == verdict).count();
    put!(page, "## Is a peer ever ahead?\n");
    put!(
        page,
        "For every run of a peer that does its scene, with any of its settings: is there a run of ours with at most its error \
        in at most its time? Only steps that ours and the peer with each of its settings have played count. In {} of {all} \
        comparisons there always is, and ours does the scene; in {} the peer is ahead; in {} neither does the scene; in {} it is \
        undecided, because no run of the peer does the scene and some are unfinished, or none was timed; in {} the peer is not \
        played. Named are the settings with which the peer comes \
        nearest to ours, or is farthest ahead. `palmares-compare check` with the path of this folder's `report.json` prints this \
        table and fails where a peer is ahead.\n",
        count(Verdict::Won),
        count(Verdict::Lost),
        count(Verdict::Neither),
        count(Verdict::Unknown),
        count(Verdict::NotPlayed),
    );
    put!(
        page,
        "| scene | peer | its best settings | does it: steps | ours | verdict | differs from its own fine run | ours |"
    );
    put!(page, "|---|---|---|---|---|---|---|---|");
    for v in &report.results {
        let (own, words) = (v.own_done, v.words());
        let best = v.best();
        let name = best.map_or("none".to_owned(), |best| format!("`{}`", best.settings));
        let (steps, of) = (v.steps(), v.steps_ms.len());
        let (differs, ours) =
            (range(best.and_then(|best| best.differs), &v.unit), range(v.own_differs, &v.unit));
        put!(
            page,
            "| {} | {} | {name} | {steps} | {own} of {of} | {words} | {differs} | {ours} |",
            v.case,
            v.peer
        );
    }
    page.push('\n');
}

/// From least to most, where it is known.
fn range(of: Option<[f64; 2]>, unit: &str) -> String {
    of.map_or(String::new(), |[least, most]| match (difference(least, unit), difference(most, unit)) {
        (least, most) if least == most => least,
        (least, most) => format!("{least} … {most}"),
    })
}

/// A difference with its unit. Beyond a metre the number has no meaning: there are two outcomes.
fn difference(value: f64, unit: &str) -> String {
    if unit == "mm" && value > OTHERWISE_MM {
        "ends otherwise".to_owned()
    } else {
        format!("{value:.2e} {unit}")
    }
}

fn stable(page: &mut String, report: &Comparison) {
    if report.results.is_empty() {
        return;
    }
    put!(page, "## Largest usable step\n\n![largest usable step](stable.svg)\n");
}

fn ticks(page: &mut String, report: &Comparison) {
    if report.ticks.is_empty() {
        return;
    }
    put!(page, "## Emulated transmission against plain actuation\n");
    put!(
        page,
        "The time of every 10 ms tick while a hand closes on a pan and lifts it, with the tendons' transmission and with a servo \
         on every joint (steps of 1 ms). This is figure 5 of Rocchi and Hauser (2016), whose hand is the ReFlex.\n"
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
        for line in &note.notes {
            put!(page, "- {line}");
        }
        let is_played = |choice: &&Choice| {
            report.runs.iter().any(|run| (&run.engine, &run.settings) == (&note.name, &choice.name))
        };
        for choice in note.settings.iter().filter(is_played) {
            put!(page, "- `{}`: {}", choice.name, choice.about);
        }
        page.push('\n');
    }
}

fn scene(page: &mut String, report: &Comparison, case: &str) {
    let about = scenes::all().find(|it| it.name == case).map_or("", |it| it.about);
    put!(page, "## {case}\n\n{about}\n\n![{case}]({})\n", picture(case));
    let engines = report.ran();
    let runs: Vec<&Run> = report.runs.iter().filter(|run| run.case == case).collect();
    let figure = runs.iter().find_map(|run| run.error.as_ref());
    let (name, unit) = figure.map_or(("error", ""), |figure| (&figure.name, &figure.unit));
    let most =
        figure.and_then(|figure| figure.within).map_or(String::new(), |most| format!(", at most {most}"));
    for result in report.results.iter().filter(|result| result.case == case) {
        by_settings(page, result);
    }
    put!(
        page,
        "| engine | settings | step | does it | {name} [{unit}]{most} | CPU ms a second | between | times real time | deepest \
        overlap, at most |"
    );
    put!(page, "|---|---|---|---|---|---|---|---|---|");
    runs.iter().for_each(|run| row(page, run, unit));
    page.push('\n');
    let largest =
        engines.iter().filter(|engine| runs.iter().any(|run| run.engine == **engine)).map(|engine| {
            match largest_usable(report, case, engine) {
                Some(dt) => format!("{engine} {dt} ms"),
                None => format!("{engine} {}", without(report, case, engine)),
            }
        });
    put!(page, "Largest step that does it: {}.\n", largest.collect::<Vec<_>>().join(", "));
}

/// The results of a peer by its settings.
fn by_settings(page: &mut String, result: &PeerResult) {
    put!(page, "| {} | does it: steps | deepest overlap | least time beside ours | ahead at |", result.peer);
    put!(page, "|---|---|---|---|---|");
    for outcome in &result.settings {
        let SettingsResult { settings, .. } = outcome;
        let done = outcome.steps();
        let overlap = outcome.overlap_mm.map_or("–".to_owned(), |mm| format!("{mm:.2} mm"));
        let ratio = |of: Option<f64>| of.map_or("–".to_owned(), |ratio| format!("{ratio:.1}"));
        let advantage = ratio(outcome.least_advantage);
        let steps: Vec<String> = outcome.ahead_ms.iter().map(|ms| format!("{ms} ms")).collect();
        let ahead = if steps.is_empty() { "–".to_owned() } else { steps.join(", ") };
        put!(page, "| `{settings}` | {done} | {overlap} | {advantage} | {ahead} |");
    }
    page.push('\n');
}

fn row(page: &mut String, run: &Run, unit: &str) {
    let Run { engine, settings, dt_ms, .. } = run;
    if run.not_played {
        let why = run.trouble.as_deref().unwrap_or("not played");
        put!(page, "| {engine} | {settings} | {dt_ms} ms | {why} | – | – | – | – | – |");
        return;
    }
    let value = run.error.as_ref().and_then(|figure| figure.value);
    let value = value.map_or("–".to_owned(), |x| difference(x, unit));
    let why = match &run.trouble {
        None => "yes".to_owned(),
        Some(why) if run.unfinished => why.clone(),
        Some(why) => format!("no: {why}"),
    };
    let does_it = match &run.starts {
        None => why,
        Some(starts) => {
            let median = starts.median_overlap_mm.map_or("–".to_owned(), |mm| format!("{mm:.1} mm"));
            let unfinished = match starts.unfinished {
                0 => String::new(),
                n => format!(", {n} more unfinished"),
            };
            let Starts { done, tried, .. } = starts;
            format!("{done} of {tried} starts{unfinished}, median overlap {median}; as it is {why}")
        }
    };
    let invariants = &run.invariants;
    let bound = invariants.overlap_bound_mm.map_or(String::new(), |mm| format!(", {mm:.1}"));
    let depth = invariants.max_penetration_mm.map_or("–".to_owned(), |mm| format!("{mm:.3}{bound} mm"));
    let times = if run.cpu_s > 0.0 {
        let [least, most] = run.cpu_s_between.map(|s| 1e3 * s);
        format!("{:.2} | {least:.2} … {most:.2} | {:.0}", 1e3 * run.cpu_s, 1.0 / run.cpu_s)
    } else {
        "– | – | –".to_owned()
    };
    put!(page, "| {engine} | {settings} | {dt_ms} ms | {does_it} | {value} | {times} | {depth} |");
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::report::runner;
    use std::path::Path;

    #[test]
    fn a_report_names_its_own_scenes_of_many_starts() {
        let of = |file: &str| {
            let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/report").join(file);
            starts(&runner::read(&file).expect("a report"))
        };
        assert_eq!(of("further/report.json"), None, "it has none");
        let hands = of("hands/report.json").expect("it has some");
        assert!(
            hands.starts_with("*Starts*: in `softhand_cylinder`, `softhand_box`, `softhand_balls`, "),
            "{hands}"
        );
    }

    #[test]
    fn no_two_reports_have_the_same_title() {
        let titles = ["report", "further", "hand_scenes"].map(title);
        for (k, title) in titles.iter().enumerate() {
            assert!(title.starts_with("Speed against error") && !titles[..k].contains(title), "{titles:?}");
        }
    }

    #[test]
    fn a_difference_of_more_than_a_metre_ends_otherwise() {
        assert_eq!(difference(1000.0, "mm"), "1.00e3 mm");
        assert_eq!(difference(1000.1, "mm"), "ends otherwise");
        assert_eq!(difference(1000.1, "%"), "1.00e3 %");
        assert_eq!(range(Some([0.5, 2000.0]), "mm"), "5.00e-1 mm … ends otherwise");
    }
}
