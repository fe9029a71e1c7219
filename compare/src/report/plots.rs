//! The pictures of a report, as SVG.

use super::comparison::{Comparison, Run, distinct, floor};
use super::dominance::PeerResult;
use anyhow::{Result, anyhow};
use plotters::coord::Shift;
use plotters::prelude::*;
use plotters::style::register_font;
use std::ops::Range;
use std::path::Path;

const FONT: &[u8] = include_bytes!("../../../hand-tools/assets/dejavu-sans/DejaVuSans.ttf");
pub(crate) const SANS: &str = "sans-serif";
/// Left end of horizontal bars.
const LEFT: i32 = 215;

pub(crate) type Area<'a> = DrawingArea<SVGBackend<'a>, Shift>;

/// Colour of an engine; they differ in lightness as well, for prints and for the colour-blind.
pub(super) fn colour(engine: &str) -> RGBColor {
    match engine {
        "own" => RGBColor(0, 90, 181),
        "rapier" => RGBColor(220, 120, 30),
        "drake" => RGBColor(120, 20, 70),
        _ => RGBColor(110, 110, 110),
    }
}

/// An error of plotters for `anyhow`.
pub(crate) fn failed(error: impl std::fmt::Display) -> anyhow::Error {
    anyhow!("cannot draw: {error}")
}

/// Name of the picture of a case.
pub(super) fn picture(case: &str) -> String {
    format!("{case}.svg")
}

/// Draws all pictures into a folder.
pub(super) fn draw(report: &Comparison, folder: &Path) -> Result<()> {
    for case in cases(report) {
        let runs: Vec<&Run> =
            report.runs.iter().filter(|run| run.case == case && drawn(report, run)).collect();
        let timed = |engine: &str| runs.iter().any(|run| run.engine == engine && has_point(run));
        let absent = report.ran().into_iter().filter(|engine| !timed(engine));
        let absent: Vec<_> = absent.map(|engine| (engine, without(report, case, engine))).collect();
        on_page(&folder.join(picture(case)), (640, 440), |area| errors(area, case, &runs, &absent))?;
    }
    let compared = compared(report);
    if !compared.is_empty() {
        let height = 90 + 26 * compared.len() as u32;
        on_page(&folder.join("stable.svg"), (760, height), |area| stable(area, report, &compared))?;
    }
    on_page(&folder.join("split.svg"), (760, 90 + 20 * cases(report).len() as u32), |area| {
        split(area, report)
    })?;
    if report.ticks.is_empty() {
        return Ok(());
    }
    on_page(&folder.join("ticks.svg"), (760, 380), |area| ticks(area, report))
}

/// Whether a run is in the picture of its case: ours, and of every peer those with its best settings.
fn drawn(report: &Comparison, run: &Run) -> bool {
    let of = |result: &&PeerResult| result.case == run.case && result.peer == run.engine;
    let best = report.results.iter().find(of).and_then(|result| result.settings.first());
    best.is_none_or(|best| best.settings == run.settings)
}

/// Cases of a report in the order of its runs.
pub(super) fn cases(report: &Comparison) -> Vec<&str> {
    let mut cases: Vec<&str> = report.runs.iter().map(|run| &*run.case).collect();
    cases.dedup();
    cases
}

/// Cases that more than one engine ran.
fn compared(report: &Comparison) -> Vec<&str> {
    let peer = |case: &str| report.runs.iter().any(|run| run.case == case && run.engine != "own");
    cases(report).into_iter().filter(|case| peer(case)).collect()
}

/// Makes the font of the pictures known.
pub(super) fn register() -> Result<()> {
    register_font(SANS, FontStyle::Normal, FONT).map_err(|_| anyhow!("the font is broken"))
}

/// One picture in a file.
pub(crate) fn on_page(path: &Path, size: (u32, u32), draw: impl FnOnce(&Area) -> Result<()>) -> Result<()> {
    register()?;
    let root = SVGBackend::new(path, size).into_drawing_area();
    root.fill(&WHITE).map_err(failed)?;
    draw(&root)?;
    root.present().map_err(failed)
}

/// A tenth of a decade of room on both sides of positive numbers.
fn around(values: impl Iterator<Item = f64>) -> Option<Range<f64>> {
    let (low, high) = values.fold((f64::INFINITY, 0.0f64), |(low, high), x| (low.min(x), high.max(x)));
    // At least one decade, so that the axis has a number to show.
    let middle = (low * high).sqrt();
    (low > 0.0 && low <= high).then(|| (low / 1.8).min(middle / 4.0)..(high * 1.8).max(middle * 4.0))
}

