//! How much of something each of many has: never more than a limit.

use std::collections::HashMap;
use std::hash::Hash;
use std::sync::{Arc, Mutex, MutexGuard, PoisonError};

/// What everybody has, by who they are.
#[derive(Debug)]
pub(crate) struct Counts<K>(Arc<Mutex<HashMap<K, usize>>>);

impl<K> Clone for Counts<K> {
    fn clone(&self) -> Self {
        Counts(self.0.clone())
    }
}

impl<K> Default for Counts<K> {
    fn default() -> Self {
        Counts(Arc::default())
    }
}

/// What one of them has. Dropping it gives it back.
#[derive(Debug)]
pub(crate) struct Share<K: Eq + Hash> {
    counts: Counts<K>,
    key: K,
    amount: usize,
}

impl<K: Eq + Hash + Clone> Counts<K> {
    /// A share of nothing.
    pub(crate) fn share(&self, key: K) -> Share<K> {
        Share { counts: self.clone(), key, amount: 0 }
    }
}

impl<K> Counts<K> {
    fn lock(&self) -> MutexGuard<'_, HashMap<K, usize>> {
        // Nothing panics while it holds the lock; if something did, the map would still be whole.
        self.0.lock().unwrap_or_else(PoisonError::into_inner)
    }
}

impl<K: Eq + Hash + Clone> Share<K> {
    /// Takes more, if all its shares together then have at most `most`.
    pub(crate) fn grow(&mut self, amount: usize, most: usize) -> bool {
        let mut counts = self.counts.lock();
        let all = counts.get(&self.key).copied().unwrap_or(0).saturating_add(amount);
        if all > most {
            return false;
        }
        counts.insert(self.key.clone(), all);
        self.amount += amount;
        true
    }
}

impl<K: Eq + Hash> Drop for Share<K> {
    fn drop(&mut self) {
        let mut counts = self.counts.lock();
        if let Some(all) = counts.get_mut(&self.key) {
            *all = all.saturating_sub(self.amount);
            if *all == 0 {
                counts.remove(&self.key);
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn what_one_has_is_bounded_and_given_back() {
        let counts = Counts::default();
        let (mut first, mut second, mut other) = (counts.share("a"), counts.share("a"), counts.share("b"));
        assert!(first.grow(2, 3) && second.grow(1, 3));
        assert!(!second.grow(1, 3));
        assert!(other.grow(3, 3), "nobody pays for another");
        drop(first);
        assert!(second.grow(2, 3));
        drop((second, other));
        assert!(counts.lock().is_empty());
    }
}
