//! The judgement of runs that were judged before.

use super::comparison::Run;
use crate::scene_id;
use palmares_bench::cases;
use std::collections::BTreeMap;

/// Judges runs as we do today: those that are kept may have been judged otherwise, or played before an adapter was known not
/// to pass on what a scene needs.
pub(super) fn judge(runs: &mut [Run]) {
    let there = cases::all().filter(|case| runs.iter().any(|run| run.case == case.name));
    let asked: BTreeMap<&str, _> = there.map(|case| (case.name, scene_id::of_case(case).refused)).collect();
    for run in runs {
        let refused = asked.get(&*run.case).and_then(|asked| asked.get(&*run.engine));
        run.judge(refused);
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::engine::EngineKind;
    use crate::report::dominance::peer_results;
    use crate::report::runner::{peers, read};
    use std::path::Path;

    #[test]
    fn committed_reports_have_the_judgement_of_today() {
        let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/report");
        let mut said = BTreeMap::new();
        for file in ["report.json", "further/report.json", "hands/report.json"] {
            let mut report = read(&root.join(file)).expect("it is in the repository");
            judge(&mut report.runs);
            let results = peer_results(&report.runs, EngineKind::Own.name(), &peers(&report.engines));
            assert!(results == report.results, "{file}: `palmares-compare page` judges it again");
            said.extend(results.into_iter().map(|it| ((it.case.clone(), it.peer.clone()), it.words())));
        }
        let said = |case: &str, peer: &str| &*said[&(case.to_owned(), peer.to_owned())];
        // rapier has no friction against spin and rolling, nor dry friction of joints.
        for case in ["softhand_balls", "thirty_objects_and_hand", "dense_heap_and_hand", "hard_overlap"] {
            assert_eq!(said(case, "rapier"), "not played", "{case}");
        }
        for case in ["momentum_inelastic_hit", "bounce_zeno", "mass_ratio", "softhand_balls"] {
            assert!(said(case, "mujoco").contains("ours is never slower"), "{case}: it is played, and done");
        }
        assert!(said("kapla", "mujoco").contains("unfinished"), "{}", said("kapla", "mujoco"));
    }
}
