//! Sentinels: a few kept runs of peers that are played again when a report is made. Their outcomes must be the same, or the
//! kept runs are not those of this program and machine. Their times say how much faster or slower the machine is than on the
//! day of the kept runs.

use super::comparison::{Run, Sentinels};
use super::job::Job;
use super::passes::{Conduct, TURNS, turns};
use crate::child::Task;
use crate::played::Played;
use anyhow::{Result, bail, ensure};
use palmares_bench::case_report::Figure;

/// Number of sentinels.
const COUNT: usize = 10;
/// None takes longer than this, s of CPU: of each scene and engine the longest run below it is a candidate.
const LONGEST_S: f64 = 1.0;
/// The ratios of the middle half may differ by this part of their median.
const AGREEMENT: f64 = 0.05;
/// So often the sentinels are timed until they agree.
const TRIES: usize = 3;

/// Places of a job and of a step.
type Place = (usize, usize);

/// Plays sentinels again and multiplies all kept times by the median ratio. None where no kept run has a time.
///
/// # Errors
/// The outcome of a sentinel is another one, or their times do not agree.
pub(super) fn calibrate(jobs: &[Job], runs: &mut [Vec<Run>], conduct: Conduct) -> Result<Option<Sentinels>> {
    let places = choose(jobs, runs);
    if places.is_empty() {
        return Ok(None);
    }
    for (job, step) in &places {
        same_outcome(&jobs[*job], &runs[*job][*step], conduct.run_limit_s)?;
    }
    let played = places.len();
    if conduct.quick {
        return Ok(Some(Sentinels { played, time_ratio: None, spread: 0.0 }));
    }
    let mut least = f64::INFINITY;
    for _ in 0..TRIES {
        let ratios = ratios(jobs, runs, &places, conduct)?;
        let [median, spread] = middle(&ratios);
        println!(
            "{played} sentinels: {median:.3} times the kept CPU time, the middle half within {:.1} %",
            100.0 * spread
        );
        if spread <= AGREEMENT {
            for run in runs.iter_mut().flatten().filter(|run| is_timed(run)) {
                run.scale_times(median);
                if let Some(kept) = &mut run.kept {
                    kept.time_factor = Some(kept.time_factor.unwrap_or(1.0) * median);
                }
            }
            return Ok(Some(Sentinels { played, time_ratio: Some(median), spread }));
        }
        least = least.min(spread);
    }
    bail!(
        "the times of {played} kept runs, played again {TRIES} times, do not agree: the ratios of the middle half differ by {:.1} % \
         of their median, more than {:.0} %. Give the machine rest, or time all runs of peers again with --times-anew (--peers-anew plays them again, too)",
        100.0 * least,
        100.0 * AGREEMENT
    )
}

fn is_timed(run: &Run) -> bool {
    run.kept.is_some() && run.cpu_s > 0.0
}

/// The sentinels: as many of each peer, of scenes that are spread over the report. They depend on the report alone.
fn choose(jobs: &[Job], runs: &[Vec<Run>]) -> Vec<Place> {
    let mut peers: Vec<&str> =
        jobs.iter().filter(|job| !job.keys.is_empty()).map(|job| job.kind.name()).collect();
    peers.sort_unstable();
    peers.dedup();
    let ranks = peers.iter().map(|peer| candidates(jobs, runs, peer));
    // A peer that has never been timed has none.
    let ranks: Vec<_> = ranks.filter(|ranks| !ranks.is_empty()).collect();
    let of_each = COUNT / ranks.len().max(1);
    ranks.into_iter().flat_map(|ranks| spread(ranks, of_each)).collect()
}

