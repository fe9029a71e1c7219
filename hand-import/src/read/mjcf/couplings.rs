//! Couplings that tendons make: an equality of tendons, and a fixed tendon whose range is so narrow that it binds its joints.
//!
//! Both are a row `Σ w x = c` over joint positions x. A row of two joints is an equality of these: one follows the other, exactly.
//! A row of more becomes a stiff tendon that pulls both ways.

use super::compile::Reader;
use super::defaults::Attributes;
use super::model::{ActuatorTarget, Equality, JointKind, Law, Model, Path, Row};
use crate::decision::At;
use crate::read::element::{Element, Notes};

/// A range below this part of what a tendon's length can change by binds its joints.
const NARROW: f64 = 0.25;
/// Range of a joint without limits, rad or m.
const UNLIMITED: f64 = 3.0;

impl Reader<'_> {
    /// `<equality><tendon>`: the length of the first, from that at the start, is a polynomial of the second's.
    pub(super) fn tendon_law(&mut self, element: &Element, at: &Attributes<'_>) -> Option<Law> {
        let tendon = |model: &Model, name: &str| model.tendons.iter().position(|tendon| tendon.name == name);
        let first = self.named(element, "tendon1", tendon)?;
        let second = match element.get("tendon2") {
            Some(_) => Some(self.named(element, "tendon2", tendon)?),
            None => None,
        };
        let polynomial = self.polynomial(at);
        let arms = |tendon: usize| match &self.model.tendons[tendon].path {
            Path::Fixed(joints) => {
                Some(joints.iter().filter(|(_, w)| *w != 0.0).copied().collect::<Vec<_>>())
            }
            Path::Spatial(_) => None,
        };
        let (Some(own), Some(other)) = (arms(first), second.map_or(Some(Vec::new()), arms)) else {
            let text = "couples a spatial tendon, which no hand has; the joints of both move by themselves";
            self.log.bad(element, text);
            return None;
        };
        let curved = second.is_some() && polynomial[2..].iter().any(|c| *c != 0.0);
        match (own.as_slice(), other.as_slice()) {
            (&[(joint, w)], &[(leader, v)]) if curved => {
                let mut power = 1.0;
                let mut coefficients = polynomial;
                for c in &mut coefficients {
                    *c *= power / w;
                    power *= v;
                }
                return Some(Law::Joint(joint, Some(leader), coefficients));
            }
            _ if curved => {
                let text = "couples sums of joints by a curve, which no hand has; taken is its line";
                self.log.bad(element, text);
            }
            _ => {}
        }
        let slope = if second.is_some() { polynomial[1] } else { 0.0 };
        let mut terms = own;
        for (joint, v) in other {
            match terms.iter_mut().find(|(known, _)| *known == joint) {
                Some((_, w)) => *w -= slope * v,
                None => terms.push((joint, -slope * v)),
            }
        }
        let name = element
            .get("name")
            .map_or_else(|| format!("{}_row", self.model.tendons[first].name), str::to_owned);
        self.bind(Row { name, terms, sum: polynomial[0], element: element.clone() })
    }

    /// Fixed tendons with a narrow range.
    pub(super) fn narrow_ranges(&mut self) {
        for index in 0..self.model.tendons.len() {
            let tendon = self.model.tendons[index].clone();
            let (Path::Fixed(joints), Some([low, high])) = (&tendon.path, tendon.range) else { continue };
            let width =
                |joint: usize| self.model.joints[joint].range.map_or(UNLIMITED, |[low, high]| high - low);
            let stroke: f64 = joints.iter().map(|&(joint, w)| w.abs() * width(joint)).sum();
            if joints.len() < 2 || high < low || high - low > NARROW * stroke {
                continue;
            }
            self.model.tendons[index].range = None;
            let reference: f64 =
                joints.iter().map(|&(joint, w)| w * self.model.joints[joint].reference).sum();
            let sum = 0.5 * (low + high) - reference;
            let name = format!("{}_row", tendon.name);
            let row = Row { name: name.clone(), terms: joints.clone(), sum, element: tendon.element.clone() };
            let largest = joints.iter().map(|(_, w)| w.abs()).fold(0.0, f64::max);
            let text = format!(
                "its range {low} to {high} binds its joints, within {:.3}; here they are bound without play",
                0.5 * (high - low) / largest
            );
            self.log.chose(At::Hand, &tendon.element, text);
            if let Some(law) = self.bind(row) {
                self.model.equalities.push(Equality { name, law, element: tendon.element });
            }
        }
    }

    /// A row of one or two joints as their equality; others are kept as rows.
    fn bind(&mut self, row: Row) -> Option<Law> {
        let mut terms = row.terms.clone();
        terms.retain(|(_, w)| *w != 0.0);
        let hinged =
            |joint: usize| matches!(self.model.joints[joint].kind, JointKind::Hinge | JointKind::Slide);
        if !terms.iter().all(|(joint, _)| hinged(*joint)) {
            self.log.bad(&row.element, "couples a ball or a free joint, which no hand has; it is left out");
            return None;
        }
        match *terms.as_slice() {
            [] => return None,
            [(joint, w)] => return Some(Law::Joint(joint, None, [row.sum / w, 0.0, 0.0, 0.0, 0.0])),
            [first, second] => {
                // The joint that has a motor leads, else the one nearer to the base.
                let mut pair = [first, second];
                pair.sort_by_key(|(joint, _)| (!self.is_driven(*joint), *joint));
                let free = |[(leader, _), (follower, _)]: &[(usize, f64); 2]| {
                    !self.follows(*follower) && self.last_leader(*leader) != *follower
                };
                if let Some([(leader, v), (joint, w)]) = [pair, [pair[1], pair[0]]].into_iter().find(free) {
                    return Some(Law::Joint(joint, Some(leader), [row.sum / w, -v / w, 0.0, 0.0, 0.0]));
                }
            }
            _ => {}
        }
        self.model.rows.push(Row { terms, ..row });
        None
    }

    fn is_driven(&self, joint: usize) -> bool {
        self.model.actuators.iter().any(|actuator| match actuator.target {
            ActuatorTarget::Joint(driven) => driven == joint,
            ActuatorTarget::Tendon(tendon) => match &self.model.tendons[tendon].path {
                Path::Fixed(joints) => joints.iter().any(|(driven, _)| *driven == joint),
                Path::Spatial(_) => false,
            },
        })
    }

    /// The joint that an equality makes this one follow.
    fn leader(&self, joint: usize) -> Option<usize> {
        self.model.equalities.iter().find_map(|equality| match equality.law {
            Law::Joint(follower, leader, _) if follower == joint => leader,
            _ => None,
        })
    }

    fn follows(&self, joint: usize) -> bool {
        let held = |law: &Law| matches!(law, Law::Joint(follower, _, _) if *follower == joint);
        self.model.equalities.iter().any(|equality| held(&equality.law))
    }

    fn last_leader(&self, joint: usize) -> usize {
        let mut at = joint;
        for _ in 0..self.model.joints.len() {
            match self.leader(at) {
                Some(next) => at = next,
                None => break,
            }
        }
        at
    }
}
