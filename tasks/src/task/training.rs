//! Training data of a task. It affects neither scored play nor the task's content hash.

use super::placing::Placing;
use serde::Deserialize;

/// The table `[training]` of a `task.toml`.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Training {
    /// Shaped rewards; none: there are none.
    #[serde(default)]
    pub rewards: Option<Rewards>,
    /// Quantities that are drawn for each run, with their ranges.
    #[serde(default)]
    pub randomise: Ranges,
}

/// Weights and scales of the potential Φ, see [`crate::training::Potential`]. Terms that are left out count nothing.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Rewards {
    /// Default γ of a learner: the factor of the potential after a step.
    pub discount: f64,
    /// Distance of the hand.
    #[serde(default)]
    pub distance: Option<Distance>,
    /// Contact of the hand.
    #[serde(default)]
    pub contact: Option<Touching>,
    /// Height of the object.
    #[serde(default)]
    pub lift: Option<Lift>,
    /// Way of the object towards the goal.
    #[serde(default)]
    pub transport: Option<Transport>,
}

/// `weight · scale_m / (scale_m + d)` of the distance d between the hand's grasp centre and the object's centre of mass.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Distance {
    /// Points at distance 0.
    pub weight: f64,
    /// At this distance half of them are left, m.
    pub scale_m: f64,
}

/// `weight · min(n / links, 1)` of the number n of the hand's links that touch the object.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Touching {
    /// Points when `links` links touch.
    pub weight: f64,
    /// Number of links that suffices.
    pub links: u32,
}

/// `weight · h / height_m`, cut to [0, weight], of the height h of the object's centre of mass above where it was at
/// tick 0.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Lift {
    /// Points when it is so high.
    pub weight: f64,
    /// m
    pub height_m: f64,
}

/// `weight · (1 − a / a₀)`, cut to [0, weight], of the distance a of the object's centre of mass from the goal; a₀ is that
/// at tick 0.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Transport {
    /// Points at the goal.
    pub weight: f64,
}

/// Ranges from which a run's variation is drawn; what is left out stays as the task has it. Factors are drawn evenly in
/// their logarithm, everything else evenly.
#[derive(Clone, Debug, Default, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Ranges {
    /// Factor of each object's mass.
    #[serde(default)]
    pub mass: Option<[f64; 2]>,
    /// Factor of each object's friction coefficient.
    #[serde(default)]
    pub friction: Option<[f64; 2]>,
    /// Factor of each object's lengths, its mass staying as it is.
    #[serde(default)]
    pub size: Option<[f64; 2]>,
    /// Factor of the errors of all sensors, in runs with real ones.
    #[serde(default)]
    pub sensor_noise: Option<[f64; 2]>,
    /// Initial pose of the hand.
    #[serde(default)]
    pub hand_pose: Option<HandPoses>,
    /// Initial poses of the objects, in addition to the seed's draw.
    #[serde(default)]
    pub object_poses: Option<ObjectPoses>,
    /// Whether the hand's uncertain numbers are drawn, from the ranges of the hand.
    #[serde(default)]
    pub hand: bool,
}

/// Range of the hand's initial pose around that of the task.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct HandPoses {
    /// Largest shift along x, y and z of the world, m.
    pub position_m: [f64; 3],
    /// Largest turn, about an axis that may be any, degrees.
    pub turn_deg: f64,
}

/// Range of the initial poses of objects.
#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct ObjectPoses {
    /// Largest shift in x and y, m. Not with `scatter`, which puts objects anywhere already.
    #[serde(default)]
    pub shift_m: f64,
    /// Largest tilt, about a horizontal axis that may be any, degrees.
    #[serde(default)]
    pub tilt_deg: f64,
}

/// Something that can be drawn anew for every run.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Quantity {
    /// Masses of objects.
    Mass,
    /// Friction coefficients of objects.
    Friction,
    /// Sizes of objects.
    Size,
    /// Errors of sensors.
    SensorNoise,
    /// Initial pose of the hand.
    HandPose,
    /// Initial poses of objects.
    ObjectPoses,
}

impl Quantity {
    /// All of them.
    pub const ALL: [Quantity; 6] = [
        Quantity::Mass,
        Quantity::Friction,
        Quantity::Size,
        Quantity::SensorNoise,
        Quantity::HandPose,
        Quantity::ObjectPoses,
    ];

