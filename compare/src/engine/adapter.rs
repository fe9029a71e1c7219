//! What the adapters pass on to their engines. A scene that needs anything else is not played, which says nothing about the
//! engine.
//!
//! A peer's run is kept until something changes that its outcome depends on. An adapter's source is such a thing: each adapter
//! has a revision, and so has each [`Feature`] that it passes on. A change of an adapter's source that changes outcomes raises
//! the revision of the part whose outcomes it changes, and only the runs that need this part are played again.

use palmares_sim::model::Collider;
use palmares_sim::{BaseCommand, Command, Model};
use std::collections::BTreeSet;

/// An adapter does not pass on what a scene needs.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("not played: {0}")]
pub struct NotPlayed(pub String);

/// A part of a scene that not every scene has.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Feature {
    /// A hand.
    Hand,
    /// Tendons whose R depends on q.
    CurvedTendons,
    /// Springs across joints and closed chains.
    Springs,
    /// Motors that a load slows.
    SlowedMotors,
    /// Friction of cables at their guides.
    Guides,
    /// Drives that no load turns back.
    HeldDrives,
    /// Soft pads.
    Pads,
    /// Dry friction of joints.
    JointFriction,
    /// Friction against spin and rolling resistance.
    Levers,
    /// Motors with a part of their force.
    PartialEffort,
    /// Surfaces that rebound.
    Restitution,
    /// Forces on a hand from outside.
    Pushes,
    /// A hand whose base nothing holds any more.
    FreeBase,
}

impl Feature {
    /// In words.
    fn words(self) -> &'static str {
        match self {
            Feature::Hand => "hands",
            Feature::CurvedTendons => "tendons whose R depends on q",
            Feature::Springs => "springs across joints and closed chains",
            Feature::SlowedMotors => "motors that a load slows",
            Feature::Guides => "friction of cables at guides",
            Feature::HeldDrives => "drives that no load turns back",
            Feature::Pads => "soft pads",
            Feature::JointFriction => "dry friction of joints",
            Feature::Levers => "friction against spin and rolling resistance",
            Feature::PartialEffort => "motors with a part of their force",
            Feature::Restitution => "restitution",
            Feature::Pushes => "forces from outside",
            Feature::FreeBase => "a base servo that is switched off",
        }
    }

    /// The features of a scene.
    pub fn of_scene(model: &Model) -> BTreeSet<Feature> {
        let mut features = BTreeSet::new();
        if let Some(hand) = model.hand() {
            let has = [
                (Feature::Hand, true),
                (Feature::CurvedTendons, hand.tendons.iter().any(|it| !it.elements.is_empty())),
                (Feature::Springs, !(hand.springs.is_empty() && hand.linkages.is_empty())),
                (Feature::SlowedMotors, hand.motors.iter().any(|motor| motor.slows())),
                (Feature::Guides, hand.tendons.iter().any(|it| !it.guides.is_empty())),
                (Feature::HeldDrives, hand.tendons.iter().any(|it| it.hold_limit.is_some())),
                (Feature::Pads, !hand.pads.is_empty()),
                (Feature::JointFriction, hand.coordinates.iter().any(|it| it.friction > 0.0)),
            ];
            features.extend(has.into_iter().filter(|(_, has)| *has).map(|(feature, _)| feature));
        }
        let any = |has: fn(&Collider) -> bool| model.colliders().iter().any(has);
        if any(|it| it.restitution > 0.0) {
            features.insert(Feature::Restitution);
        }
        if any(|it| it.rolling_friction > 0.0 || it.spin.lever > 0.0) {
            features.insert(Feature::Levers);
        }
        features
    }

    /// The features of a command in a scene.
    pub fn of_command(model: &Model, command: &Command) -> BTreeSet<Feature> {
        let base = &model.config().base;
        let servo = model.hand().is_some() && !base.bolted && base.stiffness != 0.0;
        let has = [
            (Feature::Pushes, !command.pushes.is_empty()),
            (Feature::FreeBase, servo && command.base == BaseCommand::Free),
            (Feature::PartialEffort, command.effort.iter().any(|it| *it < 1.0)),
        ];
        has.into_iter().filter(|(_, has)| *has).map(|(feature, _)| feature).collect()
    }
}

/// The parts of a scene that an adapter passes on to its engine.
pub struct Adapter {
    /// Name of the engine.
    pub engine: &'static str,
    /// Raised by a change of the outcomes of scenes that need no feature, too.
    pub revision: u32,
    /// The features that it passes on, each with a revision: raised by a change of the outcomes of scenes that need it.
    pub features: &'static [(Feature, u32)],
}

