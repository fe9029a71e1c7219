//! The points of a sweep: a case at a step beside its bound, and those that stand out.

use super::scenes::{LONG, RANGE_S, SCENES, Scene};
use crate::cases::{Setup, run};
use anyhow::{Result, bail};

/// Neighbours on each side that an outlier is compared with.
pub(super) const NEIGHBOURS: usize = 5;
/// A step is an outlier if its figure is this many times the median of its neighbours, and at least this part of the bound: far
/// below the bound figures are rounding errors, which differ by themselves.
pub(super) const OUTLIER: f64 = 3.0;
pub(super) const LEAST: f64 = 0.01;

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
        match self.figure.abs() {
            0.0 => 0.0,
            // Even where the run that failed has not told its bound.
            f64::INFINITY => f64::INFINITY,
            figure => figure / self.bound,
        }
    }
}

/// A case at all steps of a sweep.
#[derive(Clone, Debug)]
pub struct Row {
    /// The case.
    pub scene: &'static Scene,
    /// Its points, by steps.
    pub points: Vec<Point>,
}

impl Row {
    /// Points at the steps of its gate.
    pub fn claimed(&self) -> Vec<Point> {
        self.points.iter().filter(|point| self.scene.claims(point.dt_s)).copied().collect()
    }

    /// Points at other steps.
    pub fn unclaimed(&self) -> Vec<Point> {
        self.points.iter().filter(|point| !self.scene.claims(point.dt_s)).copied().collect()
    }
}

/// The point nearest to its bound, or farthest beyond.
pub(crate) fn worst(points: &[Point]) -> Option<Point> {
    points.iter().copied().max_by(|a, b| a.of_bound().total_cmp(&b.of_bound()))
}

/// Steps from the shortest to the longest in equal ratios, s.
pub fn steps(count: usize) -> Vec<f64> {
    let (low, high) = RANGE_S;
    let ratio = |k: usize| k as f64 / (count.max(2) - 1) as f64;
    (0..count.max(2)).map(|k| low * libm::pow(high / low, ratio(k))).collect()
}

/// The scene of a case.
pub fn scene(case: &str) -> Option<&'static Scene> {
    SCENES.iter().chain(LONG).find(|scene| scene.name == case)
}

/// Bound of a case at a step: between two of its gates' steps on the straight line of the logarithms, beyond them that of the
/// nearest. `None` if no gate bounds its figure.
pub fn bound(case: &str, dt_s: f64) -> Option<f64> {
    let scene = scene(case)?;
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

/// Plays a case under a setup.
///
/// # Errors
/// No gate bounds the case.
pub fn play(scene: &Scene, setup: &Setup) -> Result<Point> {
    let dt_s = setup.dt_s;
    let report = match run(scene.name, setup) {
        Ok((report, _)) => report,
        Err(error) => {
            eprintln!("{} at {:.4} ms fails: {error:#}", scene.name, 1e3 * dt_s);
            let bound = bound(scene.name, dt_s).unwrap_or(1.0);
            return Ok(Point { dt_s, figure: f64::INFINITY, bound });
        }
    };
    let Some(bound) = bound(scene.name, dt_s).or(report.error.within) else {
        bail!("{} has no bound", scene.name);
    };
    let converged = report.invariants.newton_unconverged.is_none_or(|it| it == 0);
    let figure = report.error.value.filter(|it| converged && it.is_finite());
    Ok(Point { dt_s, figure: figure.unwrap_or(f64::INFINITY), bound })
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

#[cfg(test)]
pub(super) mod tests {
    use super::*;

    #[test]
    fn the_steps_go_from_end_to_end_in_equal_ratios() {
        let steps = steps(7);
        let right = [0.25e-3, 0.5e-3, 1e-3, 2e-3, 4e-3, 8e-3, 16e-3];
        assert!(steps.iter().zip(right).all(|(a, b)| (a / b - 1.0).abs() < 1e-12), "{steps:?}");
    }

    /// A figure that grows with the step and has one bad step, hidden by a wide bound.
    pub(crate) fn made_up(bad: Option<usize>) -> Vec<Point> {
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
        }
        assert_eq!(outliers(&made_up(None)), vec![]);
    }

    #[test]
    fn a_run_that_fails_is_beyond_every_bound() {
        let mut points = made_up(None);
        points[20].figure = f64::INFINITY;
        assert_eq!(outliers(&points), vec![points[20]]);
        assert_eq!(worst(&points), Some(points[20]));
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
    fn steps_beyond_the_gate_are_not_claimed() {
        let palm = scene("turning_palm").expect("a scene");
        assert!(palm.claims(0.25e-3) && palm.claims(8e-3) && !palm.claims(8.3e-3));
        let steps = steps(200);
        let all = scene("free_flight").expect("a scene");
        assert!(steps.iter().all(|&dt_s| all.claims(dt_s)));
    }

    #[test]
    fn every_scene_is_a_case_and_is_played_beside_its_bound() {
        for scene in SCENES.iter().chain(LONG) {
            assert!(crate::cases::all().any(|case| case.name == scene.name), "{}", scene.name);
            assert!(scene.bounds.windows(2).all(|pair| pair[0].0 < pair[1].0), "{}", scene.name);
            let (low, high) = scene.claimed_s;
            assert!(RANGE_S.0 <= low && low <= high && high <= RANGE_S.1, "{}", scene.name);
        }
        let dead = scene("dead_impact").expect("it is one");
        for dt_s in [1e-3, 8e-3] {
            let point = play(dead, &Setup::own(dt_s)).expect("it is played");
            assert!(point.of_bound() <= 1.0, "{point:?}");
        }
    }
}
