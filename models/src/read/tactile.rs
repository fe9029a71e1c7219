//! The hand's tactile patches, from the groups on links of the URDF in `hand.toml`.

use super::report::Report;
use super::settings::TactileSettings;
use super::springs::unknown_link;
use super::urdf::reduce::Reduced;
use super::urdf::tree::Urdf;
use crate::hand::TactilePatch;
use crate::{Mat3, Pose, Rotation, Vec3};

/// Every patch, on the link into which its URDF link was merged; those with a problem, which is kept, are left out.
pub(crate) fn patches(
    settings: &[TactileSettings],
    tree: &Urdf,
    reduced: &Reduced,
    report: &Report,
) -> Vec<TactilePatch> {
    let mut out = Vec::new();
    for group in settings {
        let element = format!("tactile '{}'", group.name);
        let place =
            tree.robot.links.iter().position(|l| l.name == group.link).and_then(|l| reduced.merged_into[l]);
        let place = report.keep(place.ok_or_else(|| unknown_link(&group.link, &element, report)));
        let (x, z) = (Vec3::from_array(group.along), Vec3::from_array(group.normal));
        let square =
            (x.length() - 1.0).abs() < 1e-9 && (z.length() - 1.0).abs() < 1e-9 && x.dot(z).abs() < 1e-9;
        if !square {
            let problem = "along and normal span no frame";
            report.keep::<()>(Err(report.bad(element, problem, "two unit vectors at right angles")));
            continue;
        }
        let Some((link, link_from_urdf)) = place else { continue };
        let rotation = Rotation::from_mat3(&Mat3::from_cols(x, z.cross(x), z));
        for (k, center) in group.centers.iter().enumerate() {
            let alone = group.centers.len() == 1;
            out.push(TactilePatch {
                name: if alone { group.name.clone() } else { format!("{}_{}", group.name, k + 1) },
                link,
                link_from_patch: link_from_urdf * Pose::from_parts(Vec3::from_array(*center), rotation),
                half_size: group.size.map(|x| 0.5 * x),
                taxels: group.taxels,
            });
        }
    }
    out
}
