//! Named settings of MuJoCo. They follow the chapters "Modeling" (solver parameters, preventing slip, tuning)
//! and "Computation" (integrators) of its documentation, version 4.0. An option has the name of its MJCF attribute.

use crate::engine::option_set::{self, Dimension, EngineOptions, FoundSettings};
use anyhow::Result;

/// MuJoCo's options, by the names of their MJCF attributes; what is not named keeps MuJoCo's default.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// As on the command line.
    pub name: &'static str,
    /// Description, with the reason for the values.
    pub about: &'static str,
    /// The last value of an option that is named twice counts.
    pub(super) options: EngineOptions,
}

/// Attributes of `<option>`.
const OPTION: [&str; 12] = [
    "integrator",
    "cone",
    "impratio",
    "solver",
    "iterations",
    "tolerance",
    "ls_iterations",
    "ls_tolerance",
    "noslip_iterations",
    "noslip_tolerance",
    "ccd_iterations",
    "ccd_tolerance",
];
/// Attributes of `<flag>`.
const FLAG: [&str; 9] = [
    "multiccd",
    "nativeccd",
    "warmstart",
    "eulerdamp",
    "refsafe",
    "island",
    "ipc",
    "speculative",
    "diagexact",
];
/// Attributes of every geom and pair.
const CONTACT: [&str; 4] = ["solref", "solimp", "margin", "gap"];
/// Options that are no attribute of their own: softness of the couplings of rolling joints, which are loop closures, least
/// `condim` of every contact, `armature` of the hand's joints, whether rounded boxes lose their roundings, which makes
/// them MuJoCo's own boxes instead of meshes, and whether objects sleep beside a hand.
pub(super) const COUPLING_SOLREF: &str = "coupling_solref";
pub(super) const COUPLING_SOLIMP: &str = "coupling_solimp";
pub(super) const CONDIM: &str = "condim";
pub(super) const ARMATURE: &str = "armature";
pub(super) const BOXES: &str = "boxes";
pub(super) const SLEEP: &str = "sleep";
const OTHER: [&str; 6] = [COUPLING_SOLREF, COUPLING_SOLIMP, CONDIM, ARMATURE, BOXES, SLEEP];

impl Settings {
    /// The same with other options.
    ///
    /// # Errors
    /// There is no option of such a name.
    pub(in crate::engine) fn with(
        &self,
        name: &'static str,
        about: &'static str,
        changes: EngineOptions,
    ) -> Result<Self> {
        let known = OPTION.iter().chain(&FLAG).chain(&CONTACT).chain(&OTHER);
        option_set::check("mujoco", changes, known)?;
        let options = [self.options, changes].concat().leak();
        Ok(Settings { name, about, options })
    }

    pub(in crate::engine) fn get(&self, option: &str) -> Option<&'static str> {
        option_set::get(self.options, option)
    }

    fn attributes(&self, of: &[&str], ending: &str) -> String {
        let attribute = |key: &&str| Some(format!("{key}{ending}=\"{}\"", self.get(key)?));
        of.iter().filter_map(attribute).collect::<Vec<_>>().join(" ")
    }

    /// Attributes of `<option>`.
    pub(super) fn option(&self) -> String {
        self.attributes(&OPTION, "")
    }

    /// Attributes of `<flag>`.
    pub(super) fn flags(&self) -> String {
        self.attributes(&FLAG, "")
    }

    /// Attributes of every geom and pair.
    pub(super) fn contact(&self) -> String {
        self.attributes(&CONTACT, "")
    }

    /// Attributes of joint limits, which are as soft as contacts.
    pub(super) fn limits(&self) -> String {
        self.attributes(&["solref", "solimp"], "limit")
    }

    /// Attributes of the couplings of rolling joints.
    pub(super) fn coupling(&self) -> String {
        let value = |option: &str| self.get(option).unwrap_or_default();
        format!("solref=\"{}\" solimp=\"{}\"", value(COUPLING_SOLREF), value(COUPLING_SOLIMP))
    }
}

