//! Islands: groups of bodies that push each other. Each is solved for itself, and one at rest sleeps.

use crate::contact::narrow_phase::{ContactPair, Contacts};
use crate::model::{Model, Owner};

/// Bodies that are coupled in this step.
#[derive(Clone, Debug, Default)]
pub struct Island {
    /// Whether the hand is part of it.
    pub hand: bool,
    /// Objects, ascending.
    pub objects: Vec<usize>,
    /// Places in [`Contacts::pairs`], ascending.
    pub pairs: Vec<usize>,
}

/// The partition of all bodies, by union-find; node 0 is the hand, node k + 1 is object k.
#[derive(Clone, Debug, Default)]
pub struct Islands {
    parent: Vec<usize>,
    island_of: Vec<usize>,
    islands: Vec<Island>,
    len: usize,
    /// Whether everybody is alone.
    apart: bool,
}

impl Islands {
    /// Partitions the bodies by the step's contact pairs.
    pub fn update(&mut self, model: &Model, contacts: &Contacts) {
        let nodes = model.objects().len() + 1;
        let apart = contacts.pairs.is_empty();
        if apart && self.apart && self.parent.len() == nodes {
            return;
        }
        self.apart = apart;
        self.parent.clear();
        self.parent.extend(0..nodes);
        for pair in &contacts.pairs {
            if let (Some(a), Some(b)) = (node(pair.a), node(pair.b)) {
                let (a, b) = (self.root(a), self.root(b));
                // The smaller number leads, so that the partition does not depend on the order of pairs.
                self.parent[a.max(b)] = a.min(b);
            }
        }
        self.len = 0;
        self.island_of.clear();
        self.island_of.resize(nodes, usize::MAX);
        for i in 0..nodes {
            if i == 0 && model.hand().is_none() {
                continue;
            }
            let root = self.root(i);
            if self.island_of[root] == usize::MAX {
                self.island_of[root] = self.len;
                if self.islands.len() == self.len {
                    self.islands.push(Island::default());
                }
                let island = &mut self.islands[self.len];
                island.hand = false;
                island.objects.clear();
                island.pairs.clear();
                self.len += 1;
            }
            let island = &mut self.islands[self.island_of[root]];
            if i == 0 {
                island.hand = true;
            } else {
                island.objects.push(i - 1);
            }
        }
        for (k, pair) in contacts.pairs.iter().enumerate() {
            let island = self.of_pair(pair);
            self.islands[island].pairs.push(k);
        }
    }

    fn of_pair(&mut self, pair: &ContactPair) -> usize {
        let node = node(pair.b).or(node(pair.a)).unwrap_or(0);
        let root = self.root(node);
        self.island_of[root]
    }

    fn root(&mut self, mut i: usize) -> usize {
        while self.parent[i] != i {
            self.parent[i] = self.parent[self.parent[i]];
            i = self.parent[i];
        }
        i
    }

    /// The islands of the last update.
    pub fn list(&self) -> &[Island] {
        &self.islands[..self.len]
    }
}

fn node(owner: Owner) -> Option<usize> {
    match owner {
        Owner::Static => None,
        Owner::Link(_) => Some(0),
        Owner::Object(k) => Some(k + 1),
    }
}
