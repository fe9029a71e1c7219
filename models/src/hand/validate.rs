//! Checks of a hand before anything computes with it.

use super::load::{NO_OWN_TENDON, slowed_without_own_tendon};
use super::number::Numbers;
use super::tendon::MAX_EXPONENT;
use super::{Coordinate, Guide, Hand, Link, Linkage, Motor, Pad, PadOn, Spring, Start, TactilePatch, Tendon};
use crate::error::ModelError;
use crate::shape::validate::{not_negative, positive};

/// The problem with a part, if there is one.
type Checked = Result<(), String>;

impl Hand {
    /// Checks that indices are in range, numbers are finite and signs are right. Loaded hands are valid.
    ///
    /// # Errors
    /// The first contradiction, with its element.
    pub fn validate(&self) -> Result<(), ModelError> {
        self.checked("link", &self.links, |link| &link.name, Hand::check_link)?;
        self.checked("links", &[()], |()| "", |_, ()| self.check_number_of_links())?;
        self.checked("pads", &self.pads, |_| "", Hand::check_pad)?;
        self.checked("coordinate", &self.coordinates, |c| &c.name, Hand::check_coordinate)?;
        self.checked("motor", &self.motors, |motor| &motor.name, Hand::check_motor)?;
        self.checked("start", &[&self.start], |_| "", |hand, start| hand.check_start(start))?;
        self.checked("tendon", &self.tendons, |tendon| &tendon.name, Hand::check_tendon)?;
        self.checked("spring", &self.springs, |spring| &spring.name, Hand::check_spring)?;
        self.checked("linkage", &self.linkages, |pin| &pin.name, Hand::check_linkage)?;
        self.checked("no_collision", &self.no_collision, |_| "", Hand::check_pair)?;
        self.checked("tactile patch", &self.tactile, |patch| &patch.name, Hand::check_patch)?;
        self.checked("sensors", &[&self.sensors], |_| "", |hand, _| hand.check_sensors())
    }

    /// The first problem with parts of one kind, with the part's name if it has one.
    fn checked<T>(
        &self,
        kind: &str,
        parts: &[T],
        name: impl Fn(&T) -> &str,
        check: impl Fn(&Hand, &T) -> Checked,
    ) -> Result<(), ModelError> {
        for part in parts {
            check(self, part).map_err(|problem| {
                let element = match name(part) {
                    "" => kind.to_owned(),
                    name => format!("{kind} '{name}'"),
                };
                ModelError::Inconsistent { name: self.name.clone(), element, problem }
            })?;
        }
        Ok(())
    }

    fn check_number_of_links(&self) -> Checked {
        ensure(!self.links.is_empty(), || "there are none; a hand has at least its base".to_owned())
    }

    fn check_pad(&self, pad: &PadOn) -> Checked {
        let PadOn { link, geom, pad: Pad { thickness, modulus } } = pad;
        let there = self.links.get(*link).is_some_and(|link| *geom < link.geoms.len());
        ensure(there, || format!("shape {geom} of link {link} is not there"))?;
        let sound = positive(*modulus) && thickness.is_none_or(positive);
        ensure(sound, || "a thickness or modulus is not more than 0".to_owned())
    }

    fn check_coordinate(&self, c: &Coordinate) -> Checked {
        once(&self.coordinates, |other| other.name == c.name)?;
        ensure(c.lower < c.upper, || format!("limits {} to {}", c.lower, c.upper))?;
        c.numbers.check()?;
        let own = self.coordinate(&c.name);
        let moved = |link: &Link| link.joint.as_ref().is_some_and(|joint| Some(joint.coordinate) == own);
        ensure(self.links.iter().any(moved), || "moves no link".to_owned())
    }

    fn check_motor(&self, motor: &Motor) -> Checked {
        motor.numbers.check()?;
        let shared = slowed_without_own_tendon(&self.motors, &self.tendons);
        let own = shared.is_none_or(|shared| !std::ptr::eq(shared, motor));
        ensure(own, || format!("{}; valid: {}", NO_OWN_TENDON.0, NO_OWN_TENDON.1))
    }

    fn check_start(&self, Start { sigma, q }: &Start) -> Checked {
        let lists = [(sigma, self.motors.len()), (q, self.coordinates.len())];
        let whole = |(list, len): &(&Vec<f64>, usize)| {
            (list.is_empty() || list.len() == *len) && list.iter().all(|x| x.is_finite())
        };
        let sound = lists.iter().all(whole) && sigma.iter().all(|sigma| (0.0..=1.0).contains(sigma));
        ensure(sound, || "needs σ of every motor from 0 to 1, and every joint".to_owned())
    }

