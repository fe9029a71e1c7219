//! `hand.urdf`: links, joints and transmissions.

use std::fmt::Write as _;

use super::{Comments, number};
use crate::complete::Complete;
use crate::decision::At;
use crate::draft::{Geometry, Joint, JointKind, Link, LinkShape, Origin, Triangles};

/// The text of `hand.urdf`.
pub(crate) fn urdf(hand: &Complete, head: &str, comments: &mut Comments<'_>) -> String {
    let draft = &hand.draft;
    let mut out = String::from("<?xml version=\"1.0\"?>\n");
    comment(&mut out, "", head);
    let _ = writeln!(out, "<robot name=\"{}\">", escaped(&draft.name));
    for item in &draft.links {
        for text in comments.at(&At::Link(item.name.clone())) {
            comment(&mut out, "  ", &text);
        }
        link(&mut out, item);
    }
    for item in &draft.joints {
        for text in comments.at(&At::Joint(item.name.clone())) {
            comment(&mut out, "  ", &text);
        }
        joint(&mut out, item, hand);
    }
    let mut sprung = Vec::new();
    for tendon in &hand.tendons {
        let Some(motor) = tendon.motor_in_urdf() else { continue };
        for text in comments.at(&At::Tendon(tendon.name.clone())) {
            comment(&mut out, "  ", &text);
        }
        let _ = writeln!(out, "  <transmission name=\"{}\">", escaped(&tendon.name));
        out.push_str("    <type>transmission_interface/AdaptiveSynergyTransmission</type>\n");
        let _ = writeln!(out, "    <actuator name=\"{}\"/>", escaped(motor));
        for (name, arm) in &tendon.arms {
            let _ = writeln!(out, "    <joint name=\"{}\">", escaped(name));
            let _ = writeln!(out, "      <mechanicalReduction>{}</mechanicalReduction>", number(*arm));
            let found = draft.joints.iter().find(|joint| joint.name == *name);
            // E and q0 belong to the joint: its first tendon states them.
            if let Some(joint) = found.filter(|_| !sprung.contains(name)) {
                sprung.push(name.clone());
                for (tag, value) in
                    [("mechanicalElasticity", joint.stated.stiffness), ("offset", joint.stated.rest)]
                {
                    if let Some(value) = value {
                        let _ = writeln!(out, "      <{tag}>{}</{tag}>", number(value));
                    }
                }
            }
            out.push_str("    </joint>\n");
        }
        out.push_str("  </transmission>\n");
    }
    for servo in &hand.servos {
        let (name, joint, motor) = (escaped(&servo.name), escaped(&servo.joint), escaped(&servo.motor));
        // The numbers are in the joint's <limit> and in hand.toml.
        let _ = writeln!(
            out,
            "  <transmission name=\"{name}\">\n    <type>transmission_interface/SimpleTransmission</type>\n    \
             <joint name=\"{joint}\"/>\n    <actuator name=\"{motor}\"/>\n  </transmission>"
        );
    }
    out.push_str("</robot>\n");
    out
}

/// XML comments must not have two hyphens in a row.
fn comment(out: &mut String, indent: &str, text: &str) {
    let text = text.replace("--", "- -");
    let text = text.trim_end_matches('-');
    let _ = writeln!(out, "{indent}<!-- {text} -->");
}

fn link(out: &mut String, link: &Link) {
    if link.inertial.is_none() && link.collisions.is_empty() && link.visuals.is_empty() {
        let _ = writeln!(out, "  <link name=\"{}\"/>", escaped(&link.name));
        return;
    }
    let _ = writeln!(out, "  <link name=\"{}\">", escaped(&link.name));
    if let Some(inertial) = &link.inertial {
        out.push_str("    <inertial>\n");
        origin(out, "      ", &inertial.origin);
        let [xx, xy, xz, yy, yz, zz] = inertial.inertia.map(number);
        let _ = writeln!(out, "      <mass value=\"{}\"/>", number(inertial.mass));
        let _ = writeln!(
            out,
            "      <inertia ixx=\"{xx}\" ixy=\"{xy}\" ixz=\"{xz}\" iyy=\"{yy}\" iyz=\"{yz}\" izz=\"{zz}\"/>"
        );
        out.push_str("    </inertial>\n");
    }
    parts(out, "visual", &link.visuals);
    parts(out, "collision", &link.collisions);
    out.push_str("  </link>\n");
}

