//! Islands: groups of bodies that press on each other. Each is solved on its own, and an island at rest
//! sleeps.

use crate::contact::left_out::LeftOut;
use crate::contact::narrow_phase::Contacts;
use crate::model::{Model, Owner};

/// Bodies that are coupled in this step.
#[derive(Clone, Debug, Default)]
pub struct Island {
    /// Whether the hand is part of it.
    pub hand: bool,
    /// Objects, ascending.
    pub objects: Vec<usize>,
    /// Indices in [`Contacts::pairs`], ascending.
    pub pairs: Vec<usize>,
    /// Indices in [`Contacts::left_out`], ascending.
    pub left_out: Vec<usize>,
}

impl Island {
    /// Whether it is a single object that touches at most furniture.
    pub fn is_lone_object(&self) -> bool {
        !self.hand && self.objects.len() == 1
    }
}

/// The partition of all bodies, by union-find; node 0 is the hand, node k + 1 is object k.
#[derive(Clone, Debug, Default)]
pub struct Islands {
    parent: Vec<usize>,
    island_of: Vec<usize>,
    islands: Vec<Island>,
    len: usize,
    /// Whether something was left out of an island.
    any_left_out: bool,
    /// Whether all islands have one body.
    all_singletons: bool,
}

impl Islands {
    /// Partitions the bodies by the step's contact pairs.
    pub fn update(&mut self, model: &Model, contacts: &Contacts) {
        let nodes = model.objects().len() + 1;
        let all_singletons = contacts.pairs.is_empty();
        if all_singletons && self.all_singletons && self.parent.len() == nodes {
            return;
        }
        self.all_singletons = all_singletons;
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
            let island = self.of_pair(pair.a, pair.b);
            self.islands[island].pairs.push(k);
        }
    }

    /// Gives every island what was left out of it; nothing lies between two islands.
    pub fn distribute(&mut self, left_out: &[LeftOut], owners: impl Fn(&LeftOut) -> [Owner; 2]) {
        if std::mem::replace(&mut self.any_left_out, !left_out.is_empty()) {
            self.islands.iter_mut().for_each(|island| island.left_out.clear());
        }
        for (k, left) in left_out.iter().enumerate() {
            if !left.joined {
                let [a, b] = owners(left);
                let island = self.of_pair(a, b);
                self.islands[island].left_out.push(k);
            }
        }
    }

    /// Whether something between these bodies cannot wait for the solution of an island: it lies between two, or the island is a
    /// lone object.
    pub fn cannot_wait(&mut self, [a, b]: [Owner; 2]) -> bool {
        match (node(a), node(b)) {
            (Some(a), Some(b)) => self.root(a) != self.root(b),
            _ => {
                let island = self.of_pair(a, b);
                self.islands[island].is_lone_object()
            }
        }
    }

    #[inline]
    fn of_pair(&mut self, a: Owner, b: Owner) -> usize {
        let node = node(b).or(node(a)).unwrap_or(0);
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

    /// The same, to be changed.
    pub fn list_mut(&mut self) -> &mut [Island] {
        &mut self.islands[..self.len]
    }
}

fn node(owner: Owner) -> Option<usize> {
    match owner {
        Owner::Static => None,
        Owner::Link(_) => Some(0),
        Owner::Object(k) => Some(k + 1),
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::config::Config;
    use crate::contact::narrow_phase::ContactPair;
    use palmares_models::object::Object;
    use palmares_models::shape::Shape;
    use palmares_models::{Pose, Vec3};
    use std::sync::Arc;

    fn pair(a: Owner, b: Owner) -> ContactPair {
        ContactPair {
            a,
            b,
            origin: Vec3::ZERO,
            friction: 0.5,
            rolling_friction: 0.0,
            spin: None,
            restitution: 0.0,
            initial_overlap: 0.0,
            beside: Vec3::ZERO,
            points: 0..0,
            pair: 0,
        }
    }

    #[test]
    fn who_touches_shares_an_island_whatever_the_order_and_furniture_joins_nobody() {
        let mut model = Model::new(Config::default(), None).expect("no hand");
        for k in 0..5 {
            let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.1 })];
            let ball = Object::new(format!("{k}"), parts, 1.0, 0.5, 0.0).expect("sound");
            model.add_object(Arc::new(ball)).expect("it fits");
        }
        let (fixed, object) = (Owner::Static, Owner::Object);
        let mut pairs = vec![
            pair(object(3), object(1)),
            pair(fixed, object(0)),
            pair(fixed, object(2)),
            pair(object(4), object(1)),
        ];
        for _ in 0..2 {
            let mut islands = Islands::default();
            let mut contacts = Contacts::default();
            contacts.pairs.clone_from(&pairs);
            islands.update(&model, &contacts);
            let objects: Vec<&[usize]> = islands.list().iter().map(|i| i.objects.as_slice()).collect();
            assert_eq!(objects, [&[0][..], &[1, 3, 4], &[2]]);
            assert_eq!(islands.list().iter().map(|island| island.pairs.len()).sum::<usize>(), 4);
            pairs.reverse();
        }
    }
}
