//! Putting each object at a pose of its own.

use super::placed::Placed;
use super::rng::SceneRng;
use crate::task::{DrawableObject, Fixed};
use palmares_models::{Pose, Rotation, Vec3, rotation};

/// Poses for the objects, in their order. In the list an object comes after the one on which it is.
pub(super) fn fixed(list: &[Fixed], objects: &[Placed], dice: &mut SceneRng) -> Vec<Pose> {
    let mut put: Vec<(&str, Pose)> = Vec::new();
    for one in list {
        let [x, y, z] = one.shift.map(|most| most * dice.both_ways());
        let yaw = one.turn_deg.to_radians() * dice.both_ways();
        let drawn = Pose::from_parts(Vec3::new(x, y, z), rotation::from_rpy([0.0, 0.0, yaw]));
        let own = nominal(one);
        let here = Pose::from_parts(own.translation + drawn.translation, drawn.rotation * own.rotation);
        let below = one.on.as_deref().and_then(|on| pose_of(&put, on)).unwrap_or(Pose::IDENTITY);
        put.push((&one.object, below * here));
    }
    objects.iter().map(|placed| pose_of(&put, &placed.object.name).unwrap_or(Pose::IDENTITY)).collect()
}

fn nominal(one: &Fixed) -> Pose {
    let [x, y, z, w] = one.quat_xyzw;
    Pose::from_parts(Vec3::from_array(one.position), Rotation::from_xyzw(x, y, z, w).normalize())
}

fn pose_of(put: &[(&str, Pose)], name: &str) -> Option<Pose> {
    put.iter().find(|(known, _)| *known == name).map(|(_, pose)| *pose)
}

/// Maximum deviation of an object from its pose without shift and turn.
struct Slack<'a> {
    name: &'a str,
    nominal: Pose,
    /// m, in every direction
    shift: f64,
    turned: bool,
}

/// Lowest and highest corner of all that the objects can fill, m.
pub(super) fn room(list: &[Fixed], kinds: &[DrawableObject]) -> Option<([f64; 3], [f64; 3])> {
    let mut stands: Vec<Slack<'_>> = Vec::new();
    let (mut low, mut high) = (Vec3::splat(f64::INFINITY), Vec3::splat(f64::NEG_INFINITY));
    for one in list {
        let own = nominal(one);
        let on = one.on.as_deref().and_then(|on| stands.iter().find(|below| below.name == on));
        let lever = if on.is_some_and(|below| below.turned) { 2.0 * own.translation.length() } else { 0.0 };
        let stand = Slack {
            name: &one.object,
            nominal: on.map_or(Pose::IDENTITY, |below| below.nominal) * own,
            shift: on.map_or(0.0, |below| below.shift) + lever + Vec3::from_array(one.shift).length(),
            turned: one.turn_deg > 0.0 || on.is_some_and(|below| below.turned),
        };
        let object = &kinds.iter().find(|kind| kind.object.name == one.object)?.object;
        let (min, max) = object.bounds();
        let corners = (0..8).map(|k| {
            let pick = |bit: usize, a: f64, b: f64| if k >> bit & 1 == 0 { a } else { b };
            Vec3::new(pick(0, min.x, max.x), pick(1, min.y, max.y), pick(2, min.z, max.z))
        });
        for corner in corners {
            let at = stand.nominal * corner;
            let around = at - stand.nominal.translation;
            let turn = if stand.turned { libm::hypot(around.x, around.y) } else { 0.0 };
            let (center, slack) = (stand.nominal.translation, Vec3::splat(stand.shift));
            let reach = Vec3::new(turn, turn, 0.0);
            let (least, most) = if stand.turned {
                let middle = Vec3::new(center.x, center.y, at.z);
                (middle - reach, middle + reach)
            } else {
                (at, at)
            };
            low = low.min(least - slack);
            high = high.max(most + slack);
        }
        stands.push(stand);
    }
    Some((low.to_array(), high.to_array()))
}
