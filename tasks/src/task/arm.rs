//! The arm of a task that carries the hand.

use super::furniture::{MAX_COORDINATE_M, unit_quaternion};
use super::objects::ObjectError;
use palmares_models::arm::{Arm, ArmJoint};
use palmares_models::error::LoadWarning;
use palmares_models::read::{Files, arm};
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::arm::{distance, place};
use serde::Deserialize;
use serde::de::value::MapAccessDeserializer;
use serde::de::{Deserializer, MapAccess, Visitor};
use std::fmt;
use std::path::Path;
use std::sync::Arc;

/// Length by which a hand reaches beyond its base, m.
const HAND_M: f64 = 0.3;

/// `arm = "fr3.urdf"`, or a table of these fields.
#[derive(Clone, Debug)]
pub struct Carrier {
    table: Table,
    /// Made when the file is read.
    arm: Option<Arc<Arm>>,
}

#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Table {
    /// Its URDF, next to the task.
    urdf: String,
    /// The link that carries the hand; left out, the end of the only chain.
    tip: Option<String>,
    /// Place of the root link, m.
    #[serde(default)]
    position: [f64; 3],
    /// Orientation of the root link, x, y, z, w.
    #[serde(default = "upright")]
    quat_xyzw: [f64; 4],
    /// Pose of the hand's base in the frame of `tip`.
    #[serde(default = "at_the_tip")]
    mount: Mount,
    /// Joints near which it begins, rad or m; left out, the middles of their ranges.
    start: Option<Vec<f64>>,
}

#[derive(Clone, Copy, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
struct Mount {
    /// m
    #[serde(default)]
    position: [f64; 3],
    /// x, y, z, w
    #[serde(default = "upright")]
    quat_xyzw: [f64; 4],
}

const fn upright() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

const fn at_the_tip() -> Mount {
    Mount { position: [0.0; 3], quat_xyzw: upright() }
}

impl<'de> Deserialize<'de> for Carrier {
    fn deserialize<D: Deserializer<'de>>(deserializer: D) -> Result<Self, D::Error> {
        struct Either;
        impl<'de> Visitor<'de> for Either {
            type Value = Table;

            fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
                f.write_str("the name of a URDF, or a table with `urdf`, `tip`, `position`, `quat_xyzw`, `mount`, `start`")
            }

            fn visit_str<E>(self, urdf: &str) -> Result<Table, E> {
                let (urdf, position, quat_xyzw) = (urdf.to_owned(), [0.0; 3], upright());
                Ok(Table { urdf, tip: None, position, quat_xyzw, mount: at_the_tip(), start: None })
            }

            fn visit_map<A: MapAccess<'de>>(self, map: A) -> Result<Table, A::Error> {
                Table::deserialize(MapAccessDeserializer::new(map))
            }
        }
        deserializer.deserialize_any(Either).map(|table| Carrier { table, arm: None })
    }
}

/// A pose of checked numbers.
fn pose(position: [f64; 3], [x, y, z, w]: [f64; 4]) -> Pose {
    Pose::from_parts(Vec3::from_array(position), Rotation::from_xyzw(x, y, z, w).normalize())
}

impl Carrier {
    /// Reads the arm.
    pub(crate) fn resolve(&mut self, files: Option<&Files>) -> Result<(), ObjectError> {
        let Table { urdf, tip, position, quat_xyzw, mount, start } = &self.table;
        let poses = [("arm", position, quat_xyzw), ("arm.mount", &mount.position, &mount.quat_xyzw)];
        for (field, position, quat_xyzw) in poses {
            if !position.iter().all(|x| x.abs() <= MAX_COORDINATE_M) {
                let valid = format!("three numbers within {MAX_COORDINATE_M} m");
                return Err(format!("{field}.position = {position:?}; {valid}").into());
            }
            if !unit_quaternion(quat_xyzw) {
                return Err(format!("{field}.quat_xyzw = {quat_xyzw:?}; a unit quaternion x, y, z, w").into());
            }
        }
        let files = files.ok_or_else(|| format!("arm names `{urdf}`, but the task has no folder"))?;
        let mut arm = arm(urdf, tip.as_deref(), files, "arm")?;
        arm.world_from_root = pose(*position, *quat_xyzw);
        arm.last_from_base *= pose(mount.position, mount.quat_xyzw);
        if let Some(start) = start {
            let names: Vec<&str> = arm.joints.iter().map(|joint| joint.name.as_str()).collect();
            if start.len() != names.len() {
                let (found, count) = (start.len(), names.len());
                return Err(format!(
                    "arm.start has {found} numbers; one for each of {count} joints: {}",
                    names.join(", ")
                )
                .into());
            }
            for (joint, q) in arm.joints.iter().zip(start) {
                if !(joint.lower..=joint.upper).contains(q) {
                    let range = format!("{} to {}", joint.lower, joint.upper);
                    return Err(
                        format!("arm.start: joint `{}` at {q}; its range is {range}", joint.name).into()
                    );
                }
            }
        }
        self.arm = Some(Arc::new(arm));
        Ok(())
    }

    /// The arm.
    ///
    /// # Panics
    /// The task's file has not been read as a whole.
    pub fn arm(&self) -> &Arc<Arm> {
        self.arm.as_ref().expect("a task's file is read as a whole")
    }

    /// Checks that the hand can begin at `base`, and that the arm comes near the regions of the rules, given by name and middle; returns
    /// what is odd about these.
    pub(crate) fn check_reach<'a>(
        &self,
        file: &Path,
        base: Pose,
        regions: impl Iterator<Item = (&'a str, Vec3)>,
    ) -> Result<Vec<LoadWarning>, String> {
        let start = place(self.arm(), &self.guess(), base);
        if !start.is_there() {
            let gap = format!("{:.3} m and {:.3} rad", start.gap_m, start.gap_rad);
            return Err(format!("hand.position is out of the arm's reach: the nearest pose is {gap} away"));
        }
        let far = regions.filter_map(|(name, middle)| {
            let away = distance(self.arm(), &start.q, middle);
            (away > HAND_M).then(|| LoadWarning {
                file: file.to_owned(),
                element: format!("region `{name}`"),
                message: format!("its middle is {away:.2} m from where the arm can bring the hand"),
            })
        });
        Ok(far.collect())
    }

    /// Joints near which it begins.
    pub fn guess(&self) -> Vec<f64> {
        let middles = || self.arm().joints.iter().map(ArmJoint::middle).collect();
        self.table.start.clone().unwrap_or_else(middles)
    }
}
