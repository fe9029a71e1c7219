//! Motors.

use super::number::{Bounds, Number, numbers};

/// A motor: the command σ in [0, 1] maps to `s_ref = scaling · (σ − offset)`.
///
/// Its load F is the force of its tendon times its weight, in the unit of s's force: N or N·m. Against a load it reaches
/// `|dσ/dt| ≤ speed_limit · (1 − F / stall_force)` and `F · |ds_ref/dt| ≤ power_limit`.
#[derive(Clone, Debug)]
pub struct Motor {
    /// Name, for messages.
    pub name: String,
    /// Its numbers.
    pub numbers: MotorNumbers,
}

numbers! {
    /// The numbers of a motor.
    numbers MotorNumbers of Motor;
    /// An entry of `[motors]`.
    table MotorSettings;
    /// `s_ref = scaling · (σ − offset)`.
    scaling: f64 = Number { unit: "unit of s", bounds: Bounds::NotZero, ..Number::REQUIRED },
    /// σ at which `s_ref` is 0.
    offset: f64 = Number { unit: "1", ..Number::ZERO },
    /// Largest |dσ/dt|, 1/s.
    speed_limit: f64 = Number { unit: "1/s", bounds: Bounds::Positive, ..Number::REQUIRED },
    /// Load at which it stands still, in the tendon's unit; the speed falls linearly with the load.
    #[serde(skip_serializing_if = "Option::is_none")]
    stall_force: Option<f64> = Number {
        unit: "unit of f",
        bounds: Bounds::Positive,
        shown: "its speed falls with the load, to 0 at {}",
        ..Number::optional("stall")
    },
    /// Largest mechanical power, W.
    #[serde(skip_serializing_if = "Option::is_none")]
    power_limit: Option<f64> = Number {
        unit: "W",
        bounds: Bounds::Positive,
        shown: "at most {} W",
        ..Number::optional("power")
    },
}

impl MotorSettings {
    /// A motor that no load slows.
    pub fn plain(scaling: f64, offset: f64, speed_limit: f64) -> Self {
        let (scaling, offset, speed_limit) = (Some(scaling), Some(offset), Some(speed_limit));
        MotorSettings { scaling, offset, speed_limit, ..MotorSettings::default() }
    }

    /// The motor of that name.
    pub fn motor(&self, name: &str) -> Motor {
        Motor { name: name.to_owned(), numbers: self.numbers() }
    }
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
    use super::{Motor, MotorSettings};

    #[test]
    fn the_power_of_a_line_is_the_largest_at_half_of_its_stall_force() {
        let plain = MotorSettings::plain(-2.0, 0.0, 3.0).motor("m");
        assert_eq!(plain.largest_power(5.0), 30.0);
        let mut line = plain.clone();
        line.stall_force = Some(8.0);
        assert_eq!([2.0, 4.0, 8.0].map(|pull| line.largest_power(pull)), [9.0, 12.0, 12.0]);
        let limited = Motor { numbers: super::MotorNumbers { power_limit: Some(10.0), ..*line }, ..line };
        assert_eq!(limited.largest_power(8.0), 10.0);
        assert!(limited.slows() && !plain.slows());
    }
}
