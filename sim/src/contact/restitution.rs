//! Rebound by Newton's law of impact, `v_n⁺ = −e v_n⁻`, at the moment within the step at which surfaces meet.
//!
//! v_n is the normal velocity of B against A, m/s, negative when they approach, e the coefficient of restitution, 0 to 1.
//! Surfaces that slip take Coulomb's impulse on top, and rebound at the same normal velocity: see `step/slip_correction.rs`.
//!
//! Contact springs cannot do it: against a light ball they act for less than a step, so that the returned
//! energy would depend on the step. Surfaces therefore rebound as rigid ones, in one step; with e = 0 they
//! stay on each other.

/// A rebound within a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Rebound {
    /// Time at which the surfaces meet, s from the start of the step.
    pub time_s: f64,
    /// Normal velocity at the end of the step, m/s.
    pub velocity: f64,
    /// Slip speed of its surfaces after it, m/s, if known.
    pub slip: f64,
    /// The normal velocity may have been solved with another slip. Factor between the error of that slip and its
    /// apparent error.
    pub gain: f64,
    /// Its impulse, N s, if it is known before the step is solved; otherwise 0.
    pub impulse: f64,
}

impl Rebound {
    /// Rebound of surfaces that do not slip.
    pub fn new(time_s: f64, velocity: f64) -> Self {
        Rebound { time_s, velocity, slip: 0.0, gain: 1.0, impulse: 0.0 }
    }
}

/// The meeting of two surfaces within a step.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Meeting {
    /// Time from the start of the step, s.
    pub time_s: f64,
    /// Normal velocity then, m/s.
    pub velocity: f64,
}

impl Meeting {
    /// The first time within `h`, s, at which `gap + v t + a t²/2` is 0 and falls, for surfaces at `gap` (m) that move apart
    /// at `velocity` v (m/s, negative when they approach) and are accelerated apart by `acceleration` a (m/s²). Surfaces that
    /// overlap and approach meet at once; their velocity is that with which they have passed each other's place.
    pub fn within(h: f64, gap: f64, velocity: f64, acceleration: f64) -> Option<Meeting> {
        let squared = velocity * velocity - 2.0 * acceleration * gap;
        if squared < 0.0 || velocity >= 0.0 && (acceleration >= 0.0 || gap < 0.0) {
            return None;
        }
        let met = squared.sqrt();
        // Without the difference of like numbers.
        let time_s = if velocity < 0.0 {
            2.0 * gap.max(0.0) / (met - velocity)
        } else {
            (velocity + met) / -acceleration
        };
        (time_s <= h).then_some(Meeting { time_s, velocity: -met })
    }
}

/// The rebound of two surfaces at `gap` (m) that move apart at `velocity` (m/s, negative when they approach)
/// and are accelerated apart by `acceleration` (m/s²), if they meet within the step `h` and faster than
/// `least` (m/s). Their turn adds `turning` to the acceleration, m/s², but nothing to the velocity along the normal of the step's
/// start.
pub fn rebound(
    restitution: f64,
    gap: f64,
    velocity: f64,
    (acceleration, turning): (f64, f64),
    h: f64,
    least: f64,
) -> Option<Rebound> {
    if restitution == 0.0 {
        // It reaches the surface at the end of the step; the next step stops it there.
        let reaches = velocity < -least && gap + h * (velocity + h * acceleration) < 0.0;
        return reaches.then(|| Rebound::new(h, -gap.max(0.0) / h));
    }
    let met =
        Meeting::within(h, gap, velocity, acceleration + turning).filter(|met| met.velocity < -least)?;
    // Out of an overlap it has to rise first.
    let squared = (restitution * met.velocity).powi(2) + 2.0 * acceleration * gap.min(0.0);
    Some(Rebound::new(met.time_s, squared.max(0.0).sqrt() + acceleration * (h - met.time_s)))
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_fast_surface_rebounds_and_a_slow_or_parting_one_does_not() {
        let hit = rebound(0.5, 1e-3, -2.0, (0.0, 0.0), 1e-3, 0.05).expect("it meets in half a millisecond");
        assert!((hit.time_s - 5e-4).abs() < 1e-15 && (hit.velocity - 1.0).abs() < 1e-15);
        let dead = rebound(0.0, 1e-3, -2.0, (-9.81, 0.0), 1e-3, 0.05).expect("it meets");
        assert_eq!((dead.time_s, dead.velocity), (1e-3, -1.0));
        for (e, gap, v) in [(0.5, 3e-3, -2.0), (0.5, 0.0, -0.01), (0.5, -1e-3, 1.0)] {
            assert_eq!(rebound(e, gap, v, (0.0, 0.0), 1e-3, 0.05), None);
        }
    }

    #[test]
    fn an_elastic_rebound_under_gravity_keeps_the_energy() {
        let (g, h, gap, v) = (9.81, 1e-2, 0.03, -5.0);
        let hit = rebound(1.0, gap, v, (-g, 0.0), h, 0.05).expect("it meets");
        let t = h - hit.time_s;
        // Height over the floor at the end: rise from the contact with the velocity of impact, less the fall.
        let height = t * hit.velocity + 0.5 * g * t * t;
        let (before, after) = (0.5 * v * v + g * gap, 0.5 * hit.velocity.powi(2) + g * height);
        assert!((after / before - 1.0).abs() < 1e-14, "{before} {after}");
    }
}
