//! Links and joints of a URDF, each read by urdf-rs on its own: in any order of their elements, and with an error for
//! each that cannot be read.

use roxmltree::Node;
use urdf_rs::{Collision, Joint, JointType, Link, Mimic, Robot, Visual};

use crate::error::ModelError;
use crate::read::limits::Limits;
use crate::read::report::Report;

const GEOMETRY: &str = "one of <box>, <cylinder>, <sphere>, <capsule>, <mesh>";
const SHAPES: [&str; 5] = ["box", "cylinder", "sphere", "capsule", "mesh"];
/// The used children of each element; others, such as `<material>`, may have any content.
const OF_INERTIAL: [&str; 3] = ["origin", "mass", "inertia"];
const OF_SHAPE: [&str; 2] = ["origin", "geometry"];
const OF_JOINT: [&str; 7] = ["origin", "parent", "child", "axis", "limit", "dynamics", "mimic"];

/// The links and joints of a URDF's text. An element that cannot be read is kept as an error and left out.
pub(super) fn robot(
    text: &str,
    root: Node<'_, '_>,
    limits: &Limits,
    report: &mut Report,
) -> Result<Robot, ModelError> {
    let all = |tag: &'static str| root.children().filter(move |node| node.has_tag_name(tag));
    report.limit("robot", "links", all("link").count(), limits.links)?;
    report.limit("robot", "joints", all("joint").count(), limits.joints)?;
    let mut shapes = 0;
    for link in all("link") {
        let count = link.children().filter(|node| node.has_tag_name("collision")).count();
        report.limit(named(link), "collision shapes", count, limits.link_shapes)?;
        shapes += count;
    }
    report.limit("robot", "collision shapes", shapes, limits.shapes)?;
    let version = root.attribute("version").filter(|version| plain(version)).unwrap_or("1.0");
    let file = Source { text, version };
    let links = all("link").filter_map(|node| file.link(node, limits, report)).collect();
    let joints = all("joint").filter_map(|node| file.joint(node, report)).collect();
    let name = root.attribute("name").unwrap_or_default().to_owned();
    Ok(Robot { name, version: None, links, joints, materials: Vec::new() })
}

/// An element by its kind and name.
fn named(node: Node<'_, '_>) -> String {
    format!("{} '{}'", node.tag_name().name(), node.attribute("name").unwrap_or_default())
}

/// Whether a text can be an attribute's value as it is.
fn plain(text: &str) -> bool {
    text.chars().all(|c| c.is_ascii_alphanumeric() || c == '.' || c == '_')
}

/// Children of these names.
fn children<'a, 'i>(node: Node<'a, 'i>, tags: &[&str]) -> Vec<Node<'a, 'i>> {
    node.children().filter(|child| tags.contains(&child.tag_name().name()) && child.is_element()).collect()
}

/// A URDF's text and its version.
struct Source<'t> {
    text: &'t str,
    version: &'t str,
}