    /// Name in a `task.toml`.
    pub fn name(self) -> &'static str {
        match self {
            Quantity::Mass => "mass",
            Quantity::Friction => "friction",
            Quantity::Size => "size",
            Quantity::SensorNoise => "sensor_noise",
            Quantity::HandPose => "hand_pose",
            Quantity::ObjectPoses => "object_poses",
        }
    }

    /// Whether there is a range of it.
    pub(crate) fn declared(self, ranges: &Ranges) -> bool {
        match self {
            Quantity::Mass => ranges.mass.is_some(),
            Quantity::Friction => ranges.friction.is_some(),
            Quantity::Size => ranges.size.is_some(),
            Quantity::SensorNoise => ranges.sensor_noise.is_some(),
            Quantity::HandPose => ranges.hand_pose.is_some(),
            Quantity::ObjectPoses => ranges.object_poses.is_some(),
        }
    }
}

impl Training {
    /// Checks the numbers. `destination`: the rules have a place where objects must end.
    pub(crate) fn check(&self, destination: bool, place: &Placing) -> Result<(), String> {
        if let Some(rewards) = &self.rewards {
            rewards.check(destination)?;
        }
        self.randomise.check(place)
    }
}

impl Rewards {
    fn check(&self, destination: bool) -> Result<(), String> {
        let within = |field: &str, x: f64, low: f64, high: f64| match (low..=high).contains(&x) {
            true => Ok(()),
            false => Err(format!("training.rewards.{field} = {x}; it must be in [{low}, {high}]")),
        };
        within("discount", self.discount, 0.0, 1.0)?;
        if let Some(Distance { weight, scale_m }) = self.distance {
            within("distance.weight", weight, 0.0, 1e3)?;
            within("distance.scale_m", scale_m, 1e-3, 1e3)?;
        }
        if let Some(Touching { weight, links }) = self.contact {
            within("contact.weight", weight, 0.0, 1e3)?;
            within("contact.links", f64::from(links), 1.0, 64.0)?;
        }
        if let Some(Lift { weight, height_m }) = self.lift {
            within("lift.weight", weight, 0.0, 1e3)?;
            within("lift.height_m", height_m, 1e-3, 1e3)?;
        }
        if let Some(Transport { weight }) = self.transport {
            within("transport.weight", weight, 0.0, 1e3)?;
            if !destination {
                return Err(
                    "training.rewards.transport: these rules have no goal to come nearer to; leave it \
                            out"
                    .to_owned(),
                );
            }
        }
        Ok(())
    }
}

impl Ranges {
    fn check(&self, place: &Placing) -> Result<(), String> {
        let factors = [
            ("mass", self.mass, 100.0),
            ("friction", self.friction, 100.0),
            ("size", self.size, 4.0),
            ("sensor_noise", self.sensor_noise, 100.0),
        ];
        for (field, range, most) in factors {
            let Some([low, high]) = range else { continue };
            if !((1.0 / most..=high).contains(&low) && high <= most) {
                return Err(format!(
                    "training.randomise.{field} = [{low}, {high}]; a factor's range must ascend within [{}, {most}]",
                    1.0 / most
                ));
            }
        }
        let within = |field: &str, x: f64, high: f64| match (0.0..=high).contains(&x) {
            true => Ok(()),
            false => Err(format!("training.randomise.{field} = {x}; it must be in [0, {high}]")),
        };
        if let Some(HandPoses { position_m, turn_deg }) = self.hand_pose {
            for x in position_m {
                within("hand_pose.position_m", x, 1.0)?;
            }
            within("hand_pose.turn_deg", turn_deg, 180.0)?;
        }
        if let Some(ObjectPoses { shift_m, tilt_deg }) = self.object_poses {
            within("object_poses.shift_m", shift_m, 1.0)?;
            within("object_poses.tilt_deg", tilt_deg, 180.0)?;
            match place {
                Placing::Scatter(_) if shift_m > 0.0 => {
                    return Err(
                        "training.randomise.object_poses.shift_m: `scatter` puts objects anywhere already; leave it out"
                            .to_owned(),
                    );
                }
                Placing::Fixed(_) => {
                    return Err(
                        "training.randomise.object_poses: `fixed` has a shift and a turn of its own; leave it out"
                            .to_owned(),
                    );
                }
                Placing::Scatter(_) | Placing::Pour(_) => {}
            }
        }
        Ok(())
    }
}
