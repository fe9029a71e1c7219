//! Named settings of MuJoCo. They follow the chapters "Modeling" (solver parameters, preventing slip, tuning)
//! and "Computation" (integrators) of its documentation, version 4.0.

use std::fmt::Display;

/// The options of MuJoCo that settings choose; the others keep MuJoCo's defaults.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// As on the command line.
    pub name: &'static str,
    /// Description, with the reason for the values.
    pub about: &'static str,
    /// `integrator`.
    pub(super) integrator: &'static str,
    /// `impratio`, ratio of frictional to normal constraint impedance.
    pub(super) impratio: f64,
    /// Contacts and joint limits.
    pub(super) contact: Softness,
    /// Couplings of rolling joints, which are loop closures.
    pub(super) coupling: Softness,
}

/// Softness of a constraint.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Softness {
    /// `solref[0]`, time constant, s; the damping ratio is 1.
    time_s: f64,
    /// `solimp[0..3]`: impedance at no violation, at `width`, and `width`, m.
    impedance: [f64; 3],
}

impl Softness {
    /// As attributes that end in `of`.
    pub(super) fn attributes(&self, of: impl Display) -> String {
        let [least, most, width] = self.impedance;
        format!("solref{of}='{} 1' solimp{of}='{least} {most} {width}'", self.time_s)
    }
}

/// MuJoCo's own contacts: `solref` 0.02 1, `solimp` 0.9 0.95 0.001.
const DEFAULT: Softness = Softness { time_s: 0.02, impedance: [0.9, 0.95, 1e-3] };
/// Couplings stay together within 0.1 mrad; otherwise as soft as contacts.
const DEFAULT_COUPLING: Softness = Softness { time_s: 0.02, impedance: [0.99, 0.999, 1e-4] };
/// "Rigid contacts usually prefer lowering it to 0.004 to 0.01 and loop closures to 0.004 to 0.005".
const RECOMMENDED: Softness = Softness { time_s: 0.005, impedance: [0.9, 0.95, 1e-3] };
const RECOMMENDED_COUPLING: Softness = Softness { time_s: 0.004, impedance: [0.99, 0.999, 1e-4] };

/// All of them.
///
/// The integrator is `discrete` unless stated otherwise: "for stiff springs and servos", which tendons and
/// base are; it alone is implicit in position. Cones are elliptic, "a better model of the physical reality",
/// and without them impratio means nothing. MuJoCo advises impratio 10 for manipulation and up to 100 against
/// slow slip.
pub const SETTINGS: &[Settings] = &[
    Settings {
        name: "default",
        about: "MuJoCo's own contacts, solref 0.02, solimp 0.9 0.95 0.001, impratio 1; integrator discrete, elliptic cones",
        integrator: "discrete",
        impratio: 1.0,
        contact: DEFAULT,
        coupling: DEFAULT_COUPLING,
    },
    Settings {
        name: "default_impratio100",
        about: "the same contacts, impratio 100 against slow slip",
        integrator: "discrete",
        impratio: 100.0,
        contact: DEFAULT,
        coupling: DEFAULT_COUPLING,
    },
    Settings {
        name: "recommended",
        about: "what its table of recommended initial values says: solref 0.005, solimp as it comes, impratio 10, elliptic \
                cones; of its two integrators the one for stiff springs and servos, discrete",
        integrator: "discrete",
        impratio: 10.0,
        contact: RECOMMENDED,
        coupling: RECOMMENDED_COUPLING,
    },
    Settings {
        name: "recommended_implicitfast",
        about: "the same with the other recommended integrator, implicitfast, which is implicit in velocity alone",
        integrator: "implicitfast",
        impratio: 10.0,
        contact: RECOMMENDED,
        coupling: RECOMMENDED_COUPLING,
    },
    Settings {
        name: "recommended_rk4",
        about: "the same with RK4, which is advised for tumbling bodies and systems that nearly keep their energy; stiff cables \
                are beyond it",
        integrator: "RK4",
        impratio: 10.0,
        contact: RECOMMENDED,
        coupling: RECOMMENDED_COUPLING,
    },
    Settings {
        name: "stiff5",
        about: "solref 0.005, solimp 0.99 0.999 0.001, impratio 100: little overlap and slow slip",
        integrator: "discrete",
        impratio: 100.0,
        contact: Softness { time_s: 0.005, impedance: [0.99, 0.999, 1e-3] },
        coupling: Softness { time_s: 0.004, impedance: [0.999, 0.9999, 1e-4] },
    },
    Settings {
        name: "stiff2",
        about: "solref 0.002, solimp 0.999 0.9999 0.001, impratio 100: nearly rigid at short steps",
        integrator: "discrete",
        impratio: 100.0,
        contact: Softness { time_s: 0.002, impedance: [0.999, 0.9999, 1e-3] },
        coupling: Softness { time_s: 0.002, impedance: [0.9999, 0.99999, 1e-4] },
    },
];
