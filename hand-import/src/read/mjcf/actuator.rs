//! Actuators: MuJoCo's shortcuts are settings of one general law, `f = gain · ctrl + b₀ + b₁ l + b₂ l̇`.

use crate::decision::Log;
use crate::numbers::numbers;
use crate::read::element::Element;
use crate::read::element::Notes;

/// An actuator before its names are looked up.
#[derive(Clone, Debug)]
pub(crate) struct ActuatorSpec {
    /// The element's name: `position`.
    pub(crate) kind: String,
    pub(crate) gain: f64,
    /// Whether the gain depends on length or velocity, or is a muscle's.
    pub(crate) plain_gain: bool,
    /// b₀, b₁, b₂.
    pub(crate) bias: [f64; 3],
    pub(crate) affine: bool,
    /// Whether the bias is another function than the affine one.
    pub(crate) plain_bias: bool,
    /// Fraction of critical damping; instead of b₂.
    pub(crate) damping_ratio: Option<f64>,
    pub(crate) gear: f64,
    pub(crate) ctrl_range: Option<[f64; 2]>,
    pub(crate) ctrl_limited: Option<bool>,
    /// Range of the integrated command.
    pub(crate) act_range: Option<[f64; 2]>,
    pub(crate) force_range: Option<[f64; 2]>,
    pub(crate) force_limited: Option<bool>,
    /// Fraction of the range of what it moves that the control has.
    pub(crate) inherit_range: f64,
    pub(crate) velocity: bool,
    /// Largest speed of the position that it regulates to, rad/s or m/s.
    pub(crate) slew: Option<f64>,
}

impl Default for ActuatorSpec {
    fn default() -> Self {
        ActuatorSpec {
            kind: "general".to_owned(),
            gain: 1.0,
            plain_gain: true,
            bias: [0.0; 3],
            affine: false,
            plain_bias: true,
            damping_ratio: None,
            gear: 1.0,
            ctrl_range: None,
            ctrl_limited: None,
            act_range: None,
            force_range: None,
            force_limited: None,
            inherit_range: 0.0,
            velocity: false,
            slew: None,
        }
    }
}

const KINDS: [&str; 11] = [
    "general",
    "motor",
    "position",
    "velocity",
    "intvelocity",
    "damper",
    "cylinder",
    "muscle",
    "adhesion",
    "plugin",
    "dcmotor",
];

impl ActuatorSpec {
    /// Whether an element of this name is an actuator.
    pub(crate) fn is_actuator(name: &str) -> bool {
        KINDS.contains(&name)
    }

    /// Whether its law is one that a servo or a cable of this project has.
    pub(crate) fn is_plain(&self) -> bool {
        self.plain_gain && self.plain_bias
    }

    /// Takes what an element states.
    pub(crate) fn apply(&mut self, element: &Element, problems: &mut Log) {
        let mut list = |name: &str| -> Option<Vec<f64>> {
            let text = element.get(name)?;
            let found = numbers(text).filter(|list| !list.is_empty());
            if found.is_none() {
                problems.bad(element, format!("{name} is '{text}'; valid: finite numbers"));
            }
            found
        };
        let pair = |list: Option<Vec<f64>>| list.and_then(|list| <[f64; 2]>::try_from(list).ok());
        self.kind.clone_from(&element.name);
        if let Some(gear) = list("gear") {
            self.gear = gear[0];
        }
        self.ctrl_range = pair(list("ctrlrange")).or(self.ctrl_range);
        self.force_range = pair(list("forcerange")).or(self.force_range);
        self.act_range = pair(list("actrange")).or(self.act_range);
        let flag = |name: &str, old: Option<bool>| match element.get(name) {
            Some("true") => Some(true),
            Some("false") => Some(false),
            Some(_) => None,
            None => old,
        };
        self.ctrl_limited = flag("ctrllimited", self.ctrl_limited);
        self.force_limited = flag("forcelimited", self.force_limited);
        if let Some(inherit) = list("inheritrange") {
            self.inherit_range = inherit[0];
        }
        let first = |list: Option<Vec<f64>>| list.map(|list| list[0]);
        match element.name.as_str() {
            "motor" => {
                (self.gain, self.plain_gain) = (1.0, true);
                (self.bias, self.affine, self.plain_bias) = ([0.0; 3], false, true);
                self.damping_ratio = None;
            }
            "position" | "intvelocity" => {
                self.gain = first(list("kp")).unwrap_or(self.gain);
                (self.bias[0], self.bias[1]) = (0.0, -self.gain);
                (self.affine, self.plain_gain, self.plain_bias) = (true, true, true);
                if let Some(kv) = first(list("kv")) {
                    self.bias[2] = -kv;
                    self.damping_ratio = None;
                }
                if let Some(ratio) = first(list("dampratio")) {
                    self.damping_ratio = Some(ratio);
                    self.bias[2] = 0.0;
                }
            }
            "velocity" => {
                self.gain = first(list("kv")).unwrap_or(self.gain);
                self.bias = [0.0, 0.0, -self.gain];
                (self.affine, self.velocity, self.plain_gain, self.plain_bias) = (true, true, true, true);
            }
            "cylinder" => {
                self.gain = first(list("area")).unwrap_or(self.gain);
                if let Some(diameter) = first(list("diameter")) {
                    self.gain = 0.25 * std::f64::consts::PI * diameter * diameter;
                }
                if let Some(bias) = list("bias") {
                    bias.iter().take(3).enumerate().for_each(|(k, x)| self.bias[k] = *x);
                }
                self.affine = true;
            }
            "general" => {
                if let Some(gain) = first(list("gainprm")) {
                    self.gain = gain;
                }
                if let Some(bias) = list("biasprm") {
                    bias.iter().take(3).enumerate().for_each(|(k, x)| self.bias[k] = *x);
                }
                match element.get("gaintype") {
                    Some("fixed") => self.plain_gain = true,
                    Some(_) => self.plain_gain = false,
                    None => {}
                }
                match element.get("biastype") {
                    Some("none") => (self.affine, self.plain_bias) = (false, true),
                    Some("affine") => (self.affine, self.plain_bias) = (true, true),
                    Some(_) => self.plain_bias = false,
                    None => {}
                }
            }
            _ => self.plain_gain = false,
        }
    }

    /// Makes it a regulator of position.
    pub(crate) fn regulates(&mut self, proportional: f64, derivative: f64, slew: Option<f64>) {
        (self.gain, self.bias) = (proportional, [0.0, -proportional, -derivative]);
        (self.affine, self.plain_gain, self.plain_bias) = (true, true, true);
        self.slew = slew;
    }

    /// b₀, b₁, b₂ of its law.
    pub(crate) fn bias(&self) -> [f64; 3] {
        if self.affine { self.bias } else { [0.0; 3] }
    }
}
