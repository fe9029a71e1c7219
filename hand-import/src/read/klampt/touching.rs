//! Pairs of links that touch each other, and pairs that do not.

use super::super::reading::Reading;
use super::robot::Robot;
use crate::decision::At;
use crate::draft::Draft;

impl Robot<'_> {
    /// `selfcollision` lists the pairs that touch; without it all do, but for those of `noselfcollision`.
    pub(super) fn touching(&self, draft: &mut Draft, reading: &mut Reading<'_>) {
        let pairs = |keyword: &str, reading: &mut Reading<'_>| {
            let mut found = Vec::new();
            for pair in
                self.lines.iter().filter(|line| line.keyword == keyword).flat_map(|line| line.words.chunks(2))
            {
                match pair.iter().map(|word| self.index(word)).collect::<Option<Vec<usize>>>().as_deref() {
                    Some(&[a, b]) if a != b => found.push([a.min(b), a.max(b)]),
                    _ => {
                        let text = format!("'{}' is no pair of links", pair.join(" "));
                        reading.log.problem(At::Hand, format!("`{keyword}`"), text);
                    }
                }
            }
            found
        };
        let mut excluded = pairs("noselfcollision", reading);
        let touching = pairs("selfcollision", reading);
        if !touching.is_empty() {
            let n = self.names.len();
            let all = (0..n).flat_map(|a| (a + 1..n).map(move |b| [a, b]));
            let shaped =
                |i: usize| draft.links.iter().any(|l| l.name == self.names[i] && !l.collisions.is_empty());
            excluded.extend(all.filter(|&[a, b]| !touching.contains(&[a, b]) && shaped(a) && shaped(b)));
            let text = format!("only {} pairs of links touch each other", touching.len());
            reading.log.taken(At::Hand, "`selfcollision`", text);
        }
        excluded.sort_unstable();
        excluded.dedup();
        draft.exclusions.extend(excluded.into_iter().map(|pair| pair.map(|i| self.names[i].clone())));
    }
}
