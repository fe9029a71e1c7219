//! Initial placement of objects.

use serde::Deserialize;

/// Initial placement of the objects.
#[derive(Clone, Debug, Deserialize)]
#[serde(rename_all = "snake_case", deny_unknown_fields)]
pub enum Placing {
    /// Dropped in layers.
    Pour(Pour),
    /// Put down next to each other.
    Scatter(Scatter),
    /// Each put at a pose of its own.
    Fixed(Vec<Fixed>),
}

impl Placing {
    /// Name of the region that all objects are placed in, if they are.
    pub fn into_region(&self) -> Option<&str> {
        match self {
            Placing::Pour(pour) => Some(&pour.into),
            Placing::Scatter(scatter) => Some(&scatter.into),
            Placing::Fixed(_) => None,
        }
    }

    /// Checks it for objects that exist with every seed.
    pub(crate) fn check(&self, certain: Option<&[String]>) -> Result<(), String> {
        match self {
            Placing::Pour(pour) if pour.layer == 0 => Err("place.pour.layer must be at least 1".to_owned()),
            Placing::Pour(_) | Placing::Scatter(_) => Ok(()),
            Placing::Fixed(list) => check_fixed(list, certain),
        }
    }
}

/// Layers of a jittered grid, dropped into a region.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Pour {
    /// Name of the region.
    pub into: String,
    /// Part of the region's width the grid spans.
    pub spread: f64,
    /// Most objects in a layer.
    pub layer: usize,
    /// Largest shift in x and y, m.
    pub jitter: f64,
    /// Height of the lowest layer above the region's floor, m.
    pub first_height: f64,
    /// Distance of layers, m.
    pub layer_height: f64,
}

/// Upright objects put down side by side, at random places and with random yaw.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Scatter {
    /// Name of the region.
    pub into: String,
    /// Least distance between objects, and to the region's sides, m.
    pub gap: f64,
}

/// One object at a pose of its own, shifted and turned by the seed within bounds.
#[derive(Clone, Debug, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Fixed {
    /// Name of the object.
    pub object: String,
    /// Name of an earlier object in the list, in whose frame the pose is; omitted, the world.
    #[serde(default)]
    pub on: Option<String>,
    /// Position of its frame, m.
    pub position: [f64; 3],
    /// Orientation, x, y, z, w.
    #[serde(default = "unturned")]
    pub quat_xyzw: [f64; 4],
    /// The seed shifts it by at most so much along each axis, to both sides, m.
    #[serde(default)]
    pub shift: [f64; 3],
    /// The seed turns it about z by at most so much, to both sides, degrees.
    #[serde(default)]
    pub turn_deg: f64,
}

fn unturned() -> [f64; 4] {
    [0.0, 0.0, 0.0, 1.0]
}

fn check_fixed(list: &[Fixed], certain: Option<&[String]>) -> Result<(), String> {
    let Some(names) = certain else {
        return Err(
            "place.fixed needs objects that are there with every seed: objects.count as large as the list"
                .to_owned(),
        );
    };
    for (k, fixed) in list.iter().enumerate() {
        let Fixed { object, on, position, quat_xyzw, shift, turn_deg } = fixed;
        let wrong =
            |field: &str, problem: String| Err(format!("place.fixed of `{object}`: {field} {problem}"));
        if !names.contains(object) {
            return wrong("object", format!("is none of the task's objects: {}", names.join(", ")));
        }
        if list[..k].iter().any(|other| other.object == *object) {
            return wrong("object", "is placed twice".to_owned());
        }
        if let Some(on) = on
            && !list[..k].iter().any(|other| other.object == *on)
        {
            let above: Vec<&str> = list[..k].iter().map(|other| other.object.as_str()).collect();
            let problem = format!("= `{on}` is not placed before it; before it are: [{}]", above.join(", "));
            return wrong("on", problem);
        }
        if !position.iter().all(|x| x.abs() <= 10.0) {
            return wrong("position", format!("= {position:?}; three numbers within 10 m"));
        }
        let length = quat_xyzw.iter().map(|x| x * x).sum::<f64>().sqrt();
        if !(0.99..=1.01).contains(&length) {
            return wrong("quat_xyzw", format!("= {quat_xyzw:?}; a unit quaternion x, y, z, w"));
        }
        if !shift.iter().all(|x| (0.0..=1.0).contains(x)) {
            return wrong("shift", format!("= {shift:?}; three numbers from 0 to 1 m"));
        }
        if !(0.0..=180.0).contains(turn_deg) {
            return wrong("turn_deg", format!("= {turn_deg}; 0 to 180 degrees"));
        }
    }
    match names.iter().find(|name| !list.iter().any(|fixed| fixed.object == **name)) {
        Some(missing) => Err(format!("place.fixed: nothing says where `{missing}` starts")),
        None => Ok(()),
    }
}

/// Names are used in addresses, messages and file names.
pub(crate) fn plain_name(field: &str, name: &str) -> Result<(), String> {
    const MAX_LENGTH: usize = 64;
    let plain = |c: char| c.is_ascii_alphanumeric() || matches!(c, '_' | '-' | '.');
    if (1..=MAX_LENGTH).contains(&name.len()) && name.chars().all(plain) && !name.starts_with('.') {
        return Ok(());
    }
    let shown: String = name.chars().take(MAX_LENGTH).collect();
    let valid = "1 to 64 letters, digits, '_', '-' and '.', the first no '.'";
    Err(format!("{field} = '{}'; valid: {valid}", shown.escape_debug()))
}
