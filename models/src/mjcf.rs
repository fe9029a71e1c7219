//! Elements of an MJCF document, as every writer of one needs them.

use crate::hand::Inertia;
use crate::shape::Shape;
use crate::{Pose, Rotation, Vec3};
use std::fmt::Write as _;

/// A text of elements, one a line, each indented by its depth.
#[derive(Debug, Default)]
pub struct Lines {
    out: String,
    depth: usize,
}

impl Lines {
    /// Lines at a depth.
    pub fn at(depth: usize) -> Self {
        Lines { out: String::new(), depth }
    }

    /// Whether there is none.
    pub fn is_empty(&self) -> bool {
        self.out.is_empty()
    }

    /// The text.
    pub fn into_text(self) -> String {
        self.out
    }

    /// The same elements on one line, with single quotes.
    pub fn into_one_line(self) -> String {
        let line: String = self.out.lines().map(str::trim_start).collect();
        line.replace('\'', "&apos;").replace('"', "'")
    }

    /// An element without content.
    pub fn leaf(&mut self, element: Element) {
        self.line(&format!("{}/>", element.0));
    }

    /// An element, and its content up to [`Lines::close`].
    pub fn open(&mut self, element: Element) {
        self.line(&format!("{}>", element.0));
        self.depth += 1;
    }

    /// The end of an element.
    pub fn close(&mut self, tag: &str) {
        self.depth -= 1;
        self.line(&format!("</{tag}>"));
    }

    /// An element around lines that begin one deeper.
    pub fn around(&mut self, tag: &str, content: Lines) {
        self.open(Element::new(tag));
        self.append(content);
        self.close(tag);
    }

    /// The same; nothing without lines.
    pub fn section(&mut self, tag: &str, content: Lines) {
        if !content.is_empty() {
            self.around(tag, content);
        }
    }

    /// Other lines, at their own depth.
    pub fn append(&mut self, lines: Lines) {
        self.out += &lines.out;
    }

    /// A comment. XML allows no two hyphens in a row in it.
    pub fn comment(&mut self, text: &str) {
        self.line(&format!("<!-- {} -->", text.replace("--", "- -")));
    }

    /// A fixed tendon: the sum of its joints' angles, each times its moment arm.
    pub fn fixed(&mut self, tendon: Element, arms: impl IntoIterator<Item = (impl AsRef<str>, f64)>) {
        self.open(tendon);
        for (joint, arm) in arms {
            self.leaf(Element::new("joint").text("joint", joint.as_ref()).number("coef", arm));
        }
        self.close("fixed");
    }

    fn line(&mut self, text: &str) {
        let _ = writeln!(self.out, "{:width$}{text}", "", width = 2 * self.depth);
    }
}

/// The begin of an element, with its attributes.
#[derive(Clone, Debug)]
pub struct Element(String);

impl Element {
    /// An element without attributes.
    pub fn new(tag: &str) -> Self {
        Element(format!("<{tag}"))
    }

    /// An attribute.
    pub fn text(mut self, name: &str, value: &str) -> Self {
        let _ = write!(self.0, " {name}=\"{}\"", escaped(value));
        self
    }

    /// An attribute of one number.
    pub fn number(self, name: &str, value: f64) -> Self {
        self.numbers(name, [value])
    }

    /// An attribute of numbers, each with the digits that give its bits again.
    pub fn numbers(self, name: &str, values: impl IntoIterator<Item = f64>) -> Self {
        let values: Vec<String> = values.into_iter().map(|value| format!("{value:?}")).collect();
        self.text(name, &values.join(" "))
    }

    /// An attribute of a vector.
    pub fn vector(self, name: &str, value: Vec3) -> Self {
        self.numbers(name, value.to_array())
    }

    /// A blank, and attributes as they are written.
    pub fn attributes(mut self, written: &str) -> Self {
        let _ = write!(self.0, " {written}");
        self
    }

    /// `pos` and `quat`, each where it is not the default.
    pub fn pose(self, pose: &Pose) -> Self {
        let moved = if pose.translation == Vec3::ZERO { self } else { self.vector("pos", pose.translation) };
        if pose.rotation == Rotation::IDENTITY { moved } else { moved.quat(pose.rotation) }
    }

    /// `pos` and `quat`.
    pub fn whole_pose(self, pose: &Pose) -> Self {
        self.vector("pos", pose.translation).quat(pose.rotation)
    }

    fn quat(self, q: Rotation) -> Self {
        self.numbers("quat", [q.w, q.x, q.y, q.z])
    }

    /// Mass, centre of mass and inertia of a body.
    pub fn inertial(inertia: &Inertia) -> Self {
        let (x, y, z) = (inertia.about_com.x_axis, inertia.about_com.y_axis, inertia.about_com.z_axis);
        Element::new("inertial")
            .vector("pos", inertia.com)
            .number("mass", inertia.mass)
            .numbers("fullinertia", [x.x, y.y, z.z, x.y, x.z, y.z])
    }