/// Whether a run has a point in the picture of its case.
fn has_point(run: &Run) -> bool {
    run.usable_error().is_some() && run.cpu_s > 0.0 && !run.ends_otherwise()
}

/// Error against CPU time, one curve an engine, every point with its step. Engines without a point are in the legend, with the reason.
fn errors(area: &Area, case: &str, runs: &[&Run], absent: &[(&str, &str)]) -> Result<()> {
    let point = |run: &&Run| {
        let error = run.usable_error().filter(|_| has_point(run))?;
        Some((run.cpu_s * 1e3, error, run.dt_ms))
    };
    let points: Vec<_> = runs.iter().filter_map(point).collect();
    let figure = runs.iter().find_map(|run| run.error.as_ref());
    // Errors below the floor are equal; where all are, the axis has nothing else to show.
    let least = figure.map_or(0.0, |figure| floor(&figure.unit));
    let equal = points.iter().all(|p| p.1 <= least);
    let errors = match equal {
        true => (!points.is_empty()).then_some(least / 2.0..least * 2.0),
        false => around(points.iter().map(|p| p.1)),
    };
    let axes = (around(points.iter().map(|p| p.0)), errors);
    let (Some(x), Some(y)) = axes else {
        let absent: Vec<String> = absent.iter().map(|(engine, why)| format!("{engine}: {why}")).collect();
        let title = format!("{case}: no usable run ({})", absent.join(", "));
        return area.titled(&title, (SANS, 16)).map(|_| ()).map_err(failed);
    };
    let label = figure.map_or(String::new(), |f| format!("{} [{}]", f.name, f.unit));
    let error = |x: &f64| match *x <= 1.01 * least {
        true => format!("≤ {}", number(&least)),
        false if equal => String::new(),
        false => axis_number(x),
    };
    let engines = distinct(runs.iter().map(|run| &run.engine));
    let y = with_room(y, engines.len() + absent.len());
    let mut chart = ChartBuilder::on(area)
        .caption(case, (SANS, 17))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(72)
        .build_cartesian_2d(x.log_scale(), y.log_scale())
        .map_err(failed)?;
    chart
        .configure_mesh()
        .x_desc("CPU time for one simulated second [ms]")
        .y_desc(label)
        .x_label_formatter(&axis_number)
        .y_label_formatter(&error)
        .label_style((SANS, 12))
        .axis_desc_style((SANS, 13))
        .light_line_style(TRANSPARENT)
        .bold_line_style(RGBColor(205, 205, 205))
        .draw()
        .map_err(failed)?;
    for engine in engines {
        let ink = colour(engine);
        let curve: Vec<_> = runs.iter().filter(|run| run.engine == engine).filter_map(point).collect();
        if curve.is_empty() {
            continue;
        }
        chart
            .draw_series(LineSeries::new(curve.iter().map(|p| (p.0, p.1)), ink.stroke_width(2)))
            .map_err(failed)?
            .label(label_of(runs, engine))
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], ink.stroke_width(2)));
        let dots = curve.iter().map(|p| Circle::new((p.0, p.1), 4, ink.filled()));
        chart.draw_series(dots).map_err(failed)?;
        let style = (SANS, 11).into_font().color(&ink);
        let steps = curve
            .iter()
            .map(|p| EmptyElement::at((p.0, p.1)) + Text::new(format!("{}", p.2), (6, -13), style.clone()));
        chart.draw_series(steps).map_err(failed)?;
    }
    for (engine, why) in absent {
        let ink = colour(engine);
        chart
            .draw_series(std::iter::empty::<Circle<(f64, f64), i32>>())
            .map_err(failed)?
            .label(format!("{engine}: {why}"))
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], ink.stroke_width(2)));
    }
    legend(&mut chart)
}

/// A logarithmic axis with room above its values for a legend of so many names: it covers no curve.
fn with_room(y: Range<f64>, names: usize) -> Range<f64> {
    let part = (10.0 + 22.0 * names as f64) / 340.0;
    y.start..y.start * libm::pow(y.end / y.start, 1.0 / (1.0 - part.min(0.5)))
}

