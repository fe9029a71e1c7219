//! Motors.

/// A motor: the command σ in [0, 1] maps to `s_ref = scaling · (σ − offset)`.
///
/// Its load F is the force of its tendon times its weight, in the unit of s's force: N or N·m. Against a load it reaches
/// `|dσ/dt| ≤ speed_limit · (1 − F / stall_force)` and `F · |ds_ref/dt| ≤ power_limit`.
#[derive(Clone, Debug)]
pub struct Motor {
    /// Name, for messages.
    pub name: String,
    /// s at σ − offset = 1.
    pub scaling: f64,
    /// σ at which s_ref is 0.
    pub offset: f64,
    /// Largest |dσ/dt|, 1/s: the speed without load.
    pub speed_limit: f64,
    /// Load at which it stands still, with the speed–torque line of a DC motor; without it the speed does not depend on the load.
    pub stall_force: Option<f64>,
    /// Largest mechanical power, W.
    pub power_limit: Option<f64>,
}

impl Motor {
    /// s_ref at σ.
    pub fn wound(&self, sigma: f64) -> f64 {
        self.scaling * (sigma - self.offset)
    }

    /// Largest mechanical power with which it moves a load of at most `pull`, W.
    pub fn largest_power(&self, pull: f64) -> f64 {
        let force = match self.stall_force {
            // The line's power is the largest at half of the stall force.
            Some(stall) if pull > 0.5 * stall => 0.25 * stall,
            Some(stall) => pull * (1.0 - pull / stall),
            None => pull,
        };
        let power = force * self.scaling.abs() * self.speed_limit;
        self.power_limit.map_or(power, |limit| power.min(limit))
    }

    /// Whether a load slows it.
    pub fn slows(&self) -> bool {
        self.stall_force.is_some() || self.power_limit.is_some()
    }
}

#[cfg(test)]
mod tests {
    use super::Motor;

    #[test]
    fn the_power_of_a_line_is_the_largest_at_half_of_its_stall_force() {
        let plain = Motor {
            name: "m".to_owned(),
            scaling: -2.0,
            offset: 0.0,
            speed_limit: 3.0,
            stall_force: None,
            power_limit: None,
        };
        assert_eq!(plain.largest_power(5.0), 30.0);
        let line = Motor { stall_force: Some(8.0), ..plain.clone() };
        assert_eq!([2.0, 4.0, 8.0].map(|pull| line.largest_power(pull)), [9.0, 12.0, 12.0]);
        let limited = Motor { power_limit: Some(10.0), ..line };
        assert_eq!(limited.largest_power(8.0), 10.0);
        assert!(limited.slows() && !plain.slows());
    }
}