    /// A geom of a type, with its `size`: half lengths and radii.
    pub fn geom(kind: &str, size: impl IntoIterator<Item = f64>) -> Self {
        Element::new("geom").text("type", kind).numbers("size", size)
    }

    /// A geom of a mesh in `<asset>`.
    pub fn geom_of_mesh(mesh: &str) -> Self {
        Element::new("geom").text("type", "mesh").text("mesh", mesh)
    }

    /// A plane through the origin of its pose, with its normal along z.
    pub fn plane() -> Self {
        Element::new("geom").text("type", "plane").text("size", "0 0 1")
    }

    /// A geom of a shape; boxes are sharp, and `hull` makes that of points and a rounding.
    pub fn geom_of_shape(shape: &Shape, hull: impl FnOnce(&[[f64; 3]], f64) -> Element) -> Self {
        match shape {
            Shape::Sphere { radius } => Element::geom("sphere", [*radius]),
            Shape::Capsule { radius, half_length } => Element::geom("capsule", [*radius, *half_length]),
            Shape::Cylinder { radius, half_length } => Element::geom("cylinder", [*radius, *half_length]),
            Shape::Box { half_extents, .. } => Element::geom("box", *half_extents),
            Shape::Hull { points, rounding } => hull(points, *rounding),
        }
    }

    /// `vertex` of a mesh: the hull of points, each with a ball of this radius about it: 26 corners.
    pub fn hull(self, points: &[[f64; 3]], rounding: f64) -> Self {
        let about = |k: usize| Vec3::new((k % 3) as f64, (k / 3 % 3) as f64, (k / 9) as f64) - Vec3::ONE;
        let directions: Vec<Vec3> = match rounding {
            // Minus zero keeps the sign of every zero.
            0.0 => vec![Vec3::splat(-0.0)],
            _ => (0..27).filter(|k| *k != 13).map(|k| about(k).normalize() * rounding).collect(),
        };
        let corners = points.iter().flat_map(|point| {
            directions.iter().flat_map(|direction| (Vec3::from_array(*point) + *direction).to_array())
        });
        self.text("vertex", &corners.map(|x| format!("{x:?} ")).collect::<String>())
    }

    /// An equality of two joints: the first is a polynomial, `polycoef`, of the second.
    pub fn coupling(joint: &str, leader: &str) -> Self {
        Element::new("joint").text("joint1", joint).text("joint2", leader)
    }

    /// Two bodies that never touch.
    pub fn exclude(a: &str, b: &str) -> Self {
        Element::new("exclude").text("body1", a).text("body2", b)
    }
}

fn escaped(text: &str) -> String {
    text.replace('&', "&amp;").replace('<', "&lt;").replace('>', "&gt;").replace('"', "&quot;")
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn elements_are_indented_and_their_texts_escaped() {
        let mut lines = Lines::at(1);
        lines.open(Element::new("body").text("name", "a<\"&").pose(&Pose::IDENTITY));
        lines.comment("one--two");
        lines.leaf(Element::geom("box", [0.1, 2.0, 1e-7]).pose(&Pose::translation(0.0, 0.5, 0.0)));
        lines.close("body");
        lines.section("asset", Lines::at(2));
        let text = "  <body name=\"a&lt;&quot;&amp;\">\n    <!-- one- -two -->\n    \
                    <geom type=\"box\" size=\"0.1 2.0 1e-7\" pos=\"0.0 0.5 0.0\"/>\n  </body>\n";
        assert_eq!(lines.into_text(), text);
        let mut one = Lines::at(3);
        one.around("asset", Lines::default());
        one.leaf(Element::new("mesh").text("name", "a\"'"));
        assert_eq!(one.into_one_line(), "<asset></asset><mesh name='a&quot;&apos;'/>");
    }

    #[test]
    fn a_rounded_hull_reaches_its_rounding_beyond_every_point() {
        let Element(text) = Element::new("mesh").hull(&[[1.0, 0.0, 0.0]], 0.5);
        let numbers = text.split('"').nth(1).expect("vertices");
        let numbers: Vec<f64> = numbers.split_whitespace().map(|x| x.parse().expect("a number")).collect();
        assert_eq!(numbers.len(), 26 * 3);
        for corner in numbers.as_chunks::<3>().0 {
            let way = Vec3::from_array(*corner) - Vec3::X;
            assert!((way.length() - 0.5).abs() < 1e-15, "{corner:?}");
        }
        let Element(sharp) = Element::new("mesh").hull(&[[1.0, -0.0, 0.0]], 0.0);
        assert!(sharp.ends_with("vertex=\"1.0 -0.0 0.0 \""), "{sharp}");
    }
}
