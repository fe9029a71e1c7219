//! Successive halving (Jamieson and Talwalkar 2016): all sets of options play a few plays, the best third of them twice as many,
//! and so on, until the last few have played all. Plays come in an order that is drawn for the scene, so that a few of them are a
//! sample of all. No set is given up for its own failures, only for sets whose plays end better: where no set solves any play
//! yet, all that end equally go on.
//!
//! The named sets go first. Each round after it starts from the best set whose single changes were not tried yet: it and all of
//! them. A change of a change is a pair.

use super::score::{Outcome, Score};
use crate::engine::EngineKind;
use crate::engine::option_set::Dimension;
use anyhow::Result;
use palmares_bench::random::Random;
use std::cmp::Ordering;
use std::collections::{BTreeMap, BTreeSet};

/// Seed of the orders.
const SEED: u64 = 50;
/// Part of all plays that every set plays, one in so many, and their least number.
const FIRST: usize = 8;
const LEAST: usize = 2;
/// Of so many sets the best one goes on.
const KEPT: usize = 3;

/// Plays sets of options.
pub(super) trait Player {
    /// The outcomes of plays, each a set and a number below that of all plays, in this order. None if there is no time left.
    ///
    /// # Errors
    /// An engine cannot be started.
    fn play(&self, asked: &[(EngineKind, usize)]) -> Result<Option<Vec<Outcome>>>;
}

/// The numbers below `plays`, in the order that is drawn for a scene.
pub(super) fn order(scene: &str, plays: usize) -> Vec<usize> {
    let seed = scene.bytes().fold(SEED, |seed, byte| seed.wrapping_mul(31).wrapping_add(u64::from(byte)));
    let (mut random, mut left) = (Random::new(seed), (0..plays).collect::<Vec<_>>());
    (0..plays).map(|_| left.remove(random.below(left.len()))).collect()
}

/// A search in one scene.
pub(super) struct Halving<'a> {
    player: &'a dyn Player,
    order: Vec<usize>,
    /// The sets that were tried, by name, with their outcomes in this order.
    known: BTreeMap<&'static str, (EngineKind, Vec<Outcome>)>,
    expanded: BTreeSet<&'static str>,
}

impl<'a> Halving<'a> {
    /// Begins a search in a scene of so many plays.
    pub(super) fn new(player: &'a dyn Player, scene: &str, plays: usize) -> Self {
        let order = order(scene, plays);
        Halving { player, order, known: BTreeMap::new(), expanded: BTreeSet::new() }
    }

    /// Tries named sets, and in each of `rounds` the single changes of the best set that has not had its round; then it plays all
    /// plays of further sets. Ends early where there is no time.
    ///
    /// # Errors
    /// An engine cannot be started.
    pub(super) fn run(&mut self, named: &[EngineKind], rounds: usize, further: &[EngineKind]) -> Result<()> {
        let mut in_time = self.halve(named.to_vec())?;
        for _ in 0..rounds {
            let Some(best) = self.next().filter(|_| in_time) else { break };
            let changes = best.space().iter().flat_map(|Dimension(option, values)| {
                values.iter().filter_map(move |value| best.changed(option, value))
            });
            let fresh = changes.filter(|kind| !self.known.contains_key(kind.settings()));
            let sets: Vec<EngineKind> = std::iter::once(best).chain(fresh).collect();
            in_time = self.halve(sets)?;
        }
        if in_time {
            self.play(further, self.order.len())?;
        }
        Ok(())
    }

    /// The best of the sets that played all plays.
    pub(super) fn best(&self) -> Option<(EngineKind, Score)> {
        self.whole().into_iter().next()
    }

    /// The best set that played all plays and whose changes were not tried.
    fn next(&mut self) -> Option<EngineKind> {
        let mut sets = self.whole().into_iter().map(|(kind, _)| kind);
        let best = sets.find(|kind| !self.expanded.contains(kind.settings()))?;
        self.expanded.insert(best.settings());
        Some(best)
    }

    /// The sets that played all plays, the best first; of equal ones the first name.
    fn whole(&self) -> Vec<(EngineKind, Score)> {
        let all = self.known.values().filter(|(_, plays)| plays.len() == self.order.len());
        let mut all: Vec<_> = all.map(|(kind, plays)| (*kind, Score::of(plays))).collect();
        all.sort_by(|(_, a), (_, b)| a.order(b));
        all
    }

    /// One halving; `false` if the time was up.
    fn halve(&mut self, mut sets: Vec<EngineKind>) -> Result<bool> {
        let all = self.order.len();
        let mut upto = all.div_ceil(FIRST).max(LEAST).min(all);
        while self.play(&sets, upto)? {
            if upto == all {
                return Ok(true);
            }
            let score = |kind: &EngineKind| Score::of(&self.known[kind.settings()].1[..upto]);
            sets.sort_by(|a, b| score(a).order(&score(b)).then(a.settings().cmp(b.settings())));
            let best = score(&sets[0]);
            // Where nothing is solved yet, nothing tells the sets apart that end equally.
            let equal = |kind: &&EngineKind| best.solved == 0 && score(kind).ends(&best) == Ordering::Equal;
            let equal = sets.iter().take_while(equal).count();
            sets.truncate(equal.max(sets.len().div_ceil(KEPT)));
            upto = all.min(2 * upto);
        }
        Ok(false)
    }

    /// Lets sets play what they have not played of the first `upto` plays; `false` if the time was up.
    fn play(&mut self, sets: &[EngineKind], upto: usize) -> Result<bool> {
        let played = |kind: &EngineKind| self.known.get(kind.settings()).map_or(0, |it| it.1.len());
        let missing = |kind: EngineKind| {
            let numbers = self.order.get(played(&kind)..upto).unwrap_or_default();
            numbers.iter().map(move |number| (kind, *number))
        };
        let asked: Vec<(EngineKind, usize)> = sets.iter().copied().flat_map(missing).collect();
        let Some(outcomes) = self.player.play(&asked)? else { return Ok(false) };
        for (&(kind, _), outcome) in asked.iter().zip(outcomes) {
            self.known.entry(kind.settings()).or_insert((kind, Vec::new())).1.push(outcome);
        }
        Ok(true)
    }
}
