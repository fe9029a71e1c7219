//! Touch: the forces on the taxels of a hand's tactile patches.
//!
//! The solver has a few points of contact with a force each. Skin is soft: the force of a point is spread over the
//! surface around it by the pressure p(x, y) = k(x) k(y) with Epanechnikov's kernel, of half width a,
//! k(t) = 3/(4a) (1 − (t/a)²) for |t| < a, which has the closed integral K(t) = 1/2 + 3/4 (t/a) − 1/4 (t/a)³. A taxel
//! reads the pressure's integral over its rectangle. Pressure that would spread beyond the edge of the patch stays on the
//! patch: its taxels together read the whole force of every point on it, as a load cell below it would.

use crate::declaration::{Channel, Column, Rows, TAXELS};
use crate::moment::Moment;
use crate::noise::{Noise, SensorNoise};
use crate::quantise::quantised;
use crate::sensor::Sensor;
use palmares_models::hand::sensors::Touch;
use palmares_models::hand::{Hand, TactilePatch};
use palmares_models::{Pose, Vec3};
use palmares_sim::{ContactForce, Owner};

/// The taxels' errors.
#[derive(Clone)]
pub(crate) struct Taxels {
    touch: Touch,
    tick_s: f64,
    noise: SensorNoise,
}

impl Sensor for Taxels {
    const CHANNEL: Channel = Channel {
        name: "touch",
        key: "touch",
        rows: Rows::Each(&TAXELS),
        columns: &[Column::numbers(3, "N")],
        telemetry: Some("touch"),
        doc: "Force on every taxel along x and y of its patch and into the patch, in the order of `welcome.hands[].taxels`",
        hands: "hands with tactile patches: ReFlex (38 taxels, no shear), `softhand_skin` (40)",
        ..Channel::NUMBERS
    };
    type State = ();

    fn law(now: &Moment<'_>, _: Option<&Self::State>, row: &mut [f64]) {
        row.fill(0.0);
        let (taxels, _) = row.as_chunks_mut();
        add_forces(now.hand, now.links(), now.contacts, taxels);
    }

    fn new(hand: &Hand, noise: Option<&Noise>, tick_s: f64) -> Option<(Self, Self::State)> {
        Some((Taxels { touch: hand.sensors.touch, tick_s, noise: noise?.sensor("touch") }, ()))
    }

    /// The newest sample that began before this tick's end; until the next one begins the reading stays.
    fn tick(&self, now: &Moment<'_>, tick: u64, _: &mut (), row: &mut [f64]) {
        let Touch { saturation: most, resolution, noise, shear, rate_hz, .. } = self.touch;
        let per_tick = rate_hz * self.tick_s;
        let sample = |tick: u64| (tick as f64 * per_tick + 1e-9).floor() as u64;
        if tick > 0 && sample(tick) == sample(tick - 1) {
            return;
        }
        Self::law(now, None, row);
        let mut drawn = self.noise.sample(sample(tick));
        for taxel in row.as_chunks_mut::<3>().0 {
            let normal = drawn.normal3();
            for axis in 0..3 {
                let read = taxel[axis] + noise * normal[axis];
                let read = if axis < 2 && !shear { 0.0 } else { read };
                taxel[axis] = quantised(read.clamp(if axis < 2 { -most } else { 0.0 }, most), resolution);
            }
        }
    }
}

/// Integral of the kernel of half width `a` from −∞ to `t`.
fn spread(t: f64, a: f64) -> f64 {
    let u = (t / a).clamp(-1.0, 1.0);
    0.5 + u * (0.75 - 0.25 * u * u)
}

/// The shares of `n` equal parts of [−half, half] in the force at `x`; they add up to 1.
fn shares(x: f64, half: f64, n: usize, a: f64) -> impl Iterator<Item = f64> {
    let edge = move |k: usize| spread(half * (2.0 * k as f64 / n as f64 - 1.0) - x, a);
    let whole = edge(n) - edge(0);
    (0..n).map(move |k| (edge(k + 1) - edge(k)) / whole)
}

/// Adds the force of a point to the taxels of one patch, in its frame; z of the force points out of the surface.
fn add_force(patch: &TactilePatch, footprint: f64, at: Vec3, force: Vec3, taxels: &mut [[f64; 3]]) {
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

/// Force on every taxel without errors, N: along x and y of its patch and into the patch (−z), by all contacts. `links` are
/// the world poses of the hand's links.
pub fn forces(hand: &Hand, links: &[Pose], contacts: &[ContactForce]) -> Vec<[f64; 3]> {
    let mut taxels = vec![[0.0; 3]; (TAXELS.count)(hand)];
    add_forces(hand, links, contacts, &mut taxels);
    taxels
}

fn add_forces(hand: &Hand, links: &[Pose], contacts: &[ContactForce], taxels: &mut [[f64; 3]]) {
    let touch = &hand.sensors.touch;
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
                    add_force(patch, touch.footprint, at, force, own);
                }
            }
        }
    }
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
        fn the_taxels_together_read_the_whole_force_at_every_place(
            x in -0.02..0.02f64, y in -0.01..0.01f64, footprint in 1e-4..0.05f64,
            force in prop::array::uniform3(-50.0..50.0f64), taxels in (1..9usize, 1..9usize),
        ) {
            let patch = patch([taxels.0, taxels.1]);
            let mut read = vec![[0.0; 3]; patch.len()];
            add_force(&patch, footprint, Vec3::new(x, y, 0.0), Vec3::from_array(force), &mut read);
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
        add_force(&patch, 0.003, Vec3::ZERO, Vec3::new(0.0, 0.0, -2.0), &mut read);
        let pressed: Vec<f64> = read.iter().map(|taxel| taxel[2]).collect();
        assert_eq!((pressed[0], pressed[3]), (0.0, 0.0));
        assert!((pressed[1] - 1.0).abs() < 1e-15 && (pressed[2] - 1.0).abs() < 1e-15, "{pressed:?}");
    }

    /// The centre of the readings moves with the touch, without jumps.
    #[test]
    fn a_moving_touch_moves_from_taxel_to_taxel_smoothly() {
        let patch = patch([5, 2]);
        let (mut last, step) = (None::<Vec<f64>>, 1e-5);
        for k in 0..3000 {
            let x = -0.015 + step * f64::from(k);
            let mut read = vec![[0.0; 3]; patch.len()];
            add_force(&patch, 0.004, Vec3::new(x, 0.001, 0.0), Vec3::new(0.0, 0.0, -1.0), &mut read);
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
