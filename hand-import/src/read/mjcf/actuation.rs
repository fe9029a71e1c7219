//! Tendons and actuators of a document.

use std::collections::BTreeMap;

use super::compile::{Reader, limited};
use super::length::arms_at_start;
use super::model::{Actuator, ActuatorTarget, Model, Path, Tendon, Way};
use crate::decision::At;
use crate::read::element::{Element, Notes};

impl Reader<'_> {
    pub(super) fn tendons(&mut self, root: &Element) {
        for element in root.all("tendon").flat_map(|tendon| &tendon.children) {
            let path = match element.name.as_str() {
                "fixed" => self.fixed(element),
                "spatial" => self.spatial(element),
                _ => continue,
            };
            let Some(path) = path else { continue };
            let at = self.defaults.of(element, "tendon", None, self.log);
            let range = at.array::<2>("range", self.log);
            let limited = limited(at.get("limited"), range, self.compiler.autolimits);
            let spring = at.list("springlength", self.log).and_then(|list| match *list.as_slice() {
                [both] if both >= 0.0 => Some([both, both]),
                [low, high, ..] if low >= 0.0 => Some([low, high]),
                _ => None,
            });
            let mut first =
                |name: &str| at.list(name, self.log).and_then(|l| l.first().copied()).unwrap_or(0.0);
            let (stiffness, damping, friction) =
                (first("stiffness"), first("damping"), first("frictionloss"));
            let force = at.array::<2>("actuatorfrcrange", self.log);
            let index = self.model.tendons.len();
            self.model.tendons.push(Tendon {
                name: element.get("name").map_or_else(|| format!("tendon_{index}"), str::to_owned),
                path,
                stiffness,
                spring_length: spring,
                damping,
                friction,
                range: range.filter(|_| limited),
                force_range: force.filter(|r| r[0] < r[1]),
                element: element.clone(),
            });
        }
    }

    pub(super) fn fixed(&mut self, element: &Element) -> Option<Path> {
        let mut joints = Vec::new();
        for part in element.all("joint") {
            let index = self.named(part, "joint", |model, name| model.joint(name))?;
            let coefficient = part.get("coef").and_then(|text| text.trim().parse().ok());
            let Some(coefficient) = coefficient else {
                self.log.bad(part, "has no coef that is a number");
                continue;
            };
            joints.push((index, coefficient));
        }
        Some(Path::Fixed(joints))
    }

    pub(super) fn spatial(&mut self, element: &Element) -> Option<Path> {
        let site = |model: &Model, name: &str| model.sites.iter().position(|site| site.name == name);
        let mut ways = Vec::new();
        for part in &element.children {
            ways.push(match part.name.as_str() {
                "site" => Way::Site(self.named(part, "site", site)?),
                "geom" => {
                    let geom = self.named(part, "geom", |model, name| {
                        model.geoms.iter().position(|geom| geom.name.as_deref() == Some(name))
                    })?;
                    let side = match part.get("sidesite") {
                        Some(_) => Some(self.named(part, "sidesite", site)?),
                        None => None,
                    };
                    Way::Wrap(geom, side)
                }
                "pulley" => {
                    let divisor = part.get("divisor").and_then(|text| text.trim().parse().ok());
                    Way::Pulley(divisor.filter(|divisor: &f64| *divisor > 0.0).unwrap_or(1.0))
                }
                _ => continue,
            });
        }
        Some(Path::Spatial(ways))
    }

    /// The index that an attribute names.
    pub(super) fn named(
        &mut self,
        element: &Element,
        attribute: &str,
        find: impl FnOnce(&Model, &str) -> Option<usize>,
    ) -> Option<usize> {
        let Some(name) = element.get(attribute) else {
            self.log.bad(element, format!("has no {attribute}"));
            return None;
        };
        let found = find(&self.model, name);
        if found.is_none() {
            self.log.bad(element, format!("names {attribute} '{name}', which is not there"));
        }
        found
    }

    pub(super) fn actuators(&mut self, root: &Element) {
        for element in root.all("actuator").flat_map(|actuator| &actuator.children) {
            let mut spec = self.defaults.actuator(element, self.log);
            if let Some(settings) = pid(root, element) {
                let number = |key: &str| settings.get(key).copied();
                let ignored: Vec<&str> =
                    ["ki", "imax"].into_iter().filter(|key| number(key).is_some()).collect();
                spec.regulates(number("kp").unwrap_or(0.0), number("kd").unwrap_or(0.0), number("slewmax"));
                let text =
                    format!("mujoco.pid: a servo has no integral part ({} are left out)", ignored.join(", "));
                self.log.lost(At::Hand, element, text);
            }
            let target = if let Some(name) = element.get("joint").or(element.get("jointinparent")) {
                self.model.joint(name).map(ActuatorTarget::Joint)
            } else if let Some(name) = element.get("tendon") {
                self.model.tendons.iter().position(|tendon| tendon.name == name).map(ActuatorTarget::Tendon)
            } else {
                self.log.lost(At::Hand, element, "drives neither a joint nor a tendon; it is left out");
                continue;
            };
            let Some(target) = target else {
                self.log.bad(element, "names a joint or tendon that is not there");
                continue;
            };
            self.limits(element, &mut spec, target);
            let index = self.model.actuators.len();
            let name = element.get("name").map_or_else(|| format!("actuator_{index}"), str::to_owned);
            self.model.actuators.push(Actuator { name, target, spec, element: element.clone() });
        }
    }

    pub(super) fn limits(
        &mut self,
        element: &Element,
        spec: &mut super::actuator::ActuatorSpec,
        target: ActuatorTarget,
    ) {
        let auto = self.compiler.autolimits;
        let on = |flag: Option<bool>, range: Option<[f64; 2]>| {
            range.filter(|r| flag.unwrap_or(auto) && r[0] < r[1])
        };
        let mut range = on(spec.ctrl_limited, spec.ctrl_range);
        let integrates = spec.kind == "intvelocity";
        let stated = if integrates { spec.act_range } else { range };
        if spec.inherit_range > 0.0 && stated.is_none() {
            let moved = match target {
                ActuatorTarget::Joint(j) => self.model.joints[j].range,
                ActuatorTarget::Tendon(t) => self.model.tendons[t].range,
            };
            let inherited = moved.map(|[low, high]| {
                let (middle, half) = (0.5 * (low + high), 0.5 * (high - low) * spec.inherit_range);
                [middle - half, middle + half]
            });
            *(if integrates { &mut spec.act_range } else { &mut range }) = inherited;
        }
        spec.ctrl_range = range;
        let own = on(spec.force_limited, spec.force_range);
        let (of_target, gear) = match target {
            ActuatorTarget::Joint(j) => (self.model.joints[j].force_range, spec.gear),
            ActuatorTarget::Tendon(t) => (self.model.tendons[t].force_range, spec.gear),
        };
        // The other limit counts behind the gear.
        let behind = of_target.filter(|_| gear != 0.0).map(|r| {
            let [a, b] = r.map(|x| x / gear);
            [a.min(b), a.max(b)]
        });
        spec.force_range = match (own, behind) {
            (Some(a), Some(b)) => Some([a[0].max(b[0]), a[1].min(b[1])]),
            (one, other) => one.or(other),
        };
        if let Some(ratio) = spec.damping_ratio.take() {
            let levers: Vec<(usize, f64)> = match target {
                ActuatorTarget::Joint(joint) => vec![(joint, spec.gear)],
                ActuatorTarget::Tendon(tendon) => {
                    let arms = arms_at_start(&self.model, &self.model.tendons[tendon]);
                    arms.into_iter().map(|(joint, arm)| (joint, spec.gear * arm)).collect()
                }
            };
            let inertia = self.inertia(&levers);
            spec.bias[2] = -ratio * 2.0 * (spec.gain.max(0.0) * inertia).sqrt();
            self.log.kept(
                At::Hand,
                element,
                format!("dampratio {ratio} at the inertia of the start pose: kv = {:.6}", -spec.bias[2]),
            );
        }
    }
}

/// Settings of a `mujoco.pid` actuator: its own, or those of the instance that it names.
fn pid(root: &Element, element: &Element) -> Option<BTreeMap<String, f64>> {
    if element.name != "plugin" || element.get("plugin") != Some("mujoco.pid") {
        return None;
    }
    let plugins = root.all("extension").flat_map(|extension| extension.all("plugin"));
    let named =
        |instance: &&Element| element.get("instance").is_some_and(|name| instance.get("name") == Some(name));
    let instance = plugins.flat_map(|plugin| plugin.all("instance")).find(named);
    let setting =
        |config: &Element| Some((config.get("key")?.to_owned(), config.get("value")?.trim().parse().ok()?));
    Some(instance.unwrap_or(element).all("config").filter_map(setting).collect())
}