fn parts(out: &mut String, tag: &str, parts: &[LinkShape]) {
    for part in parts {
        let _ = writeln!(out, "    <{tag}>");
        origin(out, "      ", &part.origin);
        let shape = match &part.geometry {
            Geometry::Box(size) => format!("<box size=\"{}\"/>", numbers(size)),
            Geometry::Sphere { radius } => format!("<sphere radius=\"{}\"/>", number(*radius)),
            Geometry::Cylinder { radius, length } => {
                format!("<cylinder radius=\"{}\" length=\"{}\"/>", number(*radius), number(*length))
            }
            Geometry::Capsule { radius, length } => {
                format!("<capsule radius=\"{}\" length=\"{}\"/>", number(*radius), number(*length))
            }
            // Ellipsoids and inline triangles are files by now.
            Geometry::Ellipsoid(_) => String::new(),
            Geometry::Mesh(mesh) => {
                let file = match &mesh.triangles {
                    Triangles::File(path) => path.display().to_string().replace('\\', "/"),
                    Triangles::Inline { name, .. } => name.clone(),
                };
                let scale = mesh.scale != [1.0; 3];
                let scale =
                    if scale { format!(" scale=\"{}\"", numbers(&mesh.scale)) } else { String::new() };
                format!("<mesh filename=\"{}\"{scale}/>", escaped(&file))
            }
        };
        let _ = writeln!(out, "      <geometry>{shape}</geometry>");
        let _ = writeln!(out, "    </{tag}>");
    }
}

fn joint(out: &mut String, joint: &Joint, hand: &Complete) {
    let kind = match joint.kind {
        JointKind::Fixed => "fixed",
        JointKind::Continuous => "continuous",
        JointKind::Prismatic => "prismatic",
        JointKind::Revolute | JointKind::Ball => "revolute",
    };
    let _ = writeln!(out, "  <joint name=\"{}\" type=\"{kind}\">", escaped(&joint.name));
    let _ = writeln!(out, "    <parent link=\"{}\"/>", escaped(&joint.parent));
    let _ = writeln!(out, "    <child link=\"{}\"/>", escaped(&joint.child));
    origin(out, "    ", &joint.origin);
    if joint.kind != JointKind::Fixed {
        let _ = writeln!(out, "    <axis xyz=\"{}\"/>", numbers(&joint.axis));
        if let Some([low, high]) = joint.limits {
            let (effort, velocity) = (joint.effort.unwrap_or_default(), joint.velocity.unwrap_or_default());
            let _ = writeln!(
                out,
                "    <limit lower=\"{}\" upper=\"{}\" effort=\"{}\" velocity=\"{}\"/>",
                number(low),
                number(high),
                number(effort),
                number(velocity)
            );
        }
        if joint.stated.damping.is_some() || joint.stated.friction.is_some() {
            let damping = number(joint.stated.damping.unwrap_or_default());
            let friction = joint.stated.friction.filter(|f| *f != 0.0);
            let friction = friction.map(|f| format!(" friction=\"{}\"", number(f))).unwrap_or_default();
            let _ = writeln!(out, "    <dynamics damping=\"{damping}\"{friction}/>");
        }
        if let Some(coupling) = hand.draft.couplings.iter().find(|coupling| coupling.joint == joint.name) {
            let (constant, slope) = (coupling.coefficients[0], coupling.coefficients[1]);
            let _ = writeln!(
                out,
                "    <mimic joint=\"{}\" multiplier=\"{}\" offset=\"{}\"/>",
                escaped(&coupling.leader),
                number(slope),
                number(constant)
            );
        }
    }
    out.push_str("  </joint>\n");
}

fn origin(out: &mut String, indent: &str, origin: &Origin) {
    if *origin != Origin::default() {
        let (xyz, rpy) = (numbers(&origin.xyz), numbers(&origin.rpy));
        let _ = writeln!(out, "{indent}<origin xyz=\"{xyz}\" rpy=\"{rpy}\"/>");
    }
}

fn numbers(list: &[f64]) -> String {
    list.iter().map(|x| number(*x)).collect::<Vec<_>>().join(" ")
}

/// The text of an attribute. A tab or a new line in it would be read as a space.
fn escaped(text: &str) -> String {
    let text = text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;");
    text.replace('\t', "&#9;").replace('\n', "&#10;").replace('\r', "&#13;")
}
