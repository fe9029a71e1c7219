//! Impacts of several bodies within one step, one after another in order of time.
//!
//! Newton's law of impact determines how two bodies separate, but not which bodies are hit afterwards. If all
//! impacts used the velocities of the start, the second ball of a cradle would pass nothing on. So the pair
//! that meets first exchanges the frictionless impulse of two bodies; bodies with a changed velocity may meet
//! others, until no impact is due. Surfaces in contact are a chain of such impacts with no time between them.
//! Pairs that approach and meet at one time exchange their impulses at once ([`super::joint_impact`]): in order, the
//! result would depend on the order, and the two halves of a symmetric scene would differ.
//!
//! All impulses push. The final velocities therefore also solve the step's convex problem, if each point
//! requires the normal velocity that it ended with.

use super::impact_candidate::{ImpactBody, ImpactCandidate};
use super::joint_impact::JointImpact;
use crate::bounds::{POINT_WORK, STEP_WORK};
use palmares_models::Vec3;
use std::ops::Range;

/// Largest number of impacts per pair of bodies; beyond it the sequence is abandoned (rattling).
const MAX_IMPACTS: usize = 16;

/// Largest computing of a sequence, in the unit of [`crate::bounds`]; beyond it the sequence is abandoned.
const MAX_WORK: u64 = STEP_WORK / 20;

/// The points between two bodies; all furniture is one body.
#[derive(Clone, Debug)]
struct ImpactEvent {
    bodies: [usize; 2],
    candidates: Range<usize>,
    /// Time for which the gaps are known, s.
    known: f64,
    /// Time at which the bodies meet next, s; infinite if they do not.
    next: f64,
    /// Time from which they meet together with others, s.
    near: f64,
}

impl ImpactEvent {
    /// Whether the present impact strikes one of its bodies.
    fn is_struck(&self, bodies: &[ImpactBody]) -> bool {
        self.bodies.iter().any(|&body| bodies.get(body).is_some_and(|body| body.struck))
    }

    /// The bodies that the present impact couples with its own, by the one that leads them.
    fn group(&self, bodies: &mut [ImpactBody]) -> usize {
        let [a, b] = self.bodies;
        leader(bodies, a.min(b))
    }
}

/// The impacts of an island in a step.
#[derive(Clone, Debug, Default)]
pub struct ImpactSequence {
    /// The free bodies.
    pub bodies: Vec<ImpactBody>,
    /// The points; sorted by bodies once played.
    pub candidates: Vec<ImpactCandidate>,
    events: Vec<ImpactEvent>,
    /// Pairs of the present impact, by their group and their index.
    tied: Vec<(usize, usize)>,
    /// Points of a group.
    points: Vec<usize>,
    joint: JointImpact,
    /// Computing of the last call of `play`.
    pub work: u64,
}

impl ImpactSequence {
    /// Removes all bodies and points.
    pub fn clear(&mut self) {
        self.bodies.clear();
        self.candidates.clear();
        self.events.clear();
    }

    /// Plays a step of `h`, in which surfaces that meet faster than `least` rebound. True if more than a
    /// single impact resulted, and their number stayed within the limit.
    pub fn play(&mut self, h: f64, least: f64) -> bool {
        self.arrange();
        self.work = POINT_WORK * self.candidates.len() as u64;
        for k in 0..self.events.len() {
            self.look_ahead(k, h, least);
        }
        let mut impacts = 0;
        while let Some(time) = self.earliest() {
            if impacts >= MAX_IMPACTS * self.events.len() || self.work > MAX_WORK {
                return false;
            }
            impacts += self.tied.len();
            self.work += self.events.len() as u64;
            if !self.meet(time, h, least) {
                return false;
            }
        }
        impacts > 1 || impacts == 1 && self.candidates.iter().any(ImpactCandidate::misses)
    }

    /// Velocity of B against A at a point: at the start and at the end of a step of `h`.
    pub fn velocities(&self, candidate: &ImpactCandidate, h: f64) -> [Vec3; 2] {
        let start = candidate.relative(&self.bodies, |body| body.start);
        [start, candidate.relative(&self.bodies, |body| body.now) + candidate.gravity * h]
    }