/// The names of a chart's curves, in its upper right corner.
fn legend<'a, 'b: 'a, X: Ranged, Y: Ranged>(
    chart: &mut ChartContext<'a, SVGBackend<'b>, Cartesian2d<X, Y>>,
) -> Result<()> {
    let mut labels = chart.configure_series_labels();
    labels
        .position(SeriesLabelPosition::UpperRight)
        .background_style(WHITE.mix(0.85))
        .border_style(RGBColor(180, 180, 180));
    labels.label_font((SANS, 13)).draw().map_err(failed)
}

/// Coloured squares above horizontal bars, each with its name.
fn key<'a>(area: &Area, names: impl IntoIterator<Item = (&'a str, RGBColor)>) -> Result<()> {
    for (k, (name, ink)) in names.into_iter().enumerate() {
        let at = LEFT + 110 * k as i32;
        area.draw(&Rectangle::new([(at, 8), (at + 12, 18)], ink.filled())).map_err(failed)?;
        area.draw(&Text::new(name, (at + 18, 6), (SANS, 13))).map_err(failed)?;
    }
    Ok(())
}

/// An engine in the legend, a peer with its settings, and the steps at which it does the scene without a point.
fn label_of(runs: &[&Run], engine: &str) -> String {
    let of = || runs.iter().filter(|run| run.engine == engine);
    let name = match of().next().filter(|_| engine != "own") {
        Some(run) => format!("{engine} {}", run.settings),
        None => engine.to_owned(),
    };
    let steps: Vec<String> = of()
        .filter(|run| run.does_it() && run.ends_otherwise())
        .map(|run| format!("{}", run.dt_ms))
        .collect();
    match steps.is_empty() {
        true => name,
        false => format!("{name}; ends otherwise at {} ms", steps.join(", ")),
    }
}

/// The shortest text of a number.
fn number(x: &f64) -> String {
    if (1e-2..1e4).contains(x) { format!("{}", (x * 1e3).round() / 1e3) } else { format!("{x:.0e}") }
}

/// The text of a number on a logarithmic axis: those from 1, 2 and 5 have one, the others stand too close.
fn axis_number(x: &f64) -> String {
    let digit = x / libm::pow(10.0, (libm::log10(*x) + 1e-9).floor());
    if [1.0, 2.0, 5.0].iter().any(|it| (digit - it).abs() < 1e-6) { number(x) } else { String::new() }
}

/// Largest step at which an engine solves the scene, with any of its settings.
pub(super) fn largest_usable(report: &Comparison, case: &str, engine: &str) -> Option<f64> {
    let runs = report.runs.iter().filter(|run| run.case == case && run.engine == engine);
    runs.filter(|run| run.error.is_some() && run.does_it()).map(|run| run.dt_ms).reduce(f64::max)
}

/// Why no run of an engine is drawn in a case, in a word or two.
pub(super) fn without(report: &Comparison, case: &str, engine: &str) -> &'static str {
    let runs = || report.runs.iter().filter(|run| run.case == case && run.engine == engine);
    if runs().all(|run| run.not_played) {
        "not played"
    } else if runs().any(|run| run.does_it() && run.ends_otherwise()) {
        "ends otherwise"
    } else if runs().any(Run::does_it) {
        "not timed"
    } else if runs().any(|run| run.unfinished) {
        "unfinished"
    } else {
        "no step"
    }
}

/// Horizontal bars: the largest usable step of every case and engine.
fn stable(area: &Area, report: &Comparison, cases: &[&str]) -> Result<()> {
    let engines = report.ran();
    let area =
        area.titled("largest step that does it, with any settings [ms]", (SANS, 17)).map_err(failed)?;
    let (width, height) = area.dim_in_pixel();
    let (left, top, row) = (LEFT, 30, (height as i32 - 36) / cases.len().max(1) as i32);
    let steps = report.runs.iter().map(|run| run.dt_ms);
    let (least, most) = steps.fold((f64::INFINITY, 0.0f64), |(a, b), dt| (a.min(dt), b.max(dt)));
    let least = 0.5 * least;
    let scale =
        |dt: f64| left + ((width as i32 - left - 60) as f64 * (dt / least).ln() / (most / least).ln()) as i32;
    key(&area, engines.iter().map(|engine| (*engine, colour(engine))))?;
    for (i, case) in cases.iter().enumerate() {
        let y = top + row * i as i32;
        area.draw(&Text::new(*case, (10, y + row / 2 - 8), (SANS, 12))).map_err(failed)?;
        let thick = (row - 5) / engines.len().max(1) as i32;
        for (k, engine) in engines.iter().enumerate() {
            let y = y + thick * k as i32;
            let largest = largest_usable(report, case, engine);
            let end = largest.map_or(left, scale);
            let bar = Rectangle::new([(left, y), (end, y + thick - 1)], colour(engine).filled());
            area.draw(&bar).map_err(failed)?;
            let said = largest.map_or(without(report, case, engine).to_owned(), |dt| format!("{dt}"));
            area.draw(&Text::new(said, (end + 4, y - 2), (SANS, 10))).map_err(failed)?;
        }
    }
    Ok(())
}