/// All of them.
///
/// The integrator is `discrete` unless stated otherwise: "for stiff springs and servos", which tendons and
/// base are; it alone is implicit in position. Cones are elliptic, "a better model of the physical reality",
/// and without them impratio means nothing. MuJoCo advises impratio 10 for manipulation and up to 100 against
/// slow slip. "Rigid contacts usually prefer lowering" solref "to 0.004 to 0.01 and loop closures to 0.004 to 0.005".
/// Couplings stay together within 0.1 mrad; otherwise they are as soft as contacts.
pub const SETTINGS: &[Settings] = &[
    Settings {
        name: "default",
        about: "MuJoCo's own contacts, solref 0.02, solimp 0.9 0.95 0.001, impratio 1; integrator discrete, elliptic cones",
        options: DEFAULT,
    },
    Settings {
        name: "default_impratio100",
        about: "the same contacts, impratio 100 against slow slip",
        options: &[
            ("integrator", "discrete"),
            ("cone", "elliptic"),
            ("impratio", "100"),
            ("solref", "0.02 1"),
            ("solimp", "0.9 0.95 0.001"),
            (COUPLING_SOLREF, "0.02 1"),
            (COUPLING_SOLIMP, "0.99 0.999 0.0001"),
        ],
    },
    Settings {
        name: "recommended",
        about: "its table of recommended initial values, but for condim 4 or 6 of pads and armature: solref 0.005, solimp as it comes, \
                impratio 10, elliptic cones; of its two integrators the one for stiff springs and servos, discrete",
        options: &recommended("discrete"),
    },
    Settings {
        name: "recommended_implicitfast",
        about: "the same with the other recommended integrator, implicitfast, which is implicit in velocity alone",
        options: &recommended("implicitfast"),
    },
    Settings {
        name: "recommended_rk4",
        about: "the same with RK4, which is advised for tumbling bodies and systems that nearly keep their energy; stiff cables \
                are beyond it",
        options: &recommended("RK4"),
    },
    Settings {
        name: "stiff5",
        about: "solref 0.005, solimp 0.99 0.999 0.001, impratio 100: little overlap and slow slip",
        options: &stiff5("enable"),
    },
    Settings {
        name: "stiff5_multiccd_off",
        about: "the same with `multiccd` disabled, one contact for each pair of convex shapes; it is on by default since 4.0",
        options: &stiff5("disable"),
    },
    Settings {
        name: "stiff2",
        about: "solref 0.002, solimp 0.999 0.9999 0.001, impratio 100: nearly rigid at short steps",
        options: &stiff2("enable"),
    },
    Settings {
        name: "stiff2_multiccd_off",
        about: "the same with `multiccd` disabled",
        options: &stiff2("disable"),
    },
];

/// Scenes without a hand in which shapes meet whose contacts `multiccd` makes. Between boxes, spheres and the ground the named
/// settings with and without it end alike, bit for bit.
const MULTICCD_SCENES: &[&str] = &["thirty_objects"];

impl Settings {
    /// Whether a scene without a hand can end otherwise than with other named settings.
    pub fn differ_in(&self, case: &str) -> bool {
        let off = self.options.iter().any(|(name, value)| (*name, *value) == ("multiccd", "disable"));
        !off || MULTICCD_SCENES.contains(&case)
    }
}

/// The heavy box rests at two steps. Friction against spinning keeps one of six grasps that `stiff5` loses in the search. Objects
/// sleep beside a hand, which MuJoCo never lets sleep.
pub const FOUND: &[FoundSettings] = &[
    FoundSettings { settings: "stiff2+integrator=Euler", scenes: &["mass_ratio"] },
    FoundSettings { settings: "stiff5+condim=4", scenes: &["grasps"] },
    FoundSettings { settings: "recommended+sleep=enable", scenes: MANY_OBJECTS },
    FoundSettings { settings: "stiff5+sleep=enable", scenes: MANY_OBJECTS },
];