    /// Groups the points by bodies.
    fn arrange(&mut self) {
        self.candidates.sort_unstable_by_key(ImpactCandidate::key);
        self.events.clear();
        for (k, candidate) in self.candidates.iter_mut().enumerate() {
            for (side, &body) in candidate.bodies.iter().enumerate() {
                if let Some(body) = self.bodies.get(body) {
                    let moment = candidate.arms[side].cross(candidate.normal);
                    candidate.turns[side] = body.inverse_inertia * moment;
                    candidate.inverse_effective_mass += body.inverse_mass + moment.dot(candidate.turns[side]);
                }
            }
            let (a, b, _) = candidate.key();
            match self.events.last_mut() {
                Some(last) if last.bodies == [a, b] => last.candidates.end = k + 1,
                _ => self.events.push(ImpactEvent {
                    bodies: [a, b],
                    candidates: k..k + 1,
                    known: 0.0,
                    next: f64::INFINITY,
                    near: f64::INFINITY,
                }),
            }
        }
    }

    /// Time at which bodies meet first; lists the pairs that meet then.
    fn earliest(&mut self) -> Option<f64> {
        let time = self.events.iter().map(|event| event.next).fold(f64::INFINITY, f64::min);
        self.tied.clear();
        if time == f64::INFINITY {
            return None;
        }
        let meet = self.events.iter().enumerate().filter(|(_, event)| event.near <= time);
        self.tied.extend(meet.map(|(k, _)| (0, k)));
        Some(time)
    }

    fn look_ahead(&mut self, event: usize, h: f64, least: f64) {
        let event = &mut self.events[event];
        (event.next, event.near) = (f64::INFINITY, f64::INFINITY);
        for candidate in &mut self.candidates[event.candidates.clone()] {
            let meets = candidate.meets(&self.bodies, event.known, h, least);
            candidate.due = meets.is_some_and(|meets| meets.within);
            candidate.misses = meets.is_some_and(|meets| !meets.within);
            candidate.near = meets.map_or(f64::INFINITY, |meets| meets.near);
            event.near = event.near.min(candidate.near);
            if let Some(meets) = meets.filter(|meets| meets.within) {
                event.next = event.next.min(meets.time);
            }
        }
    }

    /// Exchanges the impulses of the listed pairs, and updates the next meetings of their bodies. False if this takes too much
    /// computing.
    fn meet(&mut self, time: f64, h: f64, least: f64) -> bool {
        self.group();
        for event in self.events.iter_mut().filter(|event| event.is_struck(&self.bodies)) {
            for candidate in &mut self.candidates[event.candidates.clone()] {
                candidate.gap += candidate.velocity(&self.bodies, event.known) * (time - event.known);
            }
            event.known = time;
        }
        for body in self.bodies.iter_mut().filter(|body| body.struck) {
            body.advance(time);
        }
        let tied = std::mem::take(&mut self.tied);
        let found = tied.chunk_by(|a, b| a.0 == b.0).all(|group| self.exchange(group, time));
        self.tied = tied;
        for k in 0..self.events.len() {
            if self.events[k].is_struck(&self.bodies) {
                self.look_ahead(k, h, least);
            }
        }
        self.bodies.iter_mut().for_each(|body| body.struck = false);
        found
    }

    /// Sorts the listed pairs by the groups of bodies that they couple.
    fn group(&mut self) {
        for &(_, event) in &self.tied {
            for k in self.events[event].bodies {
                if let Some(body) = self.bodies.get_mut(k) {
                    (body.struck, body.with) = (true, k);
                }
            }
        }
        for &(_, event) in &self.tied {
            let [a, b] = self.events[event].bodies.map(|body| leader(&mut self.bodies, body));
            if let Some(body) = self.bodies.get_mut(a.max(b)) {
                body.with = a.min(b);
            }
        }
        for (group, event) in &mut self.tied {
            *group = self.events[*event].group(&mut self.bodies);
        }
        self.tied.sort_unstable();
    }

