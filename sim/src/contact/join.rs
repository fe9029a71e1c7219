//! What was left out and is hit joins the contacts of a step.

use super::bodies::Bodies;
use super::distance_cache::DistanceCache;
use super::gap::still_separated;
use super::left_out::{LeftPoint, What};
use super::narrow_phase::{Contacts, Shapes};
use crate::anchor::Pair;

impl Contacts {
    /// Lets two shapes join with the full reach of the step: something of near pair `index` is left
    /// out. The index of their contact, if they have one.
    #[cold]
    pub(crate) fn join(
        &mut self,
        bodies: &Bodies<'_>,
        shapes: &Shapes<'_>,
        distances: &mut DistanceCache,
        pairs: &mut Vec<Pair>,
        index: usize,
    ) -> Option<usize> {
        let config = bodies.model.config();
        let (i, j) = distances.key(index);
        let key = (i as u32, j as u32);
        let (a, b) = (&bodies.model.colliders()[i], &bodies.model.colliders()[j]);
        let (p, q) = distances.slots(index);
        let reach = bodies.reach((i, a), (j, b), shapes.poses, shapes.speeds[p] + shapes.speeds[q]);
        let place = match pairs.binary_search_by_key(&key, |pair| pair.key) {
            Ok(place) => {
                let points = &mut pairs[place].manifold.points;
                for left in self.left_out.list.iter().filter(|left| left.index == index) {
                    if let What::Point(k) = left.what {
                        let LeftPoint { point, memory, .. } = self.left_out.points[k];
                        points[point].data = memory;
                    }
                }
                place
            }
            Err(place) => {
                let a_from_b = shapes.poses[i].inv_mul(&shapes.poses[j]);
                // The known gap is a lower bound, and no result depends on what is known.
                if let Some(gap) =
                    still_separated(None, (&mut *distances, index), (a, b), &a_from_b, reach.reachable)
                {
                    distances.set_bound_early(index, gap);
                    return None;
                }
                let mut pair = Pair::new(key);
                self.update(config, &mut pair, (a, b), a_from_b, &reach);
                if pair.manifold.points.is_empty() {
                    return None;
                }
                distances.set_bound_early(index, 0.0);
                pairs.insert(place, pair);
                for contact in self.pairs.iter_mut().filter(|contact| contact.pair >= place) {
                    contact.pair += 1;
                }
                place
            }
        };
        if pairs[place].covered {
            return None;
        }
        let before = self.pairs.iter().position(|contact| contact.pair == place);
        let count = self.pairs.len();
        self.add(bodies, shapes.poses, (a, b), (&mut pairs[place], place), &reach, None);
        if self.pairs.len() == count {
            return None;
        }
        let Some(index) = before else { return Some(count) };
        // Its points are replaced by more of them.
        self.pairs.swap_remove(index);
        Some(index)
    }
}
