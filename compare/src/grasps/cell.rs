//! All grasps of a family in an engine at one step.

use super::run::Run;
use super::tally::{Count, wilson};
use crate::peer_key::Kept;
use crate::scene_id;
use crate::trials::play::Ending;
use serde::{Deserialize, Serialize};

/// At one step.
#[derive(Clone, Debug, Serialize, Deserialize)]
pub struct Cell {
    /// ms
    pub step_ms: f64,
    /// Ending of each grasp, in the order of the draw: k kept, o overlapping too deeply, l not lifted, h lost
    /// while held, s lost while shaken, d diverged, n not finished, x not played.
    pub endings: String,
    /// Counts.
    pub count: Count,
    /// Bounds of the proportion kept at 95 %.
    pub wilson: [f64; 2],
    /// [Key](crate::peer_key) of a peer's runs; none of ours.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub key: Option<String>,
    /// Where they are kept from.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub kept: Option<Kept>,
    /// Median of the deepest overlap of the grasps that were not lost, mm.
    pub overlap_mm: Option<f64>,
}

/// The letter of an ending in [`Cell::endings`].
pub(super) fn letter(ending: Ending) -> char {
    match ending {
        Ending::Kept => 'k',
        Ending::Overlapping => 'o',
        Ending::NotLifted => 'l',
        Ending::LostHeld => 'h',
        Ending::LostShaken => 's',
        Ending::Diverged => 'd',
        Ending::NotFinished => 'n',
        Ending::NotPlayed => 'x',
    }
}

impl Cell {
    /// Counts the runs of a family in an engine at one step.
    pub fn of(step_ms: f64, mut runs: Vec<&Run>) -> Self {
        runs.sort_by_key(|run| run.index);
        let count = Count::of(runs.iter().copied());
        let there = |run: &&&Run| matches!(run.fate.ending, Ending::Kept | Ending::Overlapping);
        let mut depths: Vec<f64> = runs.iter().filter(there).map(|run| run.fate.overlap_mm).collect();
        depths.sort_by(f64::total_cmp);
        let keys: Option<Vec<String>> = runs.iter().map(|run| run.key.clone()).collect();
        Cell {
            step_ms,
            endings: runs.iter().map(|run| letter(run.fate.ending)).collect(),
            count,
            key: keys.filter(|keys| !keys.is_empty()).map(|keys| scene_id::of_all(&keys)),
            kept: None,
            wilson: wilson(count.kept, count.of),
            overlap_mm: depths.get(depths.len() / 2).copied(),
        }
    }
}