impl Adapter {
    /// rapier's.
    pub const RAPIER: Adapter = Adapter {
        engine: "rapier",
        revision: 1,
        features: &[
            (Feature::Hand, 1),
            // 2: a pair has the larger of its two coefficients.
            (Feature::Restitution, 2),
            // 2: a force ends with its command.
            (Feature::Pushes, 2),
            // 2: the servo is switched off.
            (Feature::FreeBase, 2),
        ],
    };
    /// MuJoCo's.
    pub const MUJOCO: Adapter = Adapter {
        engine: "mujoco",
        revision: 1,
        features: &[
            (Feature::Hand, 1),
            (Feature::JointFriction, 1),
            (Feature::Levers, 1),
            (Feature::Restitution, 1),
            (Feature::Pushes, 1),
            (Feature::FreeBase, 1),
        ],
    };
    /// Drake's: rigid bodies alone, and Drake has no coefficient of restitution.
    pub const DRAKE: Adapter = Adapter { engine: "drake", revision: 1, features: &[] };
    /// All.
    pub const ALL: [Adapter; 3] = [Adapter::RAPIER, Adapter::MUJOCO, Adapter::DRAKE];

    /// Whether it passes on a scene.
    ///
    /// # Errors
    /// The first feature that it does not pass on.
    pub fn takes(&self, model: &Model) -> Result<(), NotPlayed> {
        self.all_of(&Feature::of_scene(model))
    }

    /// Whether it passes on a command in a scene.
    ///
    /// # Errors
    /// The first feature that it does not pass on.
    pub fn obeys(&self, model: &Model, command: &Command) -> Result<(), NotPlayed> {
        self.all_of(&Feature::of_command(model, command))
    }

    /// Whether it passes on features.
    ///
    /// # Errors
    /// The first that it does not pass on.
    pub fn all_of(&self, needed: &BTreeSet<Feature>) -> Result<(), NotPlayed> {
        match needed.iter().find(|feature| self.revision_of(**feature).is_none()) {
            Some(feature) => Err(NotPlayed(format!("its adapter does not pass on {}", feature.words()))),
            None => Ok(()),
        }
    }

    /// The revision of a feature that it passes on.
    pub fn revision_of(&self, feature: Feature) -> Option<u32> {
        self.features.iter().find(|(it, _)| *it == feature).map(|(_, revision)| *revision)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use palmares_models::content::ContentHash;
    use std::fs;
    use std::path::{Path, PathBuf};

    /// The hashes of the adapters' sources, beside this file.
    const HASHES: &str = "src/engine/adapter_sources.txt";
    /// Source files and folders of each adapter, from the folder of the crate.
    const SOURCES: [(&str, &[&str]); 3] = [
        ("rapier", &["src/engine/rapier"]),
        ("mujoco", &["src/engine/mujoco", "src/engine/worker.rs", "python/mujoco_worker.py"]),
        ("drake", &["src/engine/drake", "src/engine/worker.rs", "python/drake_worker.py"]),
    ];

    fn files(path: &Path) -> Vec<PathBuf> {
        if path.is_file() {
            return vec![path.to_owned()];
        }
        let entries = fs::read_dir(path).expect("the adapter's folder");
        let mut all: Vec<PathBuf> =
            entries.flat_map(|entry| files(&entry.expect("an entry").path())).collect();
        all.sort();
        all
    }

    fn hash(sources: &[&str]) -> String {
        let root = Path::new(env!("CARGO_MANIFEST_DIR"));
        let mut hash = ContentHash::of("sources of an adapter");
        for file in sources.iter().flat_map(|source| files(&root.join(source))) {
            let name =
                file.strip_prefix(root).expect("a file of the crate").to_string_lossy().replace('\\', "/");
            hash.text(&name);
            hash.text(&fs::read_to_string(&file).expect("a text"));
        }
        hash.to_hex()[..16].to_owned()
    }

    #[test]
    fn a_changed_adapter_has_its_revisions_looked_at() {
        let line = |(engine, sources): &(&str, &[&str])| {
            let adapter = Adapter::ALL.into_iter().find(|adapter| adapter.engine == *engine);
            let Adapter { revision, features, .. } = adapter.expect("an adapter of this name");
            let features = features.iter().map(|(feature, revision)| format!(" {feature:?} {revision}"));
            format!("{engine} {revision}{} {}\n", features.collect::<String>(), hash(sources))
        };
        let now: String = SOURCES.iter().map(line).collect();
        let path = Path::new(env!("CARGO_MANIFEST_DIR")).join(HASHES);
        if std::env::var_os("PALMARES_WRITE_ADAPTERS").is_some() {
            fs::write(&path, &now).expect("written");
        }
        let committed = fs::read_to_string(&path).unwrap_or_default();
        assert_eq!(
            committed, now,
            "the source of an adapter has changed. If some of its outcomes change, raise in compare/src/engine/adapter.rs the \
             revision of the feature whose outcomes change, or that of the whole adapter: kept runs that need it are then \
             played again. Afterwards `PALMARES_WRITE_ADAPTERS=1 cargo test -p palmares-compare --lib revisions` writes {HASHES}"
        );
    }

    #[test]
    fn a_feature_that_is_not_passed_on_is_named() {
        let needed = BTreeSet::from([Feature::Hand, Feature::Restitution]);
        let why = Adapter { features: &[(Feature::Hand, 1)], ..Adapter::RAPIER }.all_of(&needed);
        assert_eq!(why, Err(NotPlayed("its adapter does not pass on restitution".into())));
        assert_eq!(Adapter::RAPIER.all_of(&needed), Ok(()));
    }
}
