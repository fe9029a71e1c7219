//! Quotas: an amount for each key, never above a limit.

use parking_lot::Mutex;
use std::collections::HashMap;
use std::hash::Hash;
use std::sync::Arc;

/// The amount in use, by key.
#[derive(Debug)]
pub struct Quotas<K>(Arc<Mutex<HashMap<K, usize>>>);

impl<K> Clone for Quotas<K> {
    fn clone(&self) -> Self {
        Quotas(self.0.clone())
    }
}

impl<K> Default for Quotas<K> {
    fn default() -> Self {
        Quotas(Arc::default())
    }
}

/// An amount of one key. Dropping it gives the amount back.
#[derive(Debug)]
pub struct Quota<K: Eq + Hash> {
    counts: Quotas<K>,
    key: K,
    amount: usize,
}

impl<K: Eq + Hash + Clone> Quotas<K> {
    /// An empty quota of this key.
    pub fn of(&self, key: K) -> Quota<K> {
        Quota { counts: self.clone(), key, amount: 0 }
    }
}

impl<K> Quotas<K> {
    /// The amount of all keys.
    pub fn total(&self) -> usize {
        self.0.lock().values().sum()
    }
}

impl<K: Eq + Hash + Clone> Quota<K> {
    /// Takes more, if all quotas of the key together stay at or below `max`.
    pub fn grow(&mut self, amount: usize, max: usize) -> bool {
        let mut counts = self.counts.0.lock();
        let all = counts.get(&self.key).copied().unwrap_or(0).saturating_add(amount);
        if all > max {
            return false;
        }
        counts.insert(self.key.clone(), all);
        self.amount += amount;
        true
    }
}

impl<K: Eq + Hash> Drop for Quota<K> {
    fn drop(&mut self) {
        let mut counts = self.counts.0.lock();
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
    fn an_amount_is_bounded_and_given_back() {
        let counts = Quotas::default();
        let (mut first, mut second, mut other) = (counts.of("a"), counts.of("a"), counts.of("b"));
        assert!(first.grow(2, 3) && second.grow(1, 3));
        assert!(!second.grow(1, 3));
        assert!(other.grow(3, 3), "another key has a limit of its own");
        drop(first);
        assert!(second.grow(2, 3));
        drop((second, other));
        assert!(counts.0.lock().is_empty());
    }
}
