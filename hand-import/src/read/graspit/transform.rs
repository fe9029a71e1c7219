//! `<transform>`: maps in order, lengths in mm, angles in degrees.

use palmares_models::{Mat3, Pose, Rotation, Vec3};
use roxmltree::Node;

use super::units::MM;
use crate::decision::{At, Log};
use crate::xml::Element;

/// The product of the maps of a `<transform>`.
pub(super) fn transform(node: Node<'_, '_>, element: &str, at: &At, log: &mut Log) -> Pose {
    let mut pose = Pose::IDENTITY;
    for part in node.children().filter(Node::is_element) {
        let text = part.text().unwrap_or_default().trim();
        let mut e = Element { name: element, at: at.clone(), log };
        let moved = match part.tag_name().name() {
            "translation" => e
                .list::<3>("<translation>", text)
                .map(|xyz| Pose::from_parts(Vec3::from_array(xyz) * MM, Rotation::IDENTITY)),
            "rotation" => rotation(text, &mut e),
            "rotationMatrix" => e.list::<9>("<rotationMatrix>", text).and_then(|m| {
                // Column by column.
                let column = |k: usize| Vec3::new(m[3 * k], m[3 * k + 1], m[3 * k + 2]);
                let matrix = Mat3::from_cols(column(0), column(1), column(2));
                let rigid = (matrix.transpose() * matrix - Mat3::IDENTITY).to_cols_array();
                if rigid.iter().any(|x| x.abs() > 0.05) || matrix.determinant() < 0.0 {
                    let text = "<rotationMatrix> is no rotation; not read";
                    e.log.problem(e.at.clone(), e.name, text);
                    return None;
                }
                Some(Pose::from_parts(Vec3::ZERO, Rotation::from_mat3(&matrix).normalize()))
            }),
            "fullTransform" => {
                // `(w x y z)[x y z]`
                let plain = text.replace(['(', ')', '[', ']', ','], " ");
                e.list::<7>("<fullTransform>", &plain).and_then(|[w, x, y, z, a, b, c]| {
                    let turn = Rotation::from_xyzw(x, y, z, w);
                    if turn.length() < 1e-6 {
                        e.log.problem(e.at.clone(), e.name, "<fullTransform> has no rotation; not read");
                        return None;
                    }
                    Some(Pose::from_parts(Vec3::new(a, b, c) * MM, turn.normalize()))
                })
            }
            other => {
                e.log.problem(at.clone(), element, format!("<{other}> in a <transform> is not read"));
                None
            }
        };
        pose *= moved.unwrap_or(Pose::IDENTITY);
    }
    pose
}

/// `90 x`: an angle and an axis.
fn rotation(text: &str, e: &mut Element<'_>) -> Option<Pose> {
    let (angle, axis) = text.split_once(char::is_whitespace).unwrap_or((text, ""));
    let axis = match axis.trim() {
        "x" => Vec3::X,
        "y" => Vec3::Y,
        "z" => Vec3::Z,
        other => {
            let other: String = other.chars().take(20).collect();
            e.log.problem(
                e.at.clone(),
                e.name,
                format!("<rotation> is about the unknown axis '{other}'; not read"),
            );
            return None;
        }
    };
    let angle = e.number("<rotation>", angle)?.to_radians();
    Some(Pose::from_parts(Vec3::ZERO, Rotation::from_axis_angle(axis, angle)))
}
