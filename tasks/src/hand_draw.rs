//! The hand of a run with numbers drawn from the ranges of its `[uncertain]`.

use crate::seed::Seed;
use palmares_models::hand::{Hand, Uncertain};
use palmares_senses::noise::{Noise, Sample};
use std::sync::Arc;

/// How the uncertain numbers of the hand of a run are drawn.
#[derive(Clone, Debug, Default, PartialEq)]
pub enum HandDraw {
    /// They are not: the hand is itself.
    #[default]
    Own,
    /// All of them by the run's seed.
    All,
    /// The numbers of these names, by the run's seed.
    Named(Vec<String>),
    /// All of them by a place in a Latin hypercube: over its `count` samples each number takes each of `count` equal parts of its
    /// range once (McKay, Beckman and Conover 1979).
    Sample {
        /// Which sample, from 0 on.
        index: u32,
        /// Number of samples.
        count: u32,
    },
}

/// Largest number of samples of a Latin hypercube.
pub const MOST_SAMPLES: u32 = 1_000_000;

impl HandDraw {
    /// Whether the hand is itself.
    pub fn is_own(&self) -> bool {
        *self == HandDraw::Own
    }

    /// The entries of a hand that are drawn.
    pub fn entries<'a>(&self, hand: &'a Hand) -> Vec<&'a Uncertain> {
        hand.uncertain.iter().filter(|entry| self.draws(entry)).collect()
    }

    fn draws(&self, entry: &Uncertain) -> bool {
        match self {
            HandDraw::Own => false,
            HandDraw::All | HandDraw::Sample { .. } => true,
            HandDraw::Named(names) => names.contains(&entry.name),
        }
    }

    /// Checks the draw for a hand.
    ///
    /// # Errors
    /// The hand has no uncertain numbers, or not the named ones, or the sample is out of range.
    pub fn check(&self, hand: &Hand) -> Result<(), String> {
        let known = || hand.uncertain.iter().map(|entry| entry.name.as_str()).collect::<Vec<_>>().join(", ");
        match self {
            HandDraw::Own => return Ok(()),
            HandDraw::Named(names) => {
                if let Some(name) = names.iter().find(|name| hand.uncertain.iter().all(|e| e.name != **name))
                {
                    let known = if hand.uncertain.is_empty() { "nothing".to_owned() } else { known() };
                    return Err(format!("found {name:?}; hand `{}` has in [uncertain]: {known}", hand.name));
                }
            }
            HandDraw::Sample { index, count } if index >= count || *count > MOST_SAMPLES => {
                return Err(format!("found sample {index} of {count}; wanted less than {MOST_SAMPLES}"));
            }
            HandDraw::All | HandDraw::Sample { .. } => {}
        }
        if hand.uncertain.is_empty() {
            return Err(format!("hand `{}` has nothing in [uncertain] of its hand.toml", hand.name));
        }
        Ok(())
    }

    /// The drawn number of each of [`HandDraw::entries`]: a function of hand, seed and draw. A number does not depend on
    /// whether another is drawn.
    pub fn numbers(&self, hand: &Hand, seed: Seed) -> Vec<f64> {
        let drawn = self.entries(hand).into_iter();
        drawn.map(|entry| entry.range.at(self.unit(&entry.name, seed))).collect()
    }

    /// The drawn number of each uncertain entry, if it is drawn.
    pub fn each(&self, hand: &Hand, seed: Seed) -> Vec<Option<f64>> {
        let mut numbers = self.numbers(hand, seed).into_iter();
        hand.uncertain.iter().map(|entry| self.draws(entry).then(|| numbers.next()).flatten()).collect()
    }

    /// The drawn hand; the hand itself if nothing is drawn.
    ///
    /// # Errors
    /// The drawn hand is not valid; the ends of valid ranges give valid hands.
    pub fn apply(&self, hand: &Arc<Hand>, seed: Seed) -> Result<Arc<Hand>, String> {
        if self.is_own() {
            return Ok(Arc::clone(hand));
        }
        hand.drawn(&self.each(hand, seed)).map(Arc::new).map_err(|error| error.to_string())
    }

    /// The part of a range, from 0 to 1.
    fn unit(&self, name: &str, seed: Seed) -> f64 {
        match *self {
            HandDraw::Own | HandDraw::All | HandDraw::Named(_) => {
                Noise::keyed("palmares hand draw", &seed.0).sensor(name).sample(0).unit()
            }
            HandDraw::Sample { index, count } => {
                let numbers = Noise::keyed("palmares hand spread", &[0; 32]).sensor(name);
                let part = shuffled(count, &mut numbers.sample(u64::from(count)))[index as usize];
                let within = numbers.sample((1 << 32) + u64::from(index)).unit();
                (f64::from(part) + within) / f64::from(count)
            }
        }
    }
}