    /// The impulses between the bodies of a group of pairs: of every point that is due in the step, and of those that are as near.
    fn exchange(&mut self, group: &[(usize, usize)], time: f64) -> bool {
        self.points.clear();
        for &(_, event) in group {
            let meets = |&k: &usize| self.candidates[k].due || self.candidates[k].near <= time;
            self.points.extend(self.events[event].candidates.clone().filter(meets));
        }
        self.work += POINT_WORK / 2 * self.points.len() as u64;
        let work = (&mut self.work, MAX_WORK);
        let Some(impulses) = self.joint.solve(&self.bodies, &self.candidates, &self.points, time, work)
        else {
            return false;
        };
        for (&k, &impulse) in self.points.iter().zip(impulses) {
            let candidate = &mut self.candidates[k];
            candidate.push(&mut self.bodies, impulse);
            candidate.impulse += impulse;
            candidate.timed += impulse * time;
        }
        true
    }
}

/// The body that leads those coupled with one; furniture couples nothing.
fn leader(bodies: &mut [ImpactBody], mut k: usize) -> usize {
    while let Some(with) = bodies.get(k).map(|body| body.with)
        && with != k
    {
        // Halves the way of later searches.
        bodies[k].with = bodies.get(with).map_or(with, |body| body.with);
        k = with;
    }
    k
}

#[cfg(test)]
mod tests {
    use super::super::impact_candidate::FIXED;
    use super::*;
    use palmares_models::Mat3;

    const H: f64 = 1e-3;
    const LEAST: f64 = 0.05;

    /// Balls on the x axis that meet their neighbours at (masses, velocities, gaps), without gravity.
    fn row(masses: &[f64], speeds: &[f64], gaps: &[f64], restitution: f64) -> ImpactSequence {
        let mut sequence = ImpactSequence::default();
        for (k, (mass, speed)) in masses.iter().zip(speeds).enumerate() {
            let (center, spin) = (Vec3::X * k as f64, Mat3::from_diagonal(Vec3::splat(10.0 / mass)));
            sequence.bodies.push(ImpactBody::new(center, 1.0 / mass, spin, [Vec3::X * *speed, Vec3::ZERO]));
        }
        for (k, gap) in gaps.iter().enumerate() {
            let mut candidate =
                ImpactCandidate::new([k, k + 1], Vec3::X, [Vec3::X * 0.5, Vec3::X * -0.5], *gap, k);
            candidate.restitution = restitution;
            sequence.candidates.push(candidate);
        }
        sequence
    }

    fn speeds(sequence: &ImpactSequence) -> Vec<f64> {
        sequence.bodies.iter().map(|body| body.now[0].x).collect()
    }

    /// Displacements of the bodies in the step.
    fn ways(sequence: &ImpactSequence) -> Vec<f64> {
        let way = |body: &ImpactBody| match body.detour() {
            None => body.start[0].x * H,
            Some((first, detour)) => body.start[0].x * first + body.now[0].x * (H - first) + detour.x,
        };
        sequence.bodies.iter().map(way).collect()
    }

    fn close(found: &[f64], exact: &[f64]) {
        assert_eq!(found.len(), exact.len());
        let worst = found.iter().zip(exact).fold(0.0f64, |worst, (a, b)| worst.max((a - b).abs()));
        assert!(worst < 1e-12, "{found:?} instead of {exact:?}");
    }

    #[test]
    fn equal_elastic_balls_hand_their_speed_on() {
        for gap in [0.0, 1e-4] {
            let mut cradle = row(&[0.1; 5], &[1.0, 0.0, 0.0, 0.0, 0.0], &[gap; 4], 1.0);
            assert!(cradle.play(H, LEAST));
            close(&speeds(&cradle), &[0.0, 0.0, 0.0, 0.0, 1.0]);
            // Each moves up to its neighbour's old position; the last has the rest of the step.
            close(&ways(&cradle), &[gap, gap, gap, gap, H - 4.0 * gap]);
            for (candidate, exact) in cradle.candidates.iter().zip([0.0, 0.0, 0.0, 1.0]) {
                let [_, end] = cradle.velocities(candidate, H);
                assert!((end.x - exact).abs() < 1e-12 && candidate.hit().is_some());
            }
        }
    }

