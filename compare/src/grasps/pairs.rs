//! Ours beside the engine before: the same grasps, in pairs.

use super::row::OutcomeRow;
use serde::{Deserialize, Serialize};

/// Grasps of two engines of ours.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
pub(crate) struct Pairs {
    /// Commit of the engine before.
    pub commit: String,
    /// Its fingerprint.
    pub engine: String,
    /// Plays: a grasp at a step.
    pub plays: usize,
    /// Plays that the engine before keeps.
    pub kept_before: usize,
    /// Of these, those that ours loses.
    pub lost: usize,
    /// Plays that the engine before loses and ours keeps.
    pub gained: usize,
    /// Grasps. One that is kept at most of its steps counts as kept: its steps are not independent.
    pub grasps: usize,
    /// Grasps that the engine before keeps and ours loses.
    pub grasps_lost: usize,
    /// The other way round.
    pub grasps_gained: usize,
}

impl Pairs {
    /// McNemar's exact test of the grasps, two-sided (McNemar 1947; the binomial distribution in place of χ²).
    pub(crate) fn p(&self) -> f64 {
        mcnemar(self.grasps_lost, self.grasps_gained)
    }
}

/// The probability of a split at least as uneven as that of `a` and `b` if each of both is as likely.
fn mcnemar(a: usize, b: usize) -> f64 {
    let n = a + b;
    // 2 ⁻ⁿ times the binomial coefficients, each from the one before.
    let mut term = libm::exp2(-(n as f64));
    let mut sum = 0.0;
    for k in 0..=a.min(b) {
        sum += term;
        term *= (n - k) as f64 / (k + 1) as f64;
    }
    (2.0 * sum).min(1.0)
}

/// The pairs of our rows of two tables; none where no two rows have the same grasps at the same steps.
pub(super) fn of<'a>(
    [commit, engine]: [&str; 2],
    before: impl Iterator<Item = &'a OutcomeRow> + Clone,
    now: impl Iterator<Item = &'a OutcomeRow>,
) -> Option<Pairs> {
    let mut pairs = Pairs {
        commit: commit.to_owned(),
        engine: engine.to_owned(),
        plays: 0,
        kept_before: 0,
        lost: 0,
        gained: 0,
        grasps: 0,
        grasps_lost: 0,
        grasps_gained: 0,
    };
    for row in now.filter(|row| row.scenes.is_some()) {
        let same =
            |it: &&OutcomeRow| (&it.hand, &it.family, &it.scenes) == (&row.hand, &row.family, &row.scenes);
        if let Some(before) = before.clone().find(same) {
            pairs.add(before, row);
        }
    }
    (pairs.plays > 0).then_some(pairs)
}

impl Pairs {
    fn add(&mut self, before: &OutcomeRow, now: &OutcomeRow) {
        let steps: Vec<[&[u8]; 2]> = now
            .cells
            .iter()
            .filter_map(|cell| {
                let same = before.cells.iter().find(|it| it.step_ms == cell.step_ms)?;
                Some([same.endings.as_bytes(), cell.endings.as_bytes()])
            })
            .filter(|[before, now]| before.len() == now.len())
            .collect();
        for grasp in 0..steps.first().map_or(0, |[before, _]| before.len()) {
            let mut kept = [0, 0];
            for pair in &steps {
                let [before, now] = pair.map(|endings| endings[grasp] == b'k');
                self.plays += 1;
                self.kept_before += usize::from(before);
                self.lost += usize::from(before && !now);
                self.gained += usize::from(now && !before);
                kept = [kept[0] + usize::from(before), kept[1] + usize::from(now)];
            }
            let [before, now] = kept.map(|kept| 2 * kept > steps.len());
            self.grasps += 1;
            self.grasps_lost += usize::from(before && !now);
            self.grasps_gained += usize::from(now && !before);
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use std::path::Path;

    #[test]
    fn mcnemars_exact_test_is_the_binomial() {
        // R: binom.test(1, 10)$p.value, binom.test(5, 20), binom.test(0, 6), binom.test(4, 8).
        for (a, b, p) in [(1, 9, 0.021484375), (15, 5, 0.04138947), (0, 6, 0.03125), (4, 4, 1.0), (0, 0, 1.0)]
        {
            assert!((mcnemar(a, b) - p).abs() < 1e-8, "{a} {b}: {}", mcnemar(a, b));
        }
    }

    #[test]
    fn plays_are_counted_one_by_one_and_grasps_by_most_of_their_steps() {
        let page = Path::new(env!("CARGO_MANIFEST_DIR")).join("../docs/report/grasps/grasps.json");
        let text = std::fs::read_to_string(page).expect("the page's counts");
        let mut table: serde_json::Value = serde_json::from_str(&text).expect("JSON");
        let mut now: OutcomeRow = serde_json::from_value(table["rows"][0].take()).expect("a row");
        now.scenes = Some("a".into());
        now.cells.truncate(3);
        let mut before = now.clone();
        for (row, endings) in [(&mut before, ["kkl", "kkl", "kkl"]), (&mut now, ["klk", "klk", "kks"])] {
            for (cell, endings) in row.cells.iter_mut().zip(endings) {
                cell.endings = endings.to_owned();
            }
        }
        let pair = |now: &OutcomeRow| of(["c", "e"], [&before].into_iter(), [now].into_iter());
        let pairs = pair(&now).expect("the same grasps");
        assert_eq!((pairs.plays, pairs.kept_before, pairs.lost, pairs.gained), (9, 6, 2, 2));
        assert_eq!((pairs.grasps, pairs.grasps_lost, pairs.grasps_gained), (3, 1, 1));
        now.scenes = Some("b".into());
        assert_eq!(pair(&now), None, "other grasps are no pairs");
    }
}