/// A peer's candidates: the longest of each scene in the order of the scenes, then the second longest.
fn candidates(jobs: &[Job], runs: &[Vec<Run>], peer: &str) -> Vec<Vec<Place>> {
    let mut scenes: Vec<(&str, Vec<(f64, Place)>)> = Vec::new();
    for (j, job) in jobs.iter().enumerate().filter(|(_, job)| job.kind.name() == peer) {
        let fits = runs[j].iter().enumerate().filter_map(|(step, run)| {
            let takes_s = run.cpu_s * job.simulated_s;
            (is_timed(run) && has_bits(run) && takes_s <= LONGEST_S).then_some((takes_s, (j, step)))
        });
        match scenes.last_mut().filter(|(name, _)| *name == job.case.name) {
            Some((_, all)) => all.extend(fits),
            None => scenes.push((job.case.name, fits.collect())),
        }
    }
    let mut ranks: Vec<Vec<Place>> = Vec::new();
    for (_, mut of_scene) in scenes {
        of_scene.sort_by(|a, b| b.0.total_cmp(&a.0).then(a.1.cmp(&b.1)));
        for (rank, (_, place)) in of_scene.into_iter().enumerate() {
            if rank == ranks.len() {
                ranks.push(Vec::new());
            }
            ranks[rank].push(place);
        }
    }
    ranks
}

/// So many places: all of the first ranks, and of the rank that has more than are wanted evenly spread ones.
fn spread(ranks: Vec<Vec<Place>>, count: usize) -> Vec<Place> {
    let mut chosen = Vec::new();
    for rank in ranks {
        let wanted = (count - chosen.len()).min(rank.len());
        chosen.extend((0..wanted).map(|k| rank[k * rank.len() / wanted]));
    }
    chosen
}

/// Whether the outcome of a run without its reference run has numbers of which an equal value says something.
fn has_bits(run: &Run) -> bool {
    let figure = run.error.as_ref().filter(|figure| !figure.from_own_fine_run);
    let is_some = |value: Option<f64>| value.is_some_and(|value| value != 0.0);
    is_some(figure.and_then(|figure| figure.value)) || is_some(run.invariants.max_penetration_mm)
}

/// Plays a run again.
///
/// # Errors
/// It does not end, or its outcome is another one.
fn same_outcome(Job { case, kind, .. }: &Job, run: &Run, run_limit_s: f64) -> Result<()> {
    let task = Task::Case { name: case.name.to_owned(), reference_dt_s: None, start: 0 };
    let now = task.play::<Played>(*kind, 1e-3 * run.dt_ms, run_limit_s)?.map_err(|failure| failure.said);
    let figure = |figure: Option<&Figure>| {
        figure.filter(|figure| !figure.from_own_fine_run).and_then(|figure| figure.value)
    };
    let kept = serde_json::to_string(&(figure(run.error.as_ref()), run.invariants))?;
    let now = match now {
        Ok(played) => serde_json::to_string(&(figure(Some(&played.error)), played.invariants))?,
        Err(said) => said,
    };
    ensure!(
        kept == now,
        "{} `{}` plays {} at {} ms otherwise here than in the report from which its runs are kept; --peers-anew plays all runs \
         of peers again.\nkept: {kept}\nnow:  {now}",
        kind.name(),
        kind.settings(),
        case.name,
        run.dt_ms
    );
    Ok(())
}

/// Times of the sentinels now over the kept ones.
fn ratios(jobs: &[Job], runs: &[Vec<Run>], places: &[Place], conduct: Conduct) -> Result<Vec<f64>> {
    let mut ratios = Vec::new();
    for some in places.chunks(TURNS) {
        let mut again: Vec<Run> = some.iter().map(|(job, step)| runs[*job][*step].clone()).collect();
        turns(some.iter().map(|(job, _)| &jobs[*job]).zip(&mut again).collect(), conduct);
        for ((job, step), now) in some.iter().zip(again) {
            let kept = &runs[*job][*step];
            ensure!(now.trouble == kept.trouble, "{} {}: {:?}", now.engine, now.case, now.trouble);
            ratios.push(now.cpu_s / kept.cpu_s);
        }
    }
    Ok(ratios)
}

