//! Sweeps of the step: the figure of a case at many steps beside its bound, so that no step between those of the gates hides
//! an outcome of its own, and no wide bound hides an outlier.

mod scenes;

pub use scenes::{SCENES, Scene};

use crate::cases::{Setup, run};
use anyhow::{Result, bail};
use std::fmt::Write;

/// Shortest and longest step of a sweep, s.
pub const RANGE_S: (f64, f64) = (0.25e-3, 16e-3);

/// Neighbours on each side that an outlier is compared with.
const NEIGHBOURS: usize = 5;
/// A step is an outlier if its figure is this many times the median of its neighbours, and at least this part of the bound: far
/// below the bound figures are rounding errors, which differ by themselves.
const OUTLIER: f64 = 3.0;
const LEAST: f64 = 0.01;

/// A case at one step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Point {
    /// Step, s.
    pub dt_s: f64,
    /// Its figure; infinite if a step did not converge or the run failed.
    pub figure: f64,
    /// Its bound there.
    pub bound: f64,
}

impl Point {
    /// The figure as a part of the bound. A bound of 0 allows nothing else.
    pub fn of_bound(&self) -> f64 {
        if self.figure == 0.0 { 0.0 } else { self.figure.abs() / self.bound }
    }
}

/// Steps from the shortest to the longest in equal ratios, s.
pub fn steps(count: usize) -> Vec<f64> {
    let (low, high) = RANGE_S;
    let ratio = |k: usize| k as f64 / (count.max(2) - 1) as f64;
    (0..count.max(2)).map(|k| low * libm::pow(high / low, ratio(k))).collect()
}

/// Bound of a case at a step: between two of its gates' steps on the straight line of the logarithms, beyond them that of the
/// nearest. `None` if no gate bounds its figure.
pub fn bound(case: &str, dt_s: f64) -> Option<f64> {
    let scene = SCENES.iter().find(|scene| scene.name == case)?;
    let &(first, last) = (scene.bounds.first().zip(scene.bounds.last())).as_ref()?;
    if let Some((_, exact)) = scene.bounds.iter().find(|(at, _)| *at == dt_s) {
        return Some(*exact);
    }
    if dt_s < first.0 {
        return Some(first.1);
    }
    let pair = scene.bounds.windows(2).find(|pair| (pair[0].0..pair[1].0).contains(&dt_s));
    let Some(&[(low, a), (high, b)]) = pair else { return Some(last.1) };
    // A bound of 0 has no logarithm.
    if a == b || a <= 0.0 || b <= 0.0 {
        return Some(a.max(b));
    }
    let part = libm::log(dt_s / low) / libm::log(high / low);
    Some(a * libm::pow(b / a, part))
}

/// Plays a case at steps.
///
/// # Errors
/// The case is unknown, or no gate bounds it.
pub fn play(scene: &Scene, steps_s: &[f64], start: u32) -> Result<Vec<Point>> {
    let mut points = Vec::new();
    for &dt_s in steps_s {
        let setup = Setup { start, ..Setup::own(dt_s) };
        let played = run(scene.name, &setup).map(|(report, _)| report);
        let within = played.as_ref().ok().and_then(|report| report.error.within);
        let Some(bound) = bound(scene.name, dt_s).or(within) else {
            match played {
                Ok(_) => bail!("{} has no bound", scene.name),
                // Its bound comes with its report.
                Err(error) => return Err(error),
            }
        };
        let sound =
            played.ok().filter(|report| report.invariants.newton_unconverged.is_none_or(|it| it == 0));
        let figure = sound.and_then(|report| report.error.value).filter(|it| it.is_finite());
        points.push(Point { dt_s, figure: figure.unwrap_or(f64::INFINITY), bound });
    }
    Ok(points)
}

/// The points that stand out among their neighbours.
pub fn outliers(points: &[Point]) -> Vec<Point> {
    let stands_out = |k: &usize| {
        let near = k.saturating_sub(NEIGHBOURS)..(k + NEIGHBOURS + 1).min(points.len());
        let mut others: Vec<f64> = near.filter(|j| j != k).map(|j| points[j].of_bound()).collect();
        others.sort_by(f64::total_cmp);
        let usual = others.get(others.len() / 2).copied().unwrap_or(0.0);
        let part = points[*k].of_bound();
        part >= LEAST && part > OUTLIER * usual
    };
    (0..points.len()).filter(stands_out).map(|k| points[k]).collect()
}

