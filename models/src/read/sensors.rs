//! Moves sensors that `hand.toml` mounts on links of the URDF to the merged links.

use super::report::Report;
use super::springs::unknown_link;
use super::urdf::reduce::Reduced;
use super::urdf::tree::Urdf;
use crate::Pose;
use crate::hand::Sensors;

/// The sensors with the names of the hand's own links, and poses in their frames. Problems are kept.
pub(crate) fn mounted(settings: &Sensors, tree: &Urdf, reduced: &Reduced, report: &Report) -> Sensors {
    let place = |element: &str, link: &str| -> Option<(String, Pose)> {
        let urdf_link = tree.robot.links.iter().position(|l| l.name == link);
        let place = urdf_link.and_then(|l| reduced.merged_into[l]);
        let (link, link_from_urdf) = report.keep(place.ok_or_else(|| unknown_link(link, element, report)))?;
        Some((reduced.links[link].name.clone(), link_from_urdf))
    };
    let mut sensors = settings.clone();
    for camera in &mut sensors.cameras {
        let element = format!("camera '{}'", camera.name);
        let Some(link) = &camera.link else {
            report.keep::<()>(Err(report.bad(element, "has no link", "link = a <link> of the URDF")));
            continue;
        };
        let Some((link, link_from_urdf)) = place(&element, link) else { continue };
        let pose = link_from_urdf * camera.pose();
        camera.link = Some(link);
        (camera.position, camera.quat_xyzw) = (pose.translation.to_array(), pose.rotation.to_array());
    }
    if let Some(sensor) = &mut sensors.accelerometer {
        let place = place("accelerometer", &sensor.link);
        sensor.link = place.map_or_else(String::new, |(link, _)| link);
    }
    sensors
}