impl Source<'_> {
    /// An element with only the children of these names, grouped by name: the parser wants equal ones together.
    fn only(&self, node: Node<'_, '_>, tags: &[&str]) -> String {
        let tag = node.tag_name().name();
        let inner: String = tags
            .iter()
            .flat_map(|tag| children(node, &[tag]))
            .map(|child| &self.text[child.range()])
            .collect();
        format!("<{tag}>{inner}</{tag}>")
    }

    /// A robot with these elements alone.
    fn parse(&self, elements: &str) -> Result<Robot, String> {
        let version = self.version;
        let text = format!("<robot name=\"one\" version=\"{version}\">{elements}</robot>");
        urdf_rs::read_from_string(&text).map_err(|error| error.to_string())
    }

    fn link(&self, node: Node<'_, '_>, limits: &Limits, report: &mut Report) -> Option<Link> {
        let element = named(node);
        let name = named_at_all(node, report)?;
        let inertial: String =
            children(node, &["inertial"]).into_iter().map(|i| self.only(i, &OF_INERTIAL)).collect();
        let parsed = self.parse(&format!("<link name=\"one\">{inertial}</link>"));
        let parsed = parsed.map_err(|e| report.syntax("URDF", format!("{element}: {e}")));
        let link = report.keep(parsed).and_then(|robot| robot.links.into_iter().next());
        let (mut collision, mut visual) = (Vec::new(), Vec::new());
        for (k, shape) in children(node, &["collision"]).into_iter().enumerate() {
            let read = self.shape(shape).map(|link| link.collision);
            let place = format!("{element}, collision {}", k + 1);
            let read = read.map_err(|problem| report.bad(place, problem, GEOMETRY));
            collision.extend(report.keep::<Vec<Collision>>(read).into_iter().flatten());
        }
        for (k, shape) in children(node, &["visual"]).into_iter().take(limits.link_shapes).enumerate() {
            match self.shape(shape).map(|link| link.visual) {
                Ok(read) => visual.extend::<Vec<Visual>>(read),
                Err(problem) => {
                    report.warn(format!("{element}, visual {}", k + 1), format!("{problem}; it is left out"));
                }
            }
        }
        // A link without its faulty parts still has its name, for the joints that name it.
        let link = link.unwrap_or_else(|| Link {
            name: String::new(),
            inertial: urdf_rs::Inertial::default(),
            visual: Vec::new(),
            collision: Vec::new(),
        });
        Some(Link { name, visual, collision, ..link })
    }

    /// A link with this `<visual>` or `<collision>` alone.
    fn shape(&self, node: Node<'_, '_>) -> Result<Link, String> {
        let inside: Vec<&str> = children(node, &["geometry"])
            .into_iter()
            .flat_map(|geometry| geometry.children().filter(Node::is_element))
            .map(|shape| shape.tag_name().name())
            .collect();
        match inside.as_slice() {
            [] => return Err("has no shape in its <geometry>".to_owned()),
            [one] if SHAPES.contains(one) => {}
            [one] => return Err(format!("has the shape <{one}>, which is unknown")),
            many => return Err(format!("has {} shapes in its <geometry>", many.len())),
        }
        let parsed = self.parse(&format!("<link name=\"one\">{}</link>", self.only(node, &OF_SHAPE)));
        let link = parsed?.links.into_iter().next();
        link.ok_or_else(|| "cannot be read".to_owned())
    }

    fn joint(&self, node: Node<'_, '_>, report: &mut Report) -> Option<Joint> {
        let element = named(node);
        let name = named_at_all(node, report)?;
        let kind = node.attribute("type").unwrap_or_default();
        let parsed = if plain(kind) {
            let inner: String = self.only(node, &OF_JOINT).replacen(
                "<joint>",
                &format!("<joint name=\"one\" type=\"{kind}\">"),
                1,
            );
            self.parse(&inner)
        } else {
            Err(format!("is of type '{kind}'"))
        };
        let parsed = parsed.map_err(|e| report.syntax("URDF", format!("{element}: {e}")));
        let mut joint = report.keep(parsed)?.joints.into_iter().next()?;
        // Files of hands with tendons use a multiplier of 0 for a joint that does not follow.
        let still = |m: &Mimic| m.multiplier == Some(0.0) && m.offset.unwrap_or(0.0) == 0.0;
        if let Some(mimic) = joint.mimic.take_if(|mimic| still(mimic)) {
            report.warn(element, format!("mimics '{}' with multiplier 0: it is fixed", mimic.joint));
            joint.joint_type = JointType::Fixed;
        }
        Some(Joint { name, ..joint })
    }
}

/// The name of an element; one without is an error.
fn named_at_all(node: Node<'_, '_>, report: &Report) -> Option<String> {
    let name = node.attribute("name").map(str::to_owned);
    let tag = node.tag_name().name();
    report.keep(name.ok_or_else(|| report.syntax("URDF", format!("a <{tag}> has no name"))))
}