/// Head of the page.
pub fn head(count: usize, start: u32) -> String {
    let (low, high) = RANGE_S;
    format!(
        "# Sweep of the step\n\n`palmares-bench sweep --steps {count} --start {start}`: every case at {count} steps from {} to {} ms. A part of \
         the bound of more than 1 breaks it. An outlier is {OUTLIER} times the median of its {} neighbours, and at least {LEAST} of \
         the bound.\n\n\
         | case | largest part of the bound | at, ms | median | beyond | outliers at, ms |\n|---|---|---|---|---|---|\n",
        low * 1e3,
        high * 1e3,
        2 * NEIGHBOURS
    )
}

/// The line of a case.
pub fn line(name: &str, points: &[Point]) -> String {
    let mut parts: Vec<f64> = points.iter().map(Point::of_bound).collect();
    parts.sort_by(f64::total_cmp);
    let worst = points.iter().max_by(|a, b| a.of_bound().total_cmp(&b.of_bound()));
    let (most, at) = worst.map_or((0.0, 0.0), |point| (point.of_bound(), point.dt_s));
    let median = parts.get(parts.len() / 2).copied().unwrap_or(0.0);
    let beyond = points.iter().filter(|point| point.of_bound() > 1.0).count();
    let mut line =
        format!("| `{name}` | {most:.3} | {:.4} | {median:.3} | {beyond} of {} |", at * 1e3, points.len());
    for point in outliers(points) {
        let _ = write!(line, " {:.4} ({:.2})", point.dt_s * 1e3, point.of_bound());
    }
    line + " |\n"
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_steps_go_from_end_to_end_in_equal_ratios() {
        let steps = steps(7);
        let right = [0.25e-3, 0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3];
        assert!(steps.iter().zip(right).all(|(a, b)| (a / b - 1.0).abs() < 1e-12), "{steps:?}");
    }

    /// A figure that grows with the step and has one bad step, hidden by a wide bound.
    fn made_up(bad: Option<usize>) -> Vec<Point> {
        let point = |(k, dt_s): (usize, f64)| {
            let figure = if bad == Some(k) { 0.7 } else { 5.0 * dt_s };
            Point { dt_s, figure, bound: 1.0 }
        };
        steps(60).into_iter().enumerate().map(point).collect()
    }

    #[test]
    fn an_outlier_is_found_under_a_wide_bound() {
        for bad in [0, 3, 30, 59] {
            let points = made_up(Some(bad));
            assert_eq!(outliers(&points), vec![points[bad]]);
            let text = line("made_up", &points);
            assert!(text.contains("| 0 of 60 |") && text.contains("(0.70)"), "{text}");
        }
        assert_eq!(outliers(&made_up(None)), vec![]);
    }

    #[test]
    fn a_run_that_fails_is_beyond_every_bound() {
        let mut points = made_up(None);
        points[20].figure = f64::INFINITY;
        assert_eq!(outliers(&points), vec![points[20]]);
        assert!(line("made_up", &points).contains("| 1 of 60 |"));
    }

    #[test]
    fn bounds_are_those_of_the_gates_and_go_on_between_them() {
        assert_eq!(bound("bounce_zeno", 4e-3), Some(1.0));
        assert_eq!(bound("bounce_zeno", 32e-3), Some(5.0));
        let between = bound("bounce_zeno", 8e-3).expect("it is bounded");
        assert!((between - 5f64.sqrt()).abs() < 1e-12, "{between}");
        assert_eq!(bound("softhand_free", 1e-3), None);
    }

    #[test]
    fn every_scene_is_a_case_and_is_played_beside_its_bound() {
        for scene in SCENES {
            assert!(crate::cases::all().any(|case| case.name == scene.name), "{}", scene.name);
            assert!(scene.bounds.windows(2).all(|pair| pair[0].0 < pair[1].0), "{}", scene.name);
        }
        let scene = SCENES.iter().find(|scene| scene.name == "dead_impact").expect("it is one");
        let points = play(scene, &[1e-3, 8e-3], 0).expect("it is played");
        assert!(points.iter().all(|point| point.of_bound() <= 1.0), "{points:?}");
    }
}
