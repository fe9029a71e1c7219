//! Decides whether a peer is faster than ours at an error that is not larger, with any of its settings. Only steps that both
//! have played count.

use super::comparison::{Run, distinct};
pub use super::peer_result::{PeerResult, SettingsResult, Verdict};

/// Compares every peer with ours, case by case.
pub fn peer_results(runs: &[Run], own: &str, peers: &[impl AsRef<str>]) -> Vec<PeerResult> {
    let cases = distinct(runs.iter().map(|run| &run.case));
    let pairs = cases.iter().flat_map(|case| peers.iter().map(move |peer| (*case, peer.as_ref())));
    pairs.filter_map(|(case, peer)| result(runs, own, case, peer)).collect()
}

fn result(runs: &[Run], own: &str, case: &str, peer: &str) -> Option<PeerResult> {
    let by = |engine: &str| -> Vec<&Run> {
        runs.iter().filter(|run| run.case == case && run.engine == engine).collect()
    };
    let (mut ours, mut theirs) = (by(own), by(peer));
    let names = distinct(theirs.iter().map(|run| &run.settings));
    let steps_ms: Vec<f64> = ours
        .iter()
        .map(|run| run.dt_ms)
        .filter(|dt_ms| {
            let played = |name: &&str| theirs.iter().any(|run| run.settings == **name && run.dt_ms == *dt_ms);
            names.iter().all(played)
        })
        .collect();
    for runs in [&mut ours, &mut theirs] {
        runs.retain(|run| steps_ms.contains(&run.dt_ms));
    }
    let outcomes = names.iter().map(|name| {
        let with: Vec<&Run> = theirs.iter().filter(|run| run.settings == *name).copied().collect();
        outcome(name, &ours, &with)
    });
    let mut settings: Vec<SettingsResult> = outcomes.collect();
    settings.sort_by(|a, b| a.rank().partial_cmp(&b.rank()).unwrap_or(std::cmp::Ordering::Equal));
    let figure = theirs.first()?.error.as_ref().or_else(|| ours.first()?.error.as_ref());
    Some(PeerResult {
        case: case.to_owned(),
        peer: peer.to_owned(),
        steps_ms,
        settings,
        timed: ours.iter().chain(&theirs).all(|run| !run.does_it() || run.cpu_s > 0.0),
        own_done: ours.iter().filter(|run| run.does_it()).count(),
        own_differs: differences(&ours),
        unit: figure.map_or(String::new(), |figure| figure.unit.clone()),
    })
}

fn outcome(settings: &str, ours: &[&Run], theirs: &[&Run]) -> SettingsResult {
    let timed = |runs: &[&Run]| -> Vec<(f64, Run)> {
        let timed = runs.iter().filter(|run| run.cpu_s > 0.0);
        timed.filter_map(|run| Some((run.judged()?, (*run).clone()))).collect()
    };
    let own_points = timed(ours);
    let fastest = |error: f64| {
        let at_most = own_points.iter().filter(|(own, _)| *own <= error).map(|(_, run)| run.cpu_s);
        at_most.fold(f64::INFINITY, f64::min)
    };
    let (mut ahead_ms, mut least_advantage): (Vec<f64>, Option<f64>) = (Vec::new(), None);
    for (error, run) in timed(theirs) {
        let best = fastest(error);
        if best > run.cpu_s {
            ahead_ms.push(run.dt_ms);
        }
        if best.is_finite() {
            let ratio = run.cpu_s / best;
            least_advantage = Some(least_advantage.map_or(ratio, |before| before.min(ratio)));
        }
    }
    let done: Vec<&Run> = theirs.iter().filter(|run| run.does_it()).copied().collect();
    let not_played = theirs.iter().filter(|run| run.not_played).count();
    let overlaps = done.iter().filter_map(|run| run.invariants.max_penetration_mm);
    SettingsResult {
        settings: settings.to_owned(),
        done: done.len(),
        tried: theirs.len() - not_played,
        unfinished: theirs.iter().filter(|run| run.unfinished).count(),
        not_played,
        ahead_ms,
        least_advantage,
        overlap_mm: overlaps.reduce(f64::max),
        differs: differences(&done),
    }
}

