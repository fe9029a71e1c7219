//! What the taxels of a hand's tactile patches feel.
//!
//! The solver knows a touch as a few points with a force each. Skin is soft: the force of a point is spread over the
//! surface around it by the pressure p(x, y) = k(x) k(y) with Epanechnikov's kernel, of half width a,
//! k(t) = 3/(4a) (1 − (t/a)²) for |t| < a, which has the closed integral K(t) = 1/2 + 3/4 (t/a) − 1/4 (t/a)³. A taxel
//! reads the pressure's integral over its rectangle. What would spread beyond the edge of the patch is borne by the
//! patch: its taxels together read the whole force of every point that lies on it, as a load cell below it would.

use palmares_models::hand::{Hand, TactilePatch};
use palmares_models::{Pose, Vec3};
use palmares_sim::{ContactForce, Owner};

/// Integral of the kernel of half width `a` from −∞ to `t`.
fn spread(t: f64, a: f64) -> f64 {
    let u = (t / a).clamp(-1.0, 1.0);
    0.5 + u * (0.75 - 0.25 * u * u)
}

/// How the force at `x` is shared by `n` equal parts of [−half, half]: the shares add up to 1.
fn shares(x: f64, half: f64, n: usize, a: f64) -> impl Iterator<Item = f64> {
    let edge = move |k: usize| spread(half * (2.0 * k as f64 / n as f64 - 1.0) - x, a);
    let whole = edge(n) - edge(0);
    (0..n).map(move |k| (edge(k + 1) - edge(k)) / whole)
}

/// Adds the forces on the taxels of one patch: in its frame, z being the pressure out of the surface.
fn feel(patch: &TactilePatch, footprint: f64, at: Vec3, force: Vec3, taxels: &mut [[f64; 3]]) {
    let [nx, ny] = patch.taxels;
    let [x, y, z] = [force.x, force.y, -force.z];
    for (row, share_y) in shares(at.y, patch.half_size[1], ny, footprint).enumerate() {
        for (column, share_x) in shares(at.x, patch.half_size[0], nx, footprint).enumerate() {
            let share = share_x * share_y;
            let taxel = &mut taxels[row * nx + column];
            *taxel = [taxel[0] + x * share, taxel[1] + y * share, taxel[2] + z * share];
        }
    }
}

/// Force on every taxel, N: along x and y of its patch and into the patch (−z), by all contacts. `links` are the world
/// poses of the hand's links.
pub fn forces(hand: &Hand, links: &[Pose], contacts: &[ContactForce]) -> Vec<[f64; 3]> {
    let touch = &hand.sensors.touch;
    let mut taxels = vec![[0.0; 3]; hand.tactile.iter().map(TactilePatch::len).sum()];
    let mut first = 0;
    for patch in &hand.tactile {
        let own = &mut taxels[first..first + patch.len()];
        first += patch.len();
        let link = Owner::Link(patch.link);
        if !contacts.iter().any(|contact| contact.a == link || contact.b == link) {
            continue;
        }
        let patch_from_world = (links[patch.link] * patch.link_from_patch).inverse();
        for contact in contacts {
            for (owner, sign) in [(contact.a, -1.0), (contact.b, 1.0)] {
                if owner != link {
                    continue;
                }
                let at = patch_from_world.transform_point(contact.position);
                let into = patch_from_world.rotation * (contact.normal * sign);
                let on_it = at.x.abs() <= patch.half_size[0]
                    && at.y.abs() <= patch.half_size[1]
                    && at.z.abs() <= touch.depth
                    && into.z < -0.5;
                if on_it {
                    let force = patch_from_world.rotation * (contact.force * sign);
                    feel(patch, touch.footprint, at, force, own);
                }
            }
        }
    }
    taxels
}

#[cfg(test)]
mod tests {
    use super::*;
    use proptest::prelude::*;

    fn patch(taxels: [usize; 2]) -> TactilePatch {
        let name = "pad".to_owned();
        TactilePatch { name, link: 0, link_from_patch: Pose::IDENTITY, half_size: [0.02, 0.01], taxels }
    }

    proptest! {
        #[test]
        fn the_taxels_together_read_the_whole_force_wherever_it_is(
            x in -0.02..0.02f64, y in -0.01..0.01f64, footprint in 1e-4..0.05f64,
            force in prop::array::uniform3(-50.0..50.0f64), taxels in (1..9usize, 1..9usize),
        ) {
            let patch = patch([taxels.0, taxels.1]);
            let mut read = vec![[0.0; 3]; patch.len()];
            feel(&patch, footprint, Vec3::new(x, y, 0.0), Vec3::from_array(force), &mut read);
            for axis in 0..3 {
                let sum: f64 = read.iter().map(|taxel| taxel[axis]).sum();
                let whole = if axis == 2 { -force[2] } else { force[axis] };
                prop_assert!((sum - whole).abs() < 1e-12 * whole.abs().max(1.0), "{} {}", sum, whole);
            }
        }
    }

    #[test]
    fn a_touch_between_two_taxels_lights_both_alike_and_none_beyond_its_footprint() {
        let patch = patch([4, 1]);
        let mut read = vec![[0.0; 3]; 4];
        feel(&patch, 0.003, Vec3::ZERO, Vec3::new(0.0, 0.0, -2.0), &mut read);
        let pressed: Vec<f64> = read.iter().map(|taxel| taxel[2]).collect();
        assert_eq!((pressed[0], pressed[3]), (0.0, 0.0));
        assert!((pressed[1] - 1.0).abs() < 1e-15 && (pressed[2] - 1.0).abs() < 1e-15, "{pressed:?}");
    }

    /// The centre of what the taxels read moves with the touch, without jumps.
    #[test]
    fn a_moving_touch_moves_from_taxel_to_taxel_smoothly() {
        let patch = patch([5, 2]);
        let (mut last, step) = (None::<Vec<f64>>, 1e-5);
        for k in 0..3000 {
            let x = -0.015 + step * f64::from(k);
            let mut read = vec![[0.0; 3]; patch.len()];
            feel(&patch, 0.004, Vec3::new(x, 0.001, 0.0), Vec3::new(0.0, 0.0, -1.0), &mut read);
            let pressed: Vec<f64> = read.iter().map(|taxel| taxel[2]).collect();
            // The steepest that a reading can change is the kernel's height.
            let most = 0.75 / 0.004 * step * 1.001;
            if let Some(last) = last {
                assert!(pressed.iter().zip(&last).all(|(a, b)| (a - b).abs() <= most));
            }
            last = Some(pressed);
        }
    }
}