/// Horizontal bars: the parts of the time of our step, at 1 ms or the nearest step there is.
fn split(area: &Area, report: &Comparison) -> Result<()> {
    let area = area.titled("own engine: time of a step at 1 ms [µs]", (SANS, 17)).map_err(failed)?;
    let phases = ["dynamics", "collision", "solver"];
    let inks = [RGBColor(0, 90, 181), RGBColor(120, 180, 230), RGBColor(220, 120, 30)];
    let rows: Vec<&Run> = cases(report).into_iter().filter_map(|case| at_one_ms(report, case)).collect();
    let most = rows.iter().fold(1e-9, |most: f64, run| most.max(run.us_per_step.total));
    let (width, _) = area.dim_in_pixel();
    let (left, top, row) = (LEFT, 30, 20);
    key(&area, phases.into_iter().zip(inks))?;
    // Square roots, so that 2 µs are visible next to 2 ms.
    let scale = |us: f64| ((width as i32 - left - 70) as f64 * (us / most).sqrt()) as i32;
    for (i, run) in rows.iter().enumerate() {
        let y = top + row * i as i32;
        area.draw(&Text::new(run.case.clone(), (10, y), (SANS, 12))).map_err(failed)?;
        let t = &run.us_per_step;
        let (length, mut at) = (scale(t.total), left);
        for (part, ink) in [t.dynamics, t.collision, t.solver].into_iter().zip(inks) {
            let end = at + (f64::from(length) * part / t.total.max(1e-9)).round() as i32;
            area.draw(&Rectangle::new([(at, y + 1), (end, y + 14)], ink.filled())).map_err(failed)?;
            at = end;
        }
        let said = Text::new(format!("{:.1}", t.total), (left + length + 5, y), (SANS, 11));
        area.draw(&said).map_err(failed)?;
    }
    Ok(())
}

/// Our run of a case with the step nearest to 1 ms.
pub(super) fn at_one_ms<'a>(report: &'a Comparison, case: &str) -> Option<&'a Run> {
    let runs = report.runs.iter().filter(|run| run.case == case && run.engine == "own" && run.cpu_s > 0.0);
    runs.min_by(|a, b| a.dt_ms.ln().abs().total_cmp(&b.dt_ms.ln().abs()))
}

