//! Joints that nothing holds.

use super::equilibrium::stiffness;
use nalgebra::DVector;
use palmares_models::hand::Hand;
use palmares_models::measure::LOOSE;

/// The first joint that nothing holds: springs, drives that push and pull, and pins leave the stiffness matrix at rest without a
/// pivot there.
pub(super) fn loose(hand: &Hand) -> Option<&str> {
    if hand.coordinates.iter().all(|c| c.stiffness >= LOOSE) {
        return None;
    }
    let rest = hand.open();
    let mut e = stiffness(hand);
    for tendon in hand.tendons.iter().filter(|tendon| tendon.both_ways) {
        let mut row = vec![0.0; rest.len()];
        tendon.gradient(&rest, |c, r| row[c] += r);
        let row = DVector::from_vec(row);
        e.ger(tendon.stiffness, &row, &row, 1.0);
    }
    for pin in &hand.linkages {
        let gap = pin.at(hand, &rest);
        for &(i, a) in &gap.gradient {
            for &(j, b) in &gap.gradient {
                e[(i, j)] += pin.stiffness * a.dot(b);
            }
        }
    }
    // Elimination, largest pivot first.
    let mut left: Vec<usize> = (0..rest.len()).collect();
    while let Some((at, &pivot)) =
        left.iter().enumerate().max_by(|a, b| e[(*a.1, *a.1)].total_cmp(&e[(*b.1, *b.1)]))
    {
        let size = e[(pivot, pivot)];
        if size < LOOSE {
            left.sort_unstable();
            return Some(hand.coordinates[left[0]].name.as_str());
        }
        left.swap_remove(at);
        for &i in &left {
            let factor = e[(i, pivot)] / size;
            for &j in &left {
                e[(i, j)] -= factor * e[(pivot, j)];
            }
        }
    }
    None
}
