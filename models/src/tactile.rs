//! The hand's tactile patches, from the groups that `hand.toml` states on links of the URDF.

use serde::Deserialize;

use crate::error::ModelError;
use crate::hand::TactilePatch;
use crate::load::Report;
use crate::rolling::Reduced;
use crate::urdf::Urdf;
use crate::{Mat3, Pose, Rotation, Vec3};

/// Patches of one size on one flat surface.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub(crate) struct TactileSettings {
    /// The patches' names are this and their number, from 1 on.
    pub(crate) name: String,
    /// URDF link whose frame the vectors are in.
    link: String,
    /// Direction of the patches' first extent.
    along: [f64; 3],
    /// Out of the hand.
    normal: [f64; 3],
    /// Extents along `along` and across it, m.
    size: [f64; 2],
    /// One per patch, m.
    pub(crate) centers: Vec<[f64; 3]>,
}

impl TactileSettings {
    /// Every length in it.
    pub(crate) fn lengths(&self) -> impl Iterator<Item = f64> {
        self.size.iter().copied().chain(self.centers.iter().flatten().copied())
    }
}

/// All patches that the settings name, on the links that the tree was reduced to.
pub(crate) fn patches(
    settings: &[TactileSettings],
    tree: &Urdf,
    reduced: &Reduced,
    report: &Report,
) -> Result<Vec<TactilePatch>, ModelError> {
    let mut out = Vec::new();
    for group in settings {
        let element = || format!("tactile '{}'", group.name);
        let place =
            tree.robot.links.iter().position(|l| l.name == group.link).and_then(|l| reduced.places[l]);
        let (link, link_from_urdf) = place.ok_or_else(|| {
            report.bad(element(), format!("names link '{}'", group.link), "a <link> of the URDF")
        })?;
        let (x, z) = (Vec3::from_array(group.along), Vec3::from_array(group.normal));
        let square =
            (x.length() - 1.0).abs() < 1e-9 && (z.length() - 1.0).abs() < 1e-9 && x.dot(z).abs() < 1e-9;
        if !square {
            return Err(report.bad(
                element(),
                "along and normal span no frame",
                "two unit vectors at right angles",
            ));
        }
        let rotation = Rotation::from_mat3(&Mat3::from_cols(x, z.cross(x), z));
        for (k, center) in group.centers.iter().enumerate() {
            out.push(TactilePatch {
                name: format!("{}_{}", group.name, k + 1),
                link,
                link_from_patch: link_from_urdf * Pose::from_parts(Vec3::from_array(*center), rotation),
                half_size: group.size.map(|x| 0.5 * x),
            });
        }
    }
    Ok(out)
}
