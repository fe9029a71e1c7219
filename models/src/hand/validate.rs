//! Checks of a hand before anything computes with it.

use std::collections::BTreeSet;

use super::load::slowed_without_own_tendon;
use super::tendon::MAX_EXPONENT;
use super::{Guide, Hand, Link, Motor, Pad, PadOn, Spring, Start, Tendon};
use crate::error::ModelError;
use crate::shape::validate::{not_negative, positive};

impl Hand {
    /// Checks that indices are in range, numbers are finite and signs are right. Loaded hands are valid.
    ///
    /// # Errors
    /// The first contradiction, with its element.
    pub fn validate(&self) -> Result<(), ModelError> {
        let bad = |element: String, problem: String| {
            Err(ModelError::Inconsistent { name: self.name.clone(), element, problem })
        };
        let mut names = BTreeSet::new();
        for (i, link) in self.links.iter().enumerate() {
            if !names.insert(&link.name) {
                return bad(format!("link '{}'", link.name), "appears twice".to_owned());
            }
            if let Err(problem) = self.check_link(i, link) {
                return bad(format!("link '{}'", link.name), problem);
            }
        }
        if self.links.is_empty() {
            return bad("links".to_owned(), "there are none; a hand has at least its base".to_owned());
        }
        for PadOn { link, geom, pad: Pad { thickness, modulus } } in &self.pads {
            if self.links.get(*link).is_none_or(|link| *geom >= link.geoms.len()) {
                return bad("pads".to_owned(), format!("shape {geom} of link {link} is not there"));
            }
            if !positive(*modulus) || thickness.is_some_and(|thickness| !positive(thickness)) {
                return bad("pads".to_owned(), "a thickness or modulus is not more than 0".to_owned());
            }
        }
        for (i, c) in self.coordinates.iter().enumerate() {
            let element = format!("coordinate '{}'", c.name);
            if self.coordinates[..i].iter().any(|other| other.name == c.name) {
                return bad(element, "appears twice".to_owned());
            }
            if !(c.lower < c.upper && c.rest.is_finite()) {
                return bad(element, format!("limits {} to {}, rest {}", c.lower, c.upper, c.rest));
            }
            for (what, value) in
                [("stiffness", c.stiffness), ("damping", c.damping), ("friction", c.friction)]
            {
                if !not_negative(value) {
                    return bad(element, format!("{what} {value}; valid: finite, at least 0"));
                }
            }
            if !self.links.iter().any(|l| l.joint.as_ref().is_some_and(|j| j.coordinate == i)) {
                return bad(element, "moves no link".to_owned());
            }
        }
        for motor in &self.motors {
            let Motor { scaling, offset, speed_limit, stall_force, power_limit, .. } = motor;
            let not_positive = |limit: &Option<f64>| limit.is_some_and(|limit| !positive(limit));
            let problem = if !scaling.is_finite() || *scaling == 0.0 {
                format!("scaling {scaling}; valid: finite, other than 0")
            } else if !offset.is_finite() {
                format!("offset {offset}; valid: finite")
            } else if !positive(*speed_limit) {
                format!("speed limit {speed_limit}; valid: finite, more than 0")
            } else if not_positive(stall_force) || not_positive(power_limit) {
                format!(
                    "stall force {stall_force:?}, power limit {power_limit:?}; valid: finite, more than 0"
                )
            } else {
                continue;
            };
            return bad(format!("motor '{}'", motor.name), problem);
        }
        if let Some(motor) = slowed_without_own_tendon(&self.motors, &self.tendons) {
            let problem =
                "has a stall force or a power limit; valid: with one tendon of its own, without a clutch";
            return bad(format!("motor '{}'", motor.name), problem.to_owned());
        }
        let Start { sigma, q } = &self.start;
        let lists = [(sigma, self.motors.len()), (q, self.coordinates.len())];
        let whole = |(list, len): &(&Vec<f64>, usize)| {
            (list.is_empty() || list.len() == *len) && list.iter().all(|x| x.is_finite())
        };
        if !lists.iter().all(whole) || !sigma.iter().all(|sigma| (0.0..=1.0).contains(sigma)) {
            return bad("start".to_owned(), "needs σ of every motor from 0 to 1, and every joint".to_owned());
        }
        for tendon in &self.tendons {
            let element = format!("tendon '{}'", tendon.name);
            if let Some((motor, _)) = tendon.motors.iter().find(|entry| entry.0 >= self.motors.len()) {
                return bad(element, format!("names motor {motor}, there are {}", self.motors.len()));
            }
            let weights = tendon.motors.iter().all(|&(_, w)| w.is_finite() && w != 0.0);
            if !weights || !tendon.motors.windows(2).all(|w| w[0].0 < w[1].0) || !tendon.rest.is_finite() {
                return bad(element, "its motors must ascend, with finite weights other than 0".to_owned());
            }
            let ascending = tendon.moment_arms.windows(2).all(|w| w[0].0 < w[1].0);
            let inside = tendon.moment_arms.iter().all(|&(i, r)| i < self.coordinates.len() && r.is_finite());
            if (tendon.moment_arms.is_empty() && tendon.elements.is_empty()) || !ascending || !inside {
                return bad(
                    element,
                    "moment arms must be finite, ascending by coordinate, at least one".to_owned(),
                );
            }
            for (k, part) in tendon.elements.iter().enumerate() {
                let again = tendon.elements[..k].iter().any(|other| other.coordinate == part.coordinate);
                if part.coordinate >= self.coordinates.len() || again {
                    return bad(element, "elements must each have a coordinate of their own".to_owned());
                }
            }
            for (what, value) in [("stiffness", tendon.stiffness), ("force limit", tendon.force_limit)] {
                if !positive(value) {
                    return bad(element, format!("{what} {value}; valid: finite, more than 0"));
                }
            }
            if let Some(hold) = tendon.hold_limit
                && !(hold.is_finite() && hold >= tendon.force_limit)
            {
                return bad(element, format!("hold limit {hold}; valid: finite, at least the force limit"));
            }
            if tendon.breakaway && tendon.hold_limit.is_none() {
                return bad(element, "has a clutch, but no hold limit with which it stays locked".to_owned());
            }
            if !not_negative(tendon.damping) {
                return bad(element, format!("damping {}; valid: finite, at least 0", tendon.damping));
            }
            if let Err(problem) = check_guides(tendon) {
                return bad(element, problem);
            }
        }
        for (i, spring) in self.springs.iter().enumerate() {
            let ascending = spring.arms.windows(2).all(|w| w[0].0 < w[1].0);
            let inside =
                spring.arms.iter().all(|&(c, r)| c < self.coordinates.len() && r.is_finite() && r != 0.0);
            let problem = if self.springs[..i].iter().any(|other| other.name == spring.name) {
                "appears twice".to_owned()
            } else if spring.arms.is_empty() || !ascending || !inside {
                "its entries must be finite, other than 0, ascending by coordinate, at least one".to_owned()
            } else if !not_negative(spring.stiffness)
                || !not_negative(spring.damping)
                || !spring.rest.is_finite()
            {
                let Spring { stiffness, damping, rest, .. } = spring;
                format!(
                    "stiffness {stiffness}, damping {damping}, rest {rest}; valid: finite, the first two at least 0"
                )
            } else {
                continue;
            };
            return bad(format!("spring '{}'", spring.name), problem);
        }
        for (i, pin) in self.linkages.iter().enumerate() {
            let [a, b] = pin.links;
            let problem = if self.linkages[..i].iter().any(|other| other.name == pin.name) {
                "appears twice".to_owned()
            } else if a.max(b) >= self.links.len() || a == b {
                "does not join two links".to_owned()
            } else if !pin.points.iter().all(|p| p.is_finite()) {
                "a point is not finite".to_owned()
            } else if !positive(pin.stiffness) || !not_negative(pin.damping) {
                format!(
                    "stiffness {}, damping {}; valid: finite, more than 0 and at least 0",
                    pin.stiffness, pin.damping
                )
            } else {
                continue;
            };
            return bad(format!("linkage '{}'", pin.name), problem);
        }
        for &[a, b] in &self.no_collision {
            if a >= b || b >= self.links.len() {
                return bad(
                    format!("no_collision [{a}, {b}]"),
                    "not a pair of links, lower first".to_owned(),
                );
            }
        }
        for (i, patch) in self.tactile.iter().enumerate() {
            let problem = if patch.link >= self.links.len() {
                format!("lies on link {}, there are {}", patch.link, self.links.len())
            } else if self.tactile[..i].iter().any(|other| other.name == patch.name) {
                "appears twice".to_owned()
            } else if patch.is_empty() {
                "has no taxels".to_owned()
            } else if !patch.link_from_patch.is_finite() || !patch.half_size.iter().all(|&x| positive(x)) {
                "its pose must be finite, its size positive".to_owned()
            } else {
                continue;
            };
            return bad(format!("tactile patch '{}'", patch.name), problem);
        }
        let known = |link: &str| self.link(link).is_some();
        let on_links = self.sensors.cameras.iter().map(|camera| camera.link.as_deref().unwrap_or_default());
        let accelerometer = self.sensors.accelerometer.iter().map(|sensor| sensor.link.as_str());
        if let Some(link) = on_links.chain(accelerometer).find(|link| !known(link)) {
            return bad("sensors".to_owned(), format!("one sits on link '{link}', which there is not"));
        }
        if let Some(encoders) = &self.sensors.joints
            && let Some(name) = encoders.on.iter().find(|name| self.coordinate(name).is_none())
        {
            let known: Vec<&str> = self.coordinates.iter().map(|c| c.name.as_str()).collect();
            let problem = format!("names '{name}'; valid: {}", known.join(", "));
            return bad("sensors.joints.on".to_owned(), problem);
        }
        Ok(())
    }