    fn check_tendon(&self, tendon: &Tendon) -> Checked {
        if let Some((motor, _)) = tendon.motors.iter().find(|entry| entry.0 >= self.motors.len()) {
            return Err(format!("names motor {motor}, there are {}", self.motors.len()));
        }
        let weighted = tendon.motors.iter().all(|&(_, w)| w.is_finite() && w != 0.0);
        ensure(weighted && ascending(&tendon.motors), || {
            "its motors must ascend, with finite weights other than 0".to_owned()
        })?;
        let inside = tendon.moment_arms.iter().all(|&(i, r)| i < self.coordinates.len() && r.is_finite());
        let some = !tendon.moment_arms.is_empty() || !tendon.elements.is_empty();
        ensure(some && ascending(&tendon.moment_arms) && inside, || {
            "moment arms must be finite, ascending by coordinate, at least one".to_owned()
        })?;
        for (k, part) in tendon.elements.iter().enumerate() {
            let again = tendon.elements[..k].iter().any(|other| other.coordinate == part.coordinate);
            ensure(part.coordinate < self.coordinates.len() && !again, || {
                "elements must each have a coordinate of their own".to_owned()
            })?;
        }
        tendon.numbers.check()?;
        if let Some((problem, valid)) = tendon.contradiction() {
            return Err(format!("{problem}; valid: {valid}"));
        }
        check_guides(tendon)
    }

    fn check_spring(&self, spring: &Spring) -> Checked {
        once(&self.springs, |other| other.name == spring.name)?;
        let count = self.coordinates.len();
        let inside = spring.arms.iter().all(|&(c, r)| c < count && r.is_finite() && r != 0.0);
        ensure(!spring.arms.is_empty() && ascending(&spring.arms) && inside, || {
            "its entries must be finite, other than 0, ascending by coordinate, at least one".to_owned()
        })?;
        spring.numbers.check()
    }

    fn check_linkage(&self, pin: &Linkage) -> Checked {
        once(&self.linkages, |other| other.name == pin.name)?;
        let [a, b] = pin.links;
        ensure(a.max(b) < self.links.len() && a != b, || "does not join two links".to_owned())?;
        ensure(pin.points.iter().all(|p| p.is_finite()), || "a point is not finite".to_owned())?;
        pin.numbers.check()
    }

    fn check_pair(&self, &[a, b]: &[usize; 2]) -> Checked {
        ensure(a < b && b < self.links.len(), || format!("[{a}, {b}] is not a pair of links, lower first"))
    }

    fn check_patch(&self, patch: &TactilePatch) -> Checked {
        let links = self.links.len();
        ensure(patch.link < links, || format!("lies on link {}, there are {links}", patch.link))?;
        once(&self.tactile, |other| other.name == patch.name)?;
        ensure(!patch.is_empty(), || "has no taxels".to_owned())?;
        let sound = patch.link_from_patch.is_finite() && patch.half_size.iter().all(|&x| positive(x));
        ensure(sound, || "its pose must be finite, its size positive".to_owned())
    }

    fn check_sensors(&self) -> Checked {
        let on_links = self.sensors.cameras.iter().map(|camera| camera.link.as_deref().unwrap_or_default());
        let accelerometer = self.sensors.accelerometer.iter().map(|sensor| sensor.link.as_str());
        if let Some(link) = on_links.chain(accelerometer).find(|link| self.link(link).is_none()) {
            return Err(format!("one sits on link '{link}', which there is not"));
        }
        let mut encoded = self.sensors.joints.iter().flat_map(|encoders| &encoders.on);
        match encoded.find(|name| self.coordinate(name).is_none()) {
            None => Ok(()),
            Some(name) => {
                let known: Vec<&str> = self.coordinates.iter().map(|c| c.name.as_str()).collect();
                Err(format!("joints.on names '{name}'; valid: {}", known.join(", ")))
            }
        }
    }

    fn check_link(&self, link: &Link) -> Checked {
        once(&self.links, |other| other.name == link.name)?;
        let i = self.links.iter().position(|other| other.name == link.name).unwrap_or_default();
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
    guides.iter().try_for_each(|guide| guide.numbers.check())?;
    let sum: f64 = guides.iter().map(Guide::exponent).sum();
    if sum > MAX_EXPONENT {
        return Err(format!("its friction times wrap angle sum up to {sum}; valid: at most {MAX_EXPONENT}"));
    }
    Ok(())
}

fn ensure(sound: bool, problem: impl FnOnce() -> String) -> Checked {
    if sound { Ok(()) } else { Err(problem()) }
}

/// Refuses a second part of the same name.
fn once<T>(parts: &[T], same: impl Fn(&T) -> bool) -> Checked {
    ensure(parts.iter().filter(|part| same(part)).count() < 2, || "appears twice".to_owned())
}

fn ascending(entries: &[(usize, f64)]) -> bool {
    entries.windows(2).all(|w| w[0].0 < w[1].0)
}