/// Median, and the difference of the middle half as a part of it.
fn middle(ratios: &[f64]) -> [f64; 2] {
    let mut sorted = ratios.to_vec();
    sorted.sort_by(f64::total_cmp);
    let (last, quarter) = (sorted.len() - 1, sorted.len() / 4);
    let median = 0.5 * (sorted[last / 2] + sorted[sorted.len() / 2]);
    [median, (sorted[last - quarter] - sorted[quarter]) / median]
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::EngineKind;
    use crate::peer_key::Kept;
    use palmares_bench::cases;

    fn job(case: &str, engine: &str) -> Job {
        Job {
            case: cases::all().find(|it| it.name == case).expect("a case"),
            kind: EngineKind::from_names(engine, None).expect("it is known"),
            scene: String::new(),
            keys: vec!["a".into(), "b".into()],
            simulated_s: 2.0,
        }
    }

    fn run(job: &Job, dt_ms: f64, cpu_s: f64) -> Run {
        let mut run = Run::begun(job.case.name, job.kind, dt_ms, "", None);
        run.kept = Some(Kept { commit: "a".into(), date: "b".into(), time_factor: None });
        (run.error, run.cpu_s) = (Some(Figure::new("e", 0.5, "mm")), cpu_s);
        run
    }

    #[test]
    fn sentinels_are_spread_over_engines_and_scenes_and_none_is_long() {
        let cases =
            ["slide_stop", "bowling", "pendulum", "heavy_top", "free_flight", "box_tumble", "sphere_stack"];
        let jobs: Vec<Job> =
            cases.iter().flat_map(|case| ["rapier", "mujoco"].map(|engine| job(case, engine))).collect();
        let mut runs: Vec<Vec<Run>> =
            jobs.iter().map(|job| vec![run(job, 1.0, 0.2), run(job, 2.0, 0.1)]).collect();
        // 2 s of CPU, a run without a time, and one whose outcome has no number but the difference from its fine run.
        runs[0][0].cpu_s = 1.0;
        runs[2][0].cpu_s = 0.0;
        runs[4][0].error = Some(Figure::from_own_fine_run("e", Some(0.5), "mm"));
        let places = choose(&jobs, &runs);
        assert_eq!(places.len(), COUNT);
        for peer in ["rapier", "mujoco"] {
            let of: Vec<&str> = places
                .iter()
                .filter(|(j, _)| jobs[*j].kind.name() == peer)
                .map(|(j, _)| jobs[*j].case.name)
                .collect();
            let mut distinct = of.clone();
            distinct.dedup();
            assert_eq!((of.len(), distinct.len()), (5, 5), "{peer}: {of:?}");
        }
        for (job, step) in &places {
            let long_or_unknown = [(0, 0), (2, 0), (4, 0)].contains(&(*job, *step));
            assert!(!long_or_unknown, "{job} {step}");
        }
        assert_eq!(places, choose(&jobs, &runs), "the report alone decides");
        let fresh = job("slide_stop", "drake");
        let with: Vec<Vec<Run>> = runs.iter().cloned().chain([vec![run(&fresh, 1.0, 0.0)]]).collect();
        let jobs: Vec<Job> = jobs.into_iter().chain([fresh]).collect();
        assert_eq!(places, choose(&jobs, &with), "a peer without times takes no place");
        let few = choose(&jobs[..2], &runs[..2]);
        assert_eq!(few, [(1, 0), (1, 1), (0, 1)], "of one scene all that fit");
    }

    #[test]
    fn the_middle_half_decides_whether_times_agree() {
        let even = [1.0, 1.01, 1.01, 1.02, 1.02, 1.02, 1.03, 1.03, 1.3, 2.0];
        let [median, spread] = middle(&even);
        assert!((median - 1.02).abs() < 1e-12 && spread < 0.02, "{median} {spread}");
        let uneven = [0.8, 0.9, 0.95, 1.0, 1.0, 1.0, 1.0, 1.05, 1.1, 1.2];
        assert!(middle(&uneven)[1] > AGREEMENT);
        assert_eq!(middle(&[2.0]), [2.0, 0.0]);
    }
}
