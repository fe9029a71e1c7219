//! `<default>`: classes of attributes. A class inherits those of the class around it.

use std::collections::BTreeMap;

use super::actuator::ActuatorSpec;
use crate::decision::Log;
use crate::numbers::numbers;
use crate::read::element::Element;
use crate::read::element::Notes;

type Values = BTreeMap<String, String>;

/// Defaults of one class.
#[derive(Clone, Debug, Default)]
struct Class {
    /// By name of the element.
    elements: BTreeMap<String, Values>,
    actuator: ActuatorSpec,
}

/// All classes.
#[derive(Clone, Debug, Default)]
pub(crate) struct Defaults {
    classes: BTreeMap<String, Class>,
}

/// Name of the outermost class.
const MAIN: &str = "main";

impl Defaults {
    pub(crate) fn read(root: &Element, problems: &mut Log) -> Defaults {
        let mut defaults = Defaults::default();
        defaults.classes.insert(MAIN.to_owned(), Class::default());
        for element in root.all("default") {
            let name = element.get("class").unwrap_or(MAIN);
            let around = defaults.classes.get(name).or(defaults.classes.get(MAIN)).cloned();
            defaults.class(element, name, around.unwrap_or_default(), problems);
        }
        defaults
    }

    fn class(&mut self, element: &Element, name: &str, around: Class, problems: &mut Log) {
        let mut class = around;
        for child in element.children.iter().filter(|child| child.name != "default") {
            if ActuatorSpec::is_actuator(&child.name) {
                class.actuator.apply(child, problems);
            } else {
                let values = class.elements.entry(child.name.clone()).or_default();
                for (key, value) in &child.attributes {
                    set(values, key, value);
                }
            }
        }
        self.classes.insert(name.to_owned(), class.clone());
        for child in element.all("default") {
            match child.get("class") {
                Some(name) => self.class(child, name, class.clone(), problems),
                None => problems.bad(child, "a <default> inside another needs a class"),
            }
        }
    }

    fn find(&self, element: &Element, around: Option<&str>, problems: &mut Log) -> Option<&Class> {
        let name = element.get("class").or(around).unwrap_or(MAIN);
        if let Some(class) = self.classes.get(name) {
            return Some(class);
        }
        problems.bad(element, format!("names class '{name}', which is not there"));
        self.classes.get(MAIN)
    }

    /// The attributes of an element together with the defaults of its class; `around` is the childclass of
    /// the bodies around it, `kind` the name of the element in `<default>`.
    pub(crate) fn of<'a>(
        &'a self,
        element: &'a Element,
        kind: &str,
        around: Option<&str>,
        problems: &mut Log,
    ) -> Attributes<'a> {
        let class = self.find(element, around, problems);
        Attributes { element, defaults: class.and_then(|class| class.elements.get(kind)) }
    }

    /// The actuator of an element, from the defaults of its class.
    pub(crate) fn actuator(&self, element: &Element, problems: &mut Log) -> ActuatorSpec {
        let mut spec = self.find(element, None, problems).map(|c| c.actuator.clone()).unwrap_or_default();
        spec.apply(element, problems);
        spec
    }
}

/// A list that is shorter than the default's replaces only the first numbers of it.
fn set(values: &mut Values, key: &str, value: &str) {
    const ORIENTATIONS: [&str; 5] = ["quat", "axisangle", "xyaxes", "zaxis", "euler"];
    if ORIENTATIONS.contains(&key) {
        values.retain(|other, _| !ORIENTATIONS.contains(&other.as_str()));
    }
    let merged = values.get(key).map(|default| overlaid(default, value));
    values.insert(key.to_owned(), merged.unwrap_or_else(|| value.to_owned()));
}

fn overlaid(default: &str, value: &str) -> String {
    let rest = default.split_whitespace().skip(value.split_whitespace().count());
    std::iter::once(value).chain(rest).collect::<Vec<_>>().join(" ")
}

/// Attributes of one element: its own, else those of its class.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Attributes<'a> {
    pub(crate) element: &'a Element,
    defaults: Option<&'a Values>,
}

impl<'a> Attributes<'a> {
    pub(crate) fn get(&self, name: &str) -> Option<&'a str> {
        self.element.get(name).or_else(|| self.defaults?.get(name).map(String::as_str))
    }

    /// The attribute of these names that the element has, else the one that its class has.
    pub(crate) fn first_of(&self, names: &[&'static str]) -> Option<(&'static str, &'a str)> {
        let own = names.iter().find_map(|name| Some((*name, self.element.get(name)?)));
        own.or_else(|| names.iter().find_map(|name| Some((*name, self.defaults?.get(*name)?.as_str()))))
    }

    /// Numbers of an attribute; those that a short list leaves out come from the class.
    pub(crate) fn list(&self, name: &str, problems: &mut Log) -> Option<Vec<f64>> {
        let own = self.element.get(name);
        let default = self.defaults.and_then(|values| values.get(name)).map(String::as_str);
        let text = match (own, default) {
            (Some(own), Some(default)) => overlaid(default, own),
            (Some(text), None) | (None, Some(text)) => text.to_owned(),
            (None, None) => return None,
        };
        let found = numbers(&text);
        if found.is_none() {
            problems.bad(self.element, format!("{name} is '{text}'; valid: finite numbers"));
        }
        found
    }

    /// As many numbers as the array has.
    pub(crate) fn array<const N: usize>(&self, name: &str, problems: &mut Log) -> Option<[f64; N]> {
        let list = self.list(name, problems)?;
        let found = list.get(..N).and_then(|list| list.try_into().ok());
        if found.is_none() {
            problems.bad(self.element, format!("{name} has {} numbers; valid: {N}", list.len()));
        }
        found
    }

    pub(crate) fn number(&self, name: &str, problems: &mut Log) -> Option<f64> {
        self.array::<1>(name, problems).map(|[x]| x)
    }
}