/// Scenes of a hand with objects that lie still.
const MANY_OBJECTS: &[&str] = &["softhand_balls", "thirty_objects_and_hand", "dense_heap_and_hand"];

const DEFAULT: EngineOptions = &[
    ("integrator", "discrete"),
    ("cone", "elliptic"),
    ("impratio", "1"),
    ("solref", "0.02 1"),
    ("solimp", "0.9 0.95 0.001"),
    (COUPLING_SOLREF, "0.02 1"),
    (COUPLING_SOLIMP, "0.99 0.999 0.0001"),
];

const fn recommended(integrator: &'static str) -> [(&'static str, &'static str); 7] {
    [
        ("integrator", integrator),
        ("cone", "elliptic"),
        ("impratio", "10"),
        ("solref", "0.005 1"),
        ("solimp", "0.9 0.95 0.001"),
        (COUPLING_SOLREF, "0.004 1"),
        (COUPLING_SOLIMP, "0.99 0.999 0.0001"),
    ]
}

const fn stiff5(multiccd: &'static str) -> [(&'static str, &'static str); 8] {
    [
        ("integrator", "discrete"),
        ("cone", "elliptic"),
        ("impratio", "100"),
        ("solref", "0.005 1"),
        ("solimp", "0.99 0.999 0.001"),
        (COUPLING_SOLREF, "0.004 1"),
        (COUPLING_SOLIMP, "0.999 0.9999 0.0001"),
        ("multiccd", multiccd),
    ]
}

const fn stiff2(multiccd: &'static str) -> [(&'static str, &'static str); 8] {
    [
        ("integrator", "discrete"),
        ("cone", "elliptic"),
        ("impratio", "100"),
        ("solref", "0.002 1"),
        ("solimp", "0.999 0.9999 0.001"),
        (COUPLING_SOLREF, "0.002 1"),
        (COUPLING_SOLIMP, "0.9999 0.99999 0.0001"),
        ("multiccd", multiccd),
    ]
}

/// A search changes these options, one at a time: the documented ones of contacts, friction and integration.
pub const SPACE: &[Dimension] = &[
    Dimension("multiccd", &["enable", "disable"]),
    Dimension("nativeccd", &["disable"]),
    Dimension("boxes", &["sharp"]),
    Dimension("integrator", &["discrete", "implicitfast", "implicit", "Euler", "RK4"]),
    Dimension("cone", &["elliptic", "pyramidal"]),
    Dimension("impratio", &["1", "10", "100", "1000"]),
    Dimension("noslip_iterations", &["3", "10", "50"]),
    Dimension("condim", &["4", "6"]),
    Dimension(
        "solref",
        &["0.02 1", "0.01 1", "0.005 1", "0.002 1", "0.005 0.5", "0.005 2", "-40000 -400", "-200000 -900"],
    ),
    Dimension(
        "solimp",
        &[
            "0.9 0.95 0.001",
            "0.95 0.99 0.001",
            "0.99 0.999 0.001",
            "0.999 0.9999 0.001",
            "0.9 0.999 0.003",
            "0 0.99 0.002",
        ],
    ),
    Dimension("margin", &["0.001", "0.003"]),
    Dimension("solver", &["CG", "PGS"]),
    Dimension("iterations", &["300"]),
    Dimension("tolerance", &["1e-10", "1e-12"]),
    Dimension("ccd_iterations", &["100"]),
    Dimension("ccd_tolerance", &["1e-9"]),
    Dimension("armature", &["1e-6", "1e-5"]),
    Dimension("refsafe", &["disable"]),
    Dimension("ipc", &["enable"]),
    Dimension("speculative", &["enable"]),
    Dimension("diagexact", &["enable"]),
];
