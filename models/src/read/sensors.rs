//! Moves sensors that `hand.toml` mounts on links of the URDF to the merged links.

use super::report::Report;
use super::urdf::reduce::Reduced;
use super::urdf::tree::Urdf;
use crate::Pose;
use crate::error::ModelError;
use crate::hand::Sensors;

/// The sensors with the names of the hand's own links, and poses in their frames.
pub(crate) fn mounted(
    settings: &Sensors,
    tree: &Urdf,
    reduced: &Reduced,
    report: &Report,
) -> Result<Sensors, ModelError> {
    let place = |element: &str, link: &str| -> Result<(String, Pose), ModelError> {
        let urdf_link = tree.robot.links.iter().position(|l| l.name == link);
        let (link, link_from_urdf) = urdf_link
            .and_then(|l| reduced.merged_into[l])
            .ok_or_else(|| report.bad(element, format!("sits on link '{link}'"), "a <link> of the URDF"))?;
        Ok((reduced.links[link].name.clone(), link_from_urdf))
    };
    let mut sensors = settings.clone();
    for camera in &mut sensors.cameras {
        let element = format!("camera '{}'", camera.name);
        let Some(link) = &camera.link else {
            return Err(report.bad(element, "has no link", "link = a <link> of the URDF"));
        };
        let (link, link_from_urdf) = place(&element, link)?;
        let pose = link_from_urdf * camera.pose();
        camera.link = Some(link);
        (camera.position, camera.quat_xyzw) = (pose.translation.to_array(), pose.rotation.to_array());
    }
    if let Some(sensor) = &mut sensors.accelerometer {
        sensor.link = place("accelerometer", &sensor.link)?.0;
    }
    Ok(sensors)
}