/// Least and most difference of the usable runs from their own fine ones.
fn differences(runs: &[&Run]) -> Option<[f64; 2]> {
    let all = runs.iter().filter(|run| run.does_it()).filter_map(|run| run.difference());
    all.fold(None, |range, x| {
        let [least, most] = range.unwrap_or([x, x]);
        Some([least.min(x), most.max(x)])
    })
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::NotPlayed;
    use crate::played::trouble;
    use crate::report::comparison::Starts;
    use palmares_bench::case_report::{Figure, Invariants, Times};

    fn run(engine: &str, dt_ms: f64, error: f64, cpu_s: f64) -> Run {
        Run {
            case: "c".into(),
            engine: engine.into(),
            settings: "default".into(),
            dt_ms,
            scene: None,
            key: None,
            kept: None,
            error: Some(Figure::new("e", error, "mm")),
            invariants: Invariants::default(),
            trouble: None,
            unfinished: false,
            not_played: false,
            starts: None,
            cpu_s,
            cpu_s_between: [cpu_s; 2],
            us_per_step: Times::default(),
        }
    }

    fn only(runs: &[Run]) -> PeerResult {
        let mut all = peer_results(runs, "own", &["peer"]);
        assert_eq!(all.len(), 1);
        all.remove(0)
    }

    #[test]
    fn a_faster_peer_at_a_smaller_error_is_reported() {
        let result = only(&[
            run("own", 1.0, 0.5, 0.1),
            run("own", 2.0, 0.5, 0.1),
            run("peer", 1.0, 0.4, 0.05),
            run("peer", 2.0, 0.6, 0.2),
        ]);
        assert_eq!(result.settings[0].ahead_ms, [1.0]);
        assert_eq!(result.verdict(), Verdict::Lost);
        assert_eq!(result.settings[0].least_advantage, Some(2.0));
        assert_eq!(result.words(), "**the peer is ahead** at 1 ms with `default`");
    }

    #[test]
    fn a_faster_peer_at_a_larger_error_is_beaten_by_a_larger_step_of_ours() {
        let result = only(&[
            run("own", 1.0, 0.1, 0.1),
            run("own", 4.0, 0.3, 0.03),
            run("peer", 1.0, 0.4, 0.5),
            run("peer", 4.0, 0.4, 0.05),
        ]);
        assert_eq!(result.verdict(), Verdict::Won, "{result:?}");
    }

    #[test]
    fn a_peer_is_judged_by_the_settings_that_serve_it_best() {
        let with = |settings: &str, run: Run| Run { settings: settings.into(), ..run };
        let mut lost = with("stiff", run("peer", 1.0, 0.1, 0.001));
        lost.trouble = Some("object lost".into());
        let slow = with("soft", run("peer", 1.0, 0.2, 0.4));
        let quick = with("softer", run("peer", 1.0, 0.3, 0.2));
        let own = run("own", 1.0, 0.1, 0.1);
        let held = only(&[own.clone(), lost.clone(), slow.clone(), quick]);
        let names: Vec<&str> = held.settings.iter().map(|outcome| &*outcome.settings).collect();
        assert_eq!(names, ["softer", "soft", "stiff"]);
        assert_eq!(held.best().and_then(|best| best.least_advantage), Some(2.0));
        let ahead = only(&[own.clone(), lost.clone(), slow, with("softer", run("peer", 1.0, 0.3, 0.05))]);
        assert_eq!(ahead.words(), "**the peer is ahead** at 1 ms with `softer`");
        assert_eq!(only(&[own, lost]).words(), "the peer does it at no step");
    }

    #[test]
    fn within_a_bound_speed_alone_decides_and_beyond_it_nothing_counts() {
        let bounded = |mut run: Run, value: f64| {
            run.error = Some(Figure::bounded("fastest body", value, "m/s", 1.0));
            run.trouble = trouble(run.error.as_ref().expect("set"), &run.invariants);
            run
        };
        let own = [1.0, 2.0, 4.0].map(|dt_ms| bounded(run("own", dt_ms, 0.0, 0.04 / dt_ms), 0.9));
        let slower = bounded(run("peer", 1.0, 0.0, 0.05), 0.1);
        let faster = bounded(run("peer", 2.0, 0.0, 0.005), -0.2);
        let thrown = bounded(run("peer", 4.0, 0.0, 0.001), 1.1);
        let result = only(&[&own[..], &[slower, faster, thrown.clone()]].concat());
        assert_eq!(thrown.trouble.as_deref(), Some("more than 1 m/s"));
        assert_eq!((result.settings[0].done, result.settings[0].tried), (2, 3));
        assert_eq!(result.settings[0].ahead_ms, [2.0]);
    }

    #[test]
    fn a_run_that_lost_the_object_counts_for_nobody() {
        let mut lost = run("peer", 1.0, 0.01, 0.001);
        lost.trouble = Some("object lost".into());
        let result = only(&[run("own", 1.0, 0.1, 0.1), lost]);
        assert_eq!((result.settings[0].done, result.settings[0].tried), (0, 1));
        assert!(result.verdict() == Verdict::Won && result.best().is_none());
    }

    #[test]
    fn a_scene_that_nobody_solves_is_won_by_nobody() {
        let lost = |engine: &str| Run { trouble: Some("object lost".into()), ..run(engine, 1.0, 0.1, 0.1) };
        let nobody = only(&[lost("own"), lost("peer")]);
        assert_eq!((nobody.verdict(), &*nobody.words()), (Verdict::Neither, "neither does it"));
        let peer = only(&[lost("own"), run("peer", 1.0, 0.1, 0.1)]);
        assert_eq!(peer.verdict(), Verdict::Lost);
    }

    #[test]
    fn a_step_that_one_engine_has_not_played_counts_for_none() {
        let faster = run("peer", 0.25, 0.01, 0.001);
        let result =
            only(&[run("own", 1.0, 0.1, 0.1), run("own", 2.0, 0.1, 0.1), run("peer", 1.0, 0.1, 0.3), faster]);
        assert_eq!((&result.steps_ms[..], result.own_done, result.settings[0].tried), (&[1.0][..], 1, 1));
        assert_eq!(result.verdict(), Verdict::Won);
    }

    #[test]
    fn a_run_far_from_its_own_fine_one_solves_its_scene() {
        let mut far = run("peer", 1.0, 0.0, 0.2);
        far.error = Some(Figure::from_own_fine_run("distance", Some(39570.0), "mm"));
        far.invariants.held = Some(true);
        far.trouble = trouble(far.error.as_ref().expect("set"), &far.invariants);
        assert_eq!(far.trouble, None);
        let result = only(&[run("own", 1.0, 0.5, 0.1), far]);
        assert_eq!((result.settings[0].done, result.settings[0].differs), (1, Some([39570.0; 2])));
    }

    #[test]
    fn an_overlap_beyond_its_bound_is_of_no_use() {
        let error = Figure::bounded("farthest centre beyond a wall", 0.0, "mm", 0.0);
        let invariants = |part: f64| Invariants {
            max_penetration_mm: Some(15.0 * part),
            overlap_bound_mm: Some(15.0),
            overlap_of_bound: Some(part),
            ..Invariants::default()
        };
        assert_eq!(trouble(&error, &invariants(0.6)), None);
        assert_eq!(trouble(&error, &invariants(1.6)).as_deref(), Some("overlap 24.0 mm > 15.0 mm"));
    }

    #[test]
    fn of_many_starts_those_that_fail_are_the_error() {
        let of = |done: u32, run: Run| Run {
            starts: Some(Starts { tried: 16, unfinished: 0, done, median_overlap_mm: Some(1.0) }),
            trouble: Some("object lost".into()),
            ..run
        };
        let own = of(15, run("own", 4.0, 9.0, 0.1));
        let [lost, dropped] = [1.0, 2.0].map(|dt_ms| of(0, run("own", dt_ms, 9.0, 0.0)));
        let surer = of(16, run("peer", 1.0, 0.1, 0.5));
        let luckier = of(8, run("peer", 2.0, 0.1, 0.2));
        let unlucky = of(7, run("peer", 4.0, 0.1, 0.01));
        let result = only(&[lost, dropped, own, surer, luckier, unlucky]);
        assert_eq!((result.settings[0].done, result.settings[0].tried), (2, 3));
        assert_eq!(result.settings[0].ahead_ms, [1.0], "none of ours does it from all 16");
        assert_eq!(result.settings[0].least_advantage, Some(2.0));
    }

    fn unfinished(dt_ms: f64) -> Run {
        let trouble = Some("not finished within 25 s".into());
        Run { error: None, trouble, unfinished: true, ..run("peer", dt_ms, 0.0, 0.0) }
    }

    #[test]
    fn starts_that_are_unfinished_decide_nothing() {
        let of = |done, tried, unfinished| Starts { tried, unfinished, done, median_overlap_mm: None };
        for (starts, does_it, undecided) in [
            (of(4, 8, 0), true, false),
            (of(3, 8, 0), false, false),
            (of(4, 4, 4), true, false),
            (of(1, 1, 7), false, true),
            (of(0, 4, 4), false, true),
            (of(0, 5, 3), false, false),
        ] {
            assert_eq!((starts.does_it(), starts.undecided()), (does_it, undecided), "{starts:?}");
        }
    }

    #[test]
    fn a_run_that_is_unfinished_is_reported_and_not_judged() {
        let alone = only(&[run("own", 1.0, 0.1, 0.1), unfinished(1.0)]);
        assert_eq!(alone.verdict(), Verdict::Unknown);
        assert_eq!(alone.words(), "undecided; 1 of the peer's 1 runs are unfinished");
        let ahead = run("peer", 2.0, 0.1, 0.01);
        let both = only(&[run("own", 1.0, 0.1, 0.1), run("own", 2.0, 0.1, 0.1), unfinished(1.0), ahead]);
        let outcome = &both.settings[0];
        assert_eq!((outcome.done, outcome.tried, outcome.unfinished), (1, 2, 1));
        assert_eq!(outcome.steps(), "1 of 2, 1 unfinished");
        assert_eq!(
            both.words(),
            "**the peer is ahead** at 2 ms with `default`; 1 of the peer's 2 runs are unfinished"
        );
    }

    #[test]
    fn a_scene_that_a_peer_has_not_finished_is_won_by_nobody_though_another_of_its_runs_failed() {
        let own = [run("own", 1.0, 0.1, 0.1), run("own", 2.0, 0.1, 0.1)];
        let failed = Run { trouble: Some("object lost".into()), ..run("peer", 2.0, 0.1, 0.1) };
        let result = only(&[&own[..], &[unfinished(1.0), failed.clone()]].concat());
        assert_eq!(result.verdict(), Verdict::Unknown, "{result:?}");
        assert_eq!(result.words(), "undecided; 1 of the peer's 2 runs are unfinished");
        let neither = own.map(|own| Run { trouble: Some("object lost".into()), ..own });
        let result = only(&[&neither[..], &[unfinished(1.0), failed]].concat());
        assert_eq!(result.verdict(), Verdict::Unknown, "{result:?}");
    }

    #[test]
    fn a_scene_that_an_adapter_does_not_pass_on_is_won_by_nobody() {
        let own = run("own", 1.0, 0.1, 0.1);
        // A quick run with a small error, of a scene that was not this one.
        let mut refused = run("peer", 1.0, 0.01, 0.001);
        refused.judge(Some(&NotPlayed("its adapter does not pass on restitution".into())));
        assert_eq!(refused.usable_error(), None);
        for own in [own.clone(), Run { trouble: Some("object lost".into()), ..own }] {
            let result = only(&[own, refused.clone()]);
            assert_eq!((result.verdict(), &*result.words()), (Verdict::NotPlayed, "not played"));
            assert_eq!((result.settings[0].tried, &*result.steps()), (0, "not played"));
        }
    }

    #[test]
    fn a_run_of_an_older_report_is_judged_by_the_bounds_of_today() {
        let momentum = |value: f64| {
            let error = Some(Figure::new("change of momentum", value, "(kg m/s)^2"));
            let mut run = Run { error, ..run("peer", 1.0, 0.0, 0.1) };
            run.judge(None);
            run.trouble
        };
        assert_eq!(momentum(0.11), None);
        assert_eq!(momentum(3.2e3).as_deref(), Some("error 3200.00 (kg m/s)^2"));
        let mut lost = Run { trouble: Some("object lost".into()), ..run("peer", 1.0, 0.0, 0.1) };
        lost.judge(None);
        assert_eq!(lost.trouble.as_deref(), Some("object lost"));
    }
}
