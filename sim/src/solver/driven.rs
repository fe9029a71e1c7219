//! A tendon and its motor as one convex law: the motor winds the less, the more the tendon pulls.
//!
//! In a step the motor changes the tendon's wound length by y(f), which never grows with the tension f. The tension therefore is the one
//! solution of `f = K (x + y(f) − h u) − b u`: implicit in the load, so that it settles at any step and stiffness.

use serde::{Deserialize, Serialize};

/// The action of a motor on one tendon in a step, in the tendon's units. A force opposes a positive change of the wound length.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct Drive {
    /// Change of the wound length that the command asks for; within ±`reach`.
    pub wanted: f64,
    /// Largest change without load.
    pub reach: f64,
    /// Force at which the speed–torque line reaches zero; infinite without a line.
    pub stall: f64,
    /// Largest work of the step; infinite without a limit of the power.
    pub work: f64,
    /// Largest force that it pulls with; at most `stall`.
    pub pulls: f64,
    /// Largest force that it holds, if no load turns it back; else the load turns it back with `pulls`.
    pub holds: Option<f64>,
    /// Whether it pushes as well as it pulls.
    pub both_ways: bool,
}

/// The force of a tendon, and what its motor does.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Pull {
    /// f
    pub force: f64,
    /// df/dz
    pub slope: f64,
    /// y, the change of the wound length.
    pub change: f64,
}

impl Drive {
    /// The solution of `f = z + K y(f)`, within the bounds of the force. `k` is K, and `z` the force if the motor stood still.
    pub fn pull(&self, k: f64, z: f64) -> Pull {
        let most = self.holds.unwrap_or(self.pulls);
        let least = if self.both_ways { -most } else { 0.0 };
        if self.wanted >= 0.0 {
            return self.wind(k, z, self.wanted, [least, most]);
        }
        let Pull { force, slope, change } = self.wind(k, -z, -self.wanted, [-most, -least]);
        Pull { force: -force, slope, change: -change }
    }

    /// The same for a change `wanted` that is not negative, and a force between `least` and `most`.
    fn wind(&self, k: f64, z: f64, wanted: f64, [least, most]: [f64; 2]) -> Pull {
        let whole = z + k * wanted;
        let turned_back = |force: f64| Pull { force, slope: 0.0, change: (force - z) / k };
        let slack = Pull { force: 0.0, slope: 0.0, change: wanted };
        // The load helps.
        if whole <= 0.0 {
            return match whole < least {
                false => Pull { force: whole, slope: 1.0, change: wanted },
                true if least == 0.0 => slack,
                true if self.holds.is_some() => Pull { force: least, slope: 0.0, change: wanted },
                true => turned_back(least),
            };
        }
        if most == 0.0 {
            return slack;
        }
        let (mut force, mut slope, mut change) = (whole, 1.0, wanted);
        let along = 1.0 / (1.0 + k * self.reach / self.stall);
        let line = (z + k * self.reach) * along;
        if line < force {
            (force, slope, change) = (line, along, (line - z) / k);
        }
        if self.work.is_finite() {
            let root = (z * z + 4.0 * k * self.work).sqrt();
            let limited = if z > 0.0 { 0.5 * (z + root) } else { 2.0 * k * self.work / (root - z) };
            if limited < force {
                (force, slope, change) = (limited, 0.5 * (1.0 + z / root), (limited - z) / k);
            }
        }
        if force <= self.pulls {
            return Pull { force, slope, change };
        }
        match self.holds {
            Some(_) if z >= most => Pull { force: most, slope: 0.0, change: 0.0 },
            Some(_) if z > self.pulls => Pull { force: z, slope: 1.0, change: 0.0 },
            _ => turned_back(self.pulls),
        }
    }
}

/// The law of a tendon that its motor winds.
#[derive(Clone, Copy, Debug, Serialize, Deserialize)]
pub struct DrivenLaw {
    /// Step h, s.
    pub h: f64,
    /// Stiffness K.
    pub stiffness: f64,
    /// Damping b.
    pub damping: f64,
    /// s_ref − s(q) at the start of the step.
    pub error: f64,
    /// The motor.
    pub drive: Drive,
}

impl DrivenLaw {
    /// Force of the tendon and motion of the motor while the tendon's length changes at the rate u.
    pub fn pull(&self, u: f64) -> Pull {
        let z = self.stiffness * (self.error - self.h * u) - self.damping * u;
        self.drive.pull(self.stiffness, z)
    }

    /// Impulse at velocity u, and −d(impulse)/du.
    pub fn impulse(&self, u: f64) -> (f64, f64) {
        let Pull { force, slope, .. } = self.pull(u);
        (self.h * force, self.h * (self.h * self.stiffness + self.damping) * slope)
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const K: f64 = 300.0;

    fn drives() -> Vec<Drive> {
        let mut all = Vec::new();
        for wanted in [-0.02, -0.003, 0.0, 0.004, 0.02] {
            for (stall, work) in [(2.0, f64::INFINITY), (f64::INFINITY, 0.006), (1.5, 0.004)] {
                for (holds, both_ways) in [(None, false), (None, true), (Some(4.0), false), (Some(4.0), true)]
                {
                    let pulls = 1.2;
                    all.push(Drive { wanted, reach: 0.02, stall, work, pulls, holds, both_ways });
                }
            }
        }
        all
    }

    /// Forces if the motor stood still.
    fn loads() -> impl Iterator<Item = f64> {
        (-2000..2000).map(|k| f64::from(k) * 5e-3)
    }

    #[test]
    fn the_force_never_falls_with_the_stretch_and_its_slope_is_the_derivative() {
        for drive in drives() {
            let mut last = f64::NEG_INFINITY;
            for z in loads() {
                let here = drive.pull(K, z);
                assert!(here.force >= last - 1e-12, "{drive:?} {z}");
                last = here.force;
                let (a, b) = (drive.pull(K, z - 1e-7), drive.pull(K, z + 1e-7));
                let slope = (b.force - a.force) / 2e-7;
                let kink = (a.slope - b.slope).abs() > 1e-3;
                assert!(kink || (slope - here.slope).abs() < 1e-4, "{drive:?} {z}: {slope} {}", here.slope);
            }
        }
    }

    #[test]
    fn force_speed_and_power_are_within_the_motors_limits() {
        for drive in drives() {
            for z in loads() {
                let Pull { force, change, .. } = drive.pull(K, z);
                let most = drive.holds.unwrap_or(drive.pulls);
                assert!(force.abs() <= most && (drive.both_ways || force >= 0.0), "{drive:?} {z}");
                let bound = drive.holds.is_some() && force.abs() == most || force == 0.0;
                assert!(bound || (z + K * change - force).abs() < 1e-9, "{drive:?} {z}: {force} {change}");
                let load = force * change.signum();
                if load > 0.0 && change != 0.0 {
                    let line = drive.reach * (1.0 - load / drive.stall);
                    assert!(change.abs() <= line + 1e-12, "{drive:?} {z}: {change} beyond {line}");
                    assert!(load * change.abs() <= drive.work + 1e-12, "{drive:?} {z}: works too much");
                    assert!(load <= drive.pulls + 1e-12, "{drive:?} {z}: pulls too much");
                }
            }
        }
    }

    #[test]
    fn a_drive_that_no_load_turns_back_keeps_its_place() {
        for drive in drives().into_iter().filter(|drive| drive.holds.is_some()) {
            for z in loads() {
                let change = drive.pull(K, z).change;
                assert!(change * drive.wanted >= 0.0 && change.abs() <= drive.wanted.abs(), "{drive:?} {z}");
            }
        }
    }
}