/// Time of every 10 ms of a grasp.
fn ticks(area: &Area, report: &Comparison) -> Result<()> {
    let count = report.ticks.iter().map(|way| way.ms.len()).max().unwrap_or(0);
    let most = report.ticks.iter().flat_map(|way| &way.ms).fold(1e-3, |most: f64, ms| most.max(*ms));
    let mut chart = ChartBuilder::on(area)
        .caption("CPU time of every 10 ms tick while a pan is grasped and lifted", (SANS, 17))
        .margin(12)
        .x_label_area_size(44)
        .y_label_area_size(60)
        .build_cartesian_2d(0.0..count as f64 * 0.01, 0.0..1.1 * most)
        .map_err(failed)?;
    chart
        .configure_mesh()
        .x_desc("simulated time [s]")
        .y_desc("CPU time of a tick [ms]")
        .label_style((SANS, 12))
        .axis_desc_style((SANS, 13))
        .light_line_style(RGBColor(238, 238, 238))
        .draw()
        .map_err(failed)?;
    let inks = [(0, 90, 181), (220, 120, 30), (120, 170, 225), (240, 190, 130)];
    for (way, ink) in report.ticks.iter().zip(inks.map(|(r, g, b)| RGBColor(r, g, b))) {
        let points = way.ms.iter().enumerate().map(|(k, ms)| (0.01 * (k + 1) as f64, *ms));
        chart
            .draw_series(LineSeries::new(points, ink.stroke_width(2)))
            .map_err(failed)?
            .label(way.about.as_str())
            .legend(move |(x, y)| PathElement::new(vec![(x, y), (x + 18, y)], ink.stroke_width(2)));
    }
    legend(&mut chart)
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::EngineKind;
    use crate::report::runner;
    use palmares_bench::case_report::Figure;

    /// Cases of a committed report, whose pictures are to say why an engine is missing.
    #[test]
    fn a_picture_says_why_an_engine_has_no_point() {
        let file = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/report/further/report.json");
        let mut report = runner::read(&file).expect("a report");
        let folder = tempfile::tempdir().expect("a folder");
        let mut said = |change: fn(&mut Run)| {
            report
                .runs
                .iter_mut()
                .filter(|run| run.case == "kapla" && run.engine == "mujoco")
                .for_each(change);
            draw(&report, folder.path()).expect("drawn");
            std::fs::read_to_string(folder.path().join("kapla.svg")).expect("written")
        };
        let unfinished = said(|run| {
            run.unfinished = true;
            run.trouble = Some("not finished within 100 s".into());
        });
        assert!(unfinished.contains("mujoco: unfinished"));
        assert!(said(|run| run.unfinished = false).contains("mujoco: no step"));
        assert!(said(|run| run.not_played = true).contains("mujoco: not played"));
        let bars = std::fs::read_to_string(folder.path().join("stable.svg")).expect("written");
        assert!(bars.contains("not played"), "and so do the bars");
    }

    #[test]
    fn numbers_on_an_axis_do_not_stand_on_each_other() {
        let text = |numbers: &[f64]| numbers.iter().map(axis_number).collect::<Vec<_>>();
        assert_eq!(text(&[0.01, 0.02, 0.05, 100.0, 200.0]), ["0.01", "0.02", "0.05", "100", "200"]);
        assert_eq!(text(&[1e-3, 1000.0, 1e5]), ["1e-3", "1000", "1e5"]);
        assert_eq!(text(&[0.03, 4.0, 90.0, 900.0]), [""; 4]);
    }

    /// The text of a picture of these runs.
    fn picture_of(runs: &[Run], absent: &[(&str, &str)]) -> String {
        let folder = tempfile::tempdir().expect("a folder");
        let path = folder.path().join("picture.svg");
        let runs: Vec<&Run> = runs.iter().collect();
        on_page(&path, (640, 440), |area| errors(area, "case", &runs, absent)).expect("drawn");
        std::fs::read_to_string(path).expect("written")
    }

    fn run(engine: &str, dt_ms: f64, error: Figure) -> Run {
        let kind = EngineKind::from_names(engine, None).expect("it is known");
        Run { error: Some(error), cpu_s: 1e-3 / dt_ms, ..Run::begun("case", kind, dt_ms, "", None) }
    }

    #[test]
    fn a_run_that_ends_otherwise_is_in_the_legend_and_not_a_number() {
        let far = |mm: f64| Figure::from_own_fine_run("distance", Some(mm), "mm");
        let runs = [run("own", 1.0, far(0.5)), run("mujoco", 1.0, far(0.7)), run("mujoco", 2.0, far(4e4))];
        let picture = picture_of(&runs, &[]);
        assert!(picture.contains("mujoco default; ends otherwise at 2 ms"), "{picture}");
        assert!(!picture.contains("1e4") && !picture.contains("10000"), "no axis reaches there: {picture}");
    }

    #[test]
    fn where_every_error_is_zero_the_axis_says_so() {
        let none = |dt_ms: f64| run("own", dt_ms, Figure::new("error", 0.0, "mm"));
        let picture = picture_of(&[none(1.0), none(2.0)], &[("rapier", "not played")]);
        assert!(picture.contains("≤ 1e-4") && picture.contains("rapier: not played"), "{picture}");
        assert!(!picture.contains("1e-5") && !picture.contains("2e-4"), "no other number: {picture}");
    }

    #[test]
    fn a_legend_is_above_all_points() {
        let y = with_room(1.0..100.0, 4);
        let highest = (100.0_f64 / y.start).ln() / (y.end / y.start).ln();
        assert!((highest - (1.0 - 98.0 / 340.0)).abs() < 1e-12 && y.start == 1.0, "{y:?}");
    }
}