    #[test]
    fn two_that_come_push_two_away_and_unequal_ones_keep_energy_and_momentum() {
        let mut cradle = row(&[0.1; 5], &[1.0, 1.0, 0.0, 0.0, 0.0], &[0.0; 4], 1.0);
        assert!(cradle.play(H, LEAST));
        close(&speeds(&cradle), &[0.0, 0.0, 0.0, 1.0, 1.0]);
        let masses = [0.5, 0.2, 0.05, 0.3];
        let mut chain = row(&masses, &[1.0, 0.0, -0.5, -2.0], &[1e-4, 2e-4, 5e-5], 1.0);
        let sum = |chain: &ImpactSequence, power| -> f64 {
            speeds(chain).iter().zip(masses).map(|(v, mass)| mass * v.powi(power)).sum()
        };
        let before = [sum(&chain, 1), sum(&chain, 2)];
        assert!(chain.play(H, LEAST));
        close(&[sum(&chain, 1), sum(&chain, 2)], &before);
        assert!(speeds(&chain).is_sorted(), "{:?}", speeds(&chain));
    }

    /// A light ball upon a heavy one that rebounds from the floor: `v₂ = (3 M − m)/(M + m) v`.
    #[test]
    fn a_ball_on_a_falling_ball_is_thrown_up() {
        let (heavy, light, v) = (0.4, 0.1, 2.0);
        let mut tower = row(&[heavy, light], &[-v, -v], &[0.0], 1.0);
        let mut floor = ImpactCandidate::new([FIXED, 0], Vec3::X, [Vec3::ZERO, Vec3::X * -0.5], 1e-3, 1);
        floor.restitution = 1.0;
        tower.candidates.push(floor);
        assert!(tower.play(H, LEAST));
        let exact =
            [(heavy - 3.0 * light) / (heavy + light) * v, (3.0 * heavy - light) / (heavy + light) * v];
        close(&speeds(&tower), &exact);
    }

    #[test]
    fn a_pair_that_meets_later_is_known_and_a_lone_impact_needs_no_sequence() {
        // The second has 0.1 ms for 0.2 mm.
        let mut late = row(&[1.0; 3], &[1.0, 0.0, 0.0], &[9e-4, 2e-4], 1.0);
        assert!(late.play(H, LEAST));
        assert!(late.candidates[1].misses() && late.candidates[1].hit().is_none());
        let mut lone = row(&[1.0, 1e3, 1.0], &[1.0, 0.0, 0.0], &[1e-4, 1e-4], 0.5);
        assert!(!lone.play(H, LEAST), "the heavy one is hardly moved");
    }

    /// All corners of a plate share an impulse: it does not turn.
    #[test]
    fn a_flat_plate_rebounds_flat() {
        let mut sequence = ImpactSequence::default();
        let inverse = Mat3::from_diagonal(Vec3::new(3.0, 5.0, 4.0));
        sequence.bodies.push(ImpactBody::new(Vec3::ZERO, 0.5, inverse, [Vec3::Z * -1.0, Vec3::ZERO]));
        for (place, (x, y)) in [(1.0, 1.0), (1.0, -1.0), (-1.0, -1.0), (-1.0, 1.0)].into_iter().enumerate() {
            let arms = [Vec3::ZERO, Vec3::new(x, 0.7 * y, -0.1)];
            let mut candidate = ImpactCandidate::new([FIXED, 0], Vec3::Z, arms, 1e-4, place);
            candidate.restitution = 0.8;
            sequence.candidates.push(candidate);
        }
        sequence.play(H, LEAST);
        let [linear, angular] = sequence.bodies[0].now;
        assert!((linear - Vec3::Z * 0.8).length() < 1e-10 && angular.length() < 1e-10, "{linear} {angular}");
    }

    #[test]
    fn what_rattles_is_given_up() {
        // A light ball between two heavy ones that close in on it: some 60 impacts.
        let mut trap = row(&[1e3, 1.0, 1e3], &[1.0, 0.0, -1.0], &[1e-5, 1.1e-5], 1.0);
        assert!(!trap.play(H, LEAST));
        // In the middle it is met from both sides at once.
        let mut middle = row(&[1e3, 1.0, 1e3], &[1.0, 0.0, -1.0], &[1e-5, 1e-5], 1.0);
        assert!(middle.play(H, LEAST));
        close(&speeds(&middle), &[-1.0, 0.0, 1.0]);
    }
}