    fn check_link(&self, i: usize, link: &Link) -> Result<(), String> {
        match (&link.parent, &link.joint) {
            (None, None) if i == 0 => {
                if !positive(link.inertia.mass) {
                    return Err("is the base, which flies, but has no mass".to_owned());
                }
            }
            (Some(parent), Some(joint)) if *parent < i => {
                if !matches!(joint.hinges.len(), 1 | 2) {
                    return Err(format!(
                        "joint '{}' has {} hinges, not 1 or 2",
                        joint.name,
                        joint.hinges.len()
                    ));
                }
                if joint.coordinate >= self.coordinates.len() {
                    return Err(format!("joint '{}' names coordinate {}", joint.name, joint.coordinate));
                }
                for hinge in &joint.hinges {
                    let finite = hinge.parent_from_hinge.is_finite() && hinge.offset.is_finite();
                    if !finite || !hinge.ratio.is_finite() || (hinge.axis.length() - 1.0).abs() > 1e-9 {
                        return Err(format!(
                            "joint '{}' is not finite or its axis no unit vector",
                            joint.name
                        ));
                    }
                }
                if !positive(link.inertia.mass) {
                    return Err("moves but has no mass".to_owned());
                }
            }
            _ => return Err("a link but the base has a joint and a parent that stands before it".to_owned()),
        }
        if !not_negative(link.inertia.mass)
            || !link.inertia.com.is_finite()
            || !link.inertia.about_com.is_finite()
        {
            return Err("its inertia is not finite".to_owned());
        }
        for geom in &link.geoms {
            geom.shape.validate()?;
            if !geom.link_from_geom.is_finite() || !not_negative(geom.friction) {
                return Err("a shape's pose is not finite or its friction negative".to_owned());
            }
        }
        Ok(())
    }
}

/// Checks the guides of a tendon: one at each of its coordinates, or none.
fn check_guides(tendon: &Tendon) -> Result<(), String> {
    let guides = &tendon.guides;
    if guides.is_empty() {
        return Ok(());
    }
    let mut passed: Vec<usize> = guides.iter().map(|guide| guide.coordinate).collect();
    passed.sort_unstable();
    if tendon.both_ways {
        return Err("rubs on guides, but pushes as well as pulls; valid: a cable".to_owned());
    }
    if passed != tendon.coordinates() {
        return Err("its guides must be one at each of its coordinates".to_owned());
    }
    if !guides.iter().all(|guide| not_negative(guide.friction) && not_negative(guide.wrap_angle)) {
        return Err("a guide's friction or wrap angle is not finite or less than 0".to_owned());
    }
    let sum: f64 = guides.iter().map(Guide::exponent).sum();
    if sum > MAX_EXPONENT {
        return Err(format!("its friction times wrap angle sum up to {sum}; valid: at most {MAX_EXPONENT}"));
    }
    Ok(())
}
