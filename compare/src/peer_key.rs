//! The key of a peer's run. Peers do not change when our engine does: a run is kept as long as everything stays the same that
//! its outcome depends on.

use crate::engine::{Adapter, EngineKind, Feature};
use crate::scene_id;
use palmares_bench::cases::ASIDE_M;
use palmares_models::content::ContentHash;
use serde::{Deserialize, Serialize};
use std::collections::BTreeSet;

/// The report or table that a run was played for, where that is an earlier one.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub struct Kept {
    /// Its commit.
    pub commit: String,
    /// Its day, UTC.
    pub date: String,
    /// The run's times of that day were multiplied by this.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub time_factor: Option<f64>,
}

/// Everything that the outcome of a peer's run depends on.
#[derive(Clone)]
pub struct PeerRun<'a> {
    /// The engine; of its settings the options count, not the name.
    pub kind: EngineKind,
    /// The engine's version.
    pub version: &'a str,
    /// [Identity](crate::scene_id) of the scene and its commands.
    pub scene: &'a str,
    /// Its features: of the adapter only the revisions of these count.
    pub needs: &'a BTreeSet<Feature>,
    /// Step, ms.
    pub step_ms: f64,
    /// Step of the reference run, ms; 0 where there is none.
    pub reference_ms: f64,
    /// The figure and the bounds by which the run is judged.
    pub judged_by: &'a str,
    /// Number of starts.
    pub starts: u32,
    /// CPU time of a run, s.
    pub run_limit_s: f64,
    /// Whether the report is quick.
    pub quick: bool,
}

impl PeerRun<'_> {
    /// The key, in hexadecimal digits; none for ours, which is always played.
    pub fn key(&self) -> Option<String> {
        Some(self.key_with(&self.kind.adapter()?))
    }

    fn key_with(&self, adapter: &Adapter) -> String {
        let mut hash = ContentHash::of("run of a peer");
        hash.text(adapter.engine);
        hash.text(self.version);
        hash.text(&self.kind.options());
        hash.text(self.scene);
        hash.count(adapter.revision as usize);
        // The first revision of a feature is the adapter as it is: a feature that gets a name of its own makes no run old.
        let revised = self.needs.iter().map(|feature| (*feature, adapter.revision_of(*feature)));
        let revised: Vec<_> = revised.filter(|(_, revision)| *revision != Some(1)).collect();
        hash.list(&revised, |hash, (feature, revision)| {
            hash.text(&format!("{feature:?}"));
            hash.count(revision.unwrap_or_default() as usize);
        });
        hash.floats(&[self.step_ms, self.reference_ms, self.run_limit_s, ASIDE_M]);
        hash.text(self.judged_by);
        hash.count(self.starts as usize);
        hash.flag(self.quick);
        scene_id::digits(hash)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::collections::BTreeMap;

    fn kind(engine: &str, settings: &str) -> EngineKind {
        EngineKind::from_names(engine, Some(settings)).expect("it is known")
    }

    fn run(needs: &BTreeSet<Feature>) -> PeerRun<'_> {
        PeerRun {
            kind: kind("rapier", "default"),
            version: "1",
            scene: "a",
            needs,
            step_ms: 1.0,
            reference_ms: 0.1,
            judged_by: "mm",
            starts: 1,
            run_limit_s: 60.0,
            quick: false,
        }
    }

    #[test]
    fn a_key_changes_with_each_part_of_the_run() {
        let none = BTreeSet::new();
        let restitution = BTreeSet::from([Feature::Restitution]);
        let run = run(&none);
        let others = [
            ("no change", run.clone()),
            ("engine", PeerRun { kind: kind("mujoco", "default"), ..run.clone() }),
            ("options", PeerRun { kind: kind("rapier", "default+length_unit=0.05"), ..run.clone() }),
            ("version", PeerRun { version: "2", ..run.clone() }),
            ("scene", PeerRun { scene: "b", ..run.clone() }),
            ("features", PeerRun { needs: &restitution, ..run.clone() }),
            ("step", PeerRun { step_ms: 2.0, ..run.clone() }),
            ("reference", PeerRun { reference_ms: 0.2, ..run.clone() }),
            ("figure", PeerRun { judged_by: "m", ..run.clone() }),
            ("starts", PeerRun { starts: 8, ..run.clone() }),
            ("limit", PeerRun { run_limit_s: 100.0, ..run.clone() }),
            ("quick", PeerRun { quick: true, ..run.clone() }),
        ];
        let mut keys: BTreeMap<String, &str> = BTreeMap::new();
        for (what, other) in &others {
            let before = keys.insert(other.key().expect("a peer"), what);
            assert_eq!(before, None, "{what}");
        }
        assert_eq!(PeerRun { kind: EngineKind::Own, ..run }.key(), None, "ours has none");
    }

    #[test]
    fn a_new_name_of_settings_keeps_their_runs() {
        let EngineKind::Rapier(settings) = kind("rapier", "stiff120") else { panic!("rapier's") };
        let mut renamed = *settings;
        (renamed.name, renamed.about) = ("other", "other");
        let renamed = EngineKind::Rapier(Box::leak(Box::new(renamed)));
        assert_eq!(renamed.options(), kind("rapier", "stiff120").options());
    }

    /// To teach an adapter restitution leaves its runs of scenes without it.
    #[test]
    fn the_revision_of_a_feature_counts_in_scenes_that_need_it() {
        let before = Adapter { engine: "rapier", revision: 1, features: &[] };
        let taught = Adapter { features: &[(Feature::Restitution, 1)], ..before };
        let mended = Adapter { features: &[(Feature::Restitution, 2)], ..before };
        let rewritten = Adapter { revision: 2, ..before };
        let key = |adapter: &Adapter, needs: &BTreeSet<Feature>| run(needs).key_with(adapter);
        let (slides, bounces) = (BTreeSet::new(), BTreeSet::from([Feature::Restitution]));
        assert_eq!(key(&before, &slides), key(&taught, &slides));
        assert_eq!(key(&before, &slides), key(&mended, &slides));
        assert_ne!(key(&before, &bounces), key(&taught, &bounces));
        assert_ne!(key(&taught, &bounces), key(&mended, &bounces));
        assert_ne!(key(&before, &slides), key(&rewritten, &slides));
    }
}
