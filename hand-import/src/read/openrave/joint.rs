//! `<Joint>`: hinges, slides and balls between two bodies.

use std::f64::consts::PI;

use palmares_models::Vec3;

use super::super::element::{Element, Notes};
use super::super::reading::Reading;
use super::equation;
use super::model::{Hinge, Model};
use super::text::{attribute, child, is_tag, list, vector};
use crate::decision::At;
use crate::draft::JointKind;
use crate::numbers::numbers;

/// Keywords for planners, and of motors that a hand has not.
const PLANNED: [&str; 8] =
    ["weight", "resolution", "maxaccel", "maxacceldeg", "maxinertia", "hardmaxvel", "initial", "actuator"];

impl Model {
    pub(super) fn joint(&mut self, element: &Element, prefix: &str, reading: &mut Reading<'_>) {
        let stated = attribute(element, "name").map(str::to_owned);
        let name = format!("{prefix}{}", stated.unwrap_or_else(|| format!("joint_{}", self.joints.len())));
        self.unscaled(element, reading);
        let named = element.children.iter().filter(|child| is_tag(child, "body"));
        let bodies: Vec<Option<usize>> = named
            .map(|child| self.find(&format!("{prefix}{}", child.text)).or_else(|| self.find(&child.text)))
            .collect();
        let [Some(first), Some(second)] = bodies.as_slice() else {
            let text = "does not name two bodies that are there before it; it is left out";
            return reading.log.bad(element, text);
        };
        let kind = attribute(element, "type").unwrap_or("hinge").to_ascii_lowercase();
        let mut turned = match kind.as_str() {
            "slider" => JointKind::Prismatic,
            "spherical" => JointKind::Ball,
            "hinge" => JointKind::Revolute,
            _ => {
                let text = format!(
                    "is of type '{kind}'; valid: hinge, slider, spherical; its bodies are fixed to each other"
                );
                reading.log.bad(element, text);
                JointKind::Fixed
            }
        };
        let slides = turned == JointKind::Prismatic;
        let (limits, reversed) = limits(element, slides, reading);
        let circular = attribute(element, "circular").is_some_and(is_true);
        if turned == JointKind::Revolute && circular {
            turned = JointKind::Continuous;
        }
        // OpenRAVE's own limits where none are stated.
        let limits = limits.unwrap_or(if slides { [-10.0, 10.0] } else { [-PI, PI] });
        if limits[0] == limits[1] && turned != JointKind::Ball {
            turned = JointKind::Fixed;
        }
        let frame = child(element, "offsetfrom").and_then(|from| {
            let found = self.find(&format!("{prefix}{}", from.text)).or_else(|| self.find(&from.text));
            if found.is_none() {
                reading
                    .log
                    .bad(from, format!("names the body '{}', which is not there before it", from.text));
            }
            found.map(|k| self.bodies[k].pose)
        });
        let frame = frame.unwrap_or(palmares_models::Pose::IDENTITY);
        let anchor =
            child(element, "anchor").and_then(|anchor| vector(anchor, reading)).unwrap_or(Vec3::ZERO);
        let axis = child(element, "axis").and_then(|axis| vector(axis, reading)?.try_normalize());
        let axis = axis.unwrap_or(Vec3::Z) * if reversed { -1.0 } else { 1.0 };
        let mut number =
            |tag: &str| child(element, tag).and_then(|child| list::<1>(child, reading)).map(|[x]| x);
        let speed = number("maxvel").or(number("maxveldeg").map(|x| if slides { x } else { x.to_radians() }));
        let effort = number("maxtorque");
        for tag in PLANNED.into_iter().filter(|tag| child(element, tag).is_some()) {
            reading.log.dropped(At::Hand, format!("<{tag}>"), "is for planners, or of a motor's inside");
        }
        let follows = self.follows(element, prefix, reading);
        self.joints.push(Hinge {
            name,
            kind: turned,
            bodies: [*first, *second],
            anchor: frame * anchor,
            axis: frame.rotation * axis,
            limits: Some(limits).filter(|_| matches!(turned, JointKind::Revolute | JointKind::Prismatic)),
            velocity: speed.filter(|x| *x > 0.0),
            effort: effort.filter(|x| *x > 0.0),
            active: attribute(element, "enable").is_none_or(is_true),
            follows,
        });
    }

    /// `mimic_pos`, an equation of another joint's value; or the older `mimic`, with multiplier and constant.
    fn follows(
        &self,
        element: &Element,
        prefix: &str,
        reading: &mut Reading<'_>,
    ) -> Option<(String, [f64; 2])> {
        if let Some(text) = attribute(element, "mimic") {
            let mut words = text.split_whitespace();
            let leader = format!("{prefix}{}", words.next()?);
            let found = numbers(&words.collect::<Vec<_>>().join(" ")).unwrap_or_default();
            return Some((
                leader,
                [found.get(1).copied().unwrap_or(0.0), found.first().copied().unwrap_or(1.0)],
            ));
        }
        let text = attribute(element, "mimic_pos")?;
        match equation::line(text) {
            Ok((leader, line)) => Some((format!("{prefix}{leader}"), line)),
            Err(problem) => {
                reading
                    .log
                    .bad(element, format!("mimic_pos is '{text}', which {problem}; it moves by itself"));
                None
            }
        }
    }
}

fn is_true(text: &str) -> bool {
    !(text.eq_ignore_ascii_case("false") || text == "0")
}

/// Lowest and highest value, and whether the axis is reversed, as the older `lostop` and `histop` have it.
fn limits(element: &Element, slides: bool, reading: &mut Reading<'_>) -> (Option<[f64; 2]>, bool) {
    let degrees = |x: f64| if slides { x } else { x.to_radians() };
    for tag in ["limits", "limitsrad", "limitsdeg"] {
        let Some(stated) = child(element, tag) else { continue };
        let found = list::<2>(stated, reading);
        let found = found.map(|list| if tag == "limitsdeg" { list.map(degrees) } else { list });
        return (found.map(|[a, b]| [a.min(b), a.max(b)]), false);
    }
    let mut stop =
        |tag: &str| child(element, tag).and_then(|stop| list::<1>(stop, reading)).map(|[x]| degrees(x));
    let (low, high) = (stop("lostop"), stop("histop"));
    (low.zip(high).map(|(low, high)| [low.min(high), low.max(high)]), low.is_some() || high.is_some())
}