/// 0 to `count` − 1 in a random order (Fisher and Yates).
fn shuffled(count: u32, numbers: &mut Sample) -> Vec<u32> {
    let mut order: Vec<u32> = (0..count).collect();
    for k in (1..order.len()).rev() {
        let other = (numbers.unit() * (k + 1) as f64) as usize;
        order.swap(k, other.min(k));
    }
    order
}

#[cfg(test)]
mod tests {
    use super::*;

    fn hand() -> Arc<Hand> {
        Hand::builtin("softhand").expect("built in")
    }

    #[test]
    fn a_draw_is_a_function_of_the_seed_and_each_number_of_its_name_alone() {
        let hand = hand();
        let numbers = |draw: &HandDraw, seed| draw.numbers(&hand, Seed::from_u64(seed));
        let all = numbers(&HandDraw::All, 3);
        assert_eq!(all, numbers(&HandDraw::All, 3));
        assert_ne!(all, numbers(&HandDraw::All, 4));
        let name = hand.uncertain[1].name.clone();
        assert_eq!(numbers(&HandDraw::Named(vec![name]), 3), [all[1]]);
        let drawn = HandDraw::All.apply(&hand, Seed::from_u64(3)).expect("valid");
        let wanted = hand.drawn(&all.iter().map(|x| Some(*x)).collect::<Vec<_>>()).expect("valid");
        assert_eq!(drawn.content_hash(), wanted.content_hash());
        assert!(Arc::ptr_eq(&HandDraw::Own.apply(&hand, Seed::from_u64(3)).expect("valid"), &hand));
    }

    /// The first word of ChaCha8 under SHA-256(SHA-256("palmares hand draw" ‖ seed) ‖ name), by another implementation.
    #[test]
    fn a_draw_has_the_same_bits_everywhere() {
        let unit = HandDraw::All.unit("friction", Seed::from_u64(1));
        assert_eq!(unit, (699_326_801.0 + 0.5) / 4_294_967_296.0);
    }

    #[test]
    fn a_hypercube_fills_every_part_of_every_range_once() {
        let (hand, count) = (hand(), 40);
        for (k, entry) in hand.uncertain.iter().enumerate() {
            let [low, high] = entry.range.ends();
            let part = |index| {
                let draw = HandDraw::Sample { index, count };
                let number = draw.numbers(&hand, Seed::from_u64(9))[k];
                ((number / low).ln() / (high / low).ln() * f64::from(count)) as u32
            };
            let order: Vec<u32> = (0..count).map(part).collect();
            let mut sorted = order.clone();
            sorted.sort_unstable();
            assert_eq!(sorted, (0..count).collect::<Vec<_>>(), "{}", entry.name);
            assert_ne!(order, sorted);
        }
    }

    #[test]
    fn a_hand_that_cannot_be_drawn_is_refused() {
        let pinch = Hand::builtin("pinch").expect("built in");
        let error = HandDraw::All.check(&pinch).expect_err("nothing is uncertain");
        assert_eq!(error, "hand `pinch` has nothing in [uncertain] of its hand.toml");
        let named = HandDraw::Named(vec!["slip".to_owned()]);
        let error = named.check(&hand()).expect_err("there is no slip");
        assert!(
            error.starts_with("found \"slip\"; hand `softhand` has in [uncertain]: damping, "),
            "{error}"
        );
        let sample = HandDraw::Sample { index: 4, count: 4 };
        assert!(sample.check(&hand()).expect_err("the last is 3").contains("sample 4 of 4"));
        assert_eq!(HandDraw::All.check(&hand()), Ok(()));
    }
}
