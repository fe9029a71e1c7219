//! The published measurements: their protocol, source and numbers, and how ours is taken. The texts appear on the page.

use super::grips::{BARRETT, Grip, MODEL_O, REFLEX, ROBOTIQ_2F, ROBOTIQ_3F, Reading, T42, Way, measure};
use super::outcome::{Effort, Study};
use super::{barrett, grips, softhand};
use anyhow::Result;
use palmares_bench::measured::Measured;

const IJRR: &str = "Catalano, Grioli, Farnioli, Serio, Piazza, Bicchi: *Adaptive synergies for the design and control of the \
    Pisa/IIT SoftHand*, IJRR 33(5), 2014, section V-A, figures 18 and 19";
const NIST: &str = "Falco, Van Wyk, Messina: *Performance Metrics and Test Methods for Robotic Hands*, NIST SP 1227 (draft, \
    2018); Falco, Van Wyk, Liu, Carpin: *Grasping the Performance*, IEEE Robotics & Automation Magazine 22(4), 2015; ASTM \
    WK83863";
const NIST_THEIRS: &str = "no table for this hand found. The published figures are of other hands (Schunk's dexterous hand \
    among them), and the tables themselves could not be read: the comparison is open";
const NIST_STRENGTH: &str = "A cylinder of two halves with a force sensor between them. The hand takes it with its full \
    force, in a pinch between the fingertips and in a wrap against the palm; the reading is the internal force";
const NIST_SLIP: &str = "The hand holds a cylinder with its full force; an arm pulls the cylinder out along its axis; the \
    reading is the largest force before gross slip";
const NIST_HERE: &str = "A cylinder of 52 mm (the shell for a Mini45 sensor) and 120 mm, split across the closing \
    direction in a pinch; in a wrap the mean over all splits; friction 0.8 with the hand's own; a person puts it as \
    near to the palm, or to the fingertips' end, as the hand keeps it, and holds it until the hand has closed; no weight";
const NIST_WHY: &str =
    "Prediction, not comparison. Friction, the artefact's length and the place in the hand are guesses";

const fn nist(
    key: &'static str,
    title: &'static str,
    protocol: &'static str,
    measure: fn(&Effort) -> Result<Vec<Measured>>,
) -> Study {
    Study {
        key,
        title,
        source: NIST,
        protocol,
        here: NIST_HERE,
        published: None,
        theirs: NIST_THEIRS,
        unit: "N",
        why: NIST_WHY,
        measure,
    }
}

fn pinch(effort: &Effort, grip: &Grip) -> Result<Vec<Measured>> {
    measure(effort, grip, (Way::Pinch, Reading::Split), None)
}

fn wrap(effort: &Effort, grip: &Grip) -> Result<Vec<Measured>> {
    measure(effort, grip, (Way::Wrap, Reading::Split), None)
}

fn slip(effort: &Effort, grip: &Grip) -> Result<Vec<Measured>> {
    measure(effort, grip, (Way::Wrap, Reading::Pull), None)
}

/// All, in the order of the page.
pub(crate) const STUDIES: &[Study] = &[
    Study {
        key: "softhand_split_cylinder",
        title: "SoftHand: force on a split cylinder",
        source: IJRR,
        protocol: "The hand wears a working glove with padded rubber surfaces and closes on a cylinder of 45 × 120 mm, split, \
            with a six-axis sensor (ATI Nano17) between the halves. One recording is printed",
        here: "The wrist is fixed; the cylinder lies across the palm at the roots of the fingers, in nine places that a \
            person would choose; the person holds it until the hand has closed on its full command, and lets go. The force \
            is that between the halves, at rest, with the split parallel to the palm; the paper does \
            not say how it lay, so that the mean over all splits is listed too. No weight: a sensor is zeroed with it",
        published: Some(20.0),
        theirs: "about 20 N along the sensor's z axis, the largest of the recording",
        unit: "N",
        why: "The tension limit is fitted to this number. The spread over places is ours: one recording has none. The largest \
            reading of a recording is compared with a mean at rest. The glove's padding, which spreads and softens contacts, \
            is not modelled; the objects' friction is a guess, and its effect is listed",
        measure: |effort| softhand::split(effort, "softhand"),
    },
    Study {
        key: "softhand_disc_torque",
        title: "SoftHand: torque on a disc",
        source: IJRR,
        protocol: "A disc of 95 × 20 mm with a sensor; the largest torque that the hand holds. The paper names a Nano17 for \
            force and torque and does not say how the disc lay or who turned it",
        here: "The disc lies flat in the palm, like a lid, in the same nine places. When the hand has closed, a torque about \
            the disc's axis grows by 1 N·m/s until the disc has turned by 30 degrees; the largest one counts",
        published: Some(2.0),
        theirs: "2 N·m, the largest of the recording",
        unit: "N·m",
        why: "Nothing is fitted to this number: it follows from the same tension limit and the guessed friction, to which it is \
            proportional. Grasp and end of the real test are unknown; a turn of 30 degrees is our choice",
        measure: |effort| softhand::disc(effort, "softhand"),
    },
    Study {
        key: "softhand_strong_split_cylinder",
        title: "SoftHand with the stronger motor: force on a split cylinder",
        source: IJRR,
        protocol: "The same test in what the authors call an occasional experiment with a stronger motor",
        here: "The same as above with the hand `softhand_strong`",
        published: Some(28.0),
        theirs: "28 N",
        unit: "N",
        why: "As above; the paper does not name the motor",
        measure: |effort| softhand::split(effort, "softhand_strong"),
    },
    Study {
        key: "softhand_strong_disc_torque",
        title: "SoftHand with the stronger motor: torque on a disc",
        source: IJRR,
        protocol: "The same test with the stronger motor",
        here: "The same as above with the hand `softhand_strong`",
        published: Some(3.5),
        theirs: "3.5 N·m",
        unit: "N·m",
        why: "As above",
        measure: |effort| softhand::disc(effort, "softhand_strong"),
    },
    Study {
        key: "softhand_closing_time",
        title: "SoftHand: closing time in air",
        source: "qb robotics' data sheet of the qb SoftHand, the product that followed; IJRR prints no closing time",
        protocol: "Open to fist, full command",
        here: "The full command at once; time until the sum of all joint angles has reached 95 and 99 % of its final value",
        published: Some(1.1),
        theirs: "1.1 s, of the product, whose motor and gears are others",
        unit: "s",
        why: "Another hand: an order of magnitude, not a test",
        measure: softhand::time,
    },
    Study {
        key: "softhand_motor_power",
        title: "SoftHand: power of the motor, closing in air",
        source: "IJRR, section V: Maxon RE-max 21, 6 W, 84:1",
        protocol: "The rated power of the motor; not a measurement",
        here: "Work of the motor on its tendon until the joints have reached 99 % of the fist, over that time",
        published: Some(6.0),
        theirs: "6 W rated: an upper bound of the mean",
        unit: "W",
        why: "The rating is electrical power at full load; gears and tendon lose part of it. Ours must stay below",
        measure: softhand::power,
    },
    Study {
        key: "rocchi_hauser_free_equilibrium",
        title: "SoftHand: equilibrium of the free hand",
        source: "Rocchi, Ames, Li, Hauser: *Stable simulation of underactuated compliant hands*, ICRA 2016, equations 4 and 5, \
            figures 5 and 6",
        protocol: "In the paper's figures simulated joints of the free hand lie on the prediction until contact. The curves \
            are printed without numbers; pose, object and tendon stiffness are not published, so no point of the curves can \
            be compared. Its text could not be read here again",
        here: "The hand at rest in air against the closed form. docs/senses.md repeats the grasp of the stacking cup",
        published: Some(0.0),
        theirs: "lines and dashes coincide",
        unit: "rad",
        why: "Both are the same equations; the rest is the solver's tolerance",
        measure: softhand::free_equilibrium,
    },
    Study {
        key: "barrett_joint_ratio",
        title: "Barrett: ratio of the joints",
        source: "Barrett Technology's support pages, *BarrettHand BH8-280/282 Kinematics, joint ranges, conversion factors*",
        protocol: "Gears of 125:1 from the motor to the inner joint, 93.75:1 to the outer one; in air both are engaged",
        here: "The hand at rest in air at σ = 0.2, 0.4, 0.6",
        published: Some(1.0 / 3.0),
        theirs: "outer = inner / 3, from 125 / 93.75 − 1",
        unit: "1",
        why: "The drives yield by 0.4 % under the small springs that make the rest unique",
        measure: barrett::ratio,
    },
    Study {
        key: "barrett_fingertip_force",
        title: "Barrett: force of a fingertip",
        source: "15 N is recalled from the maker's data sheet, which was not found again; the support pages name a fingertip \
            torque sensor of ± 1 N·m, 20 N at 5 cm",
        protocol: "Not described",
        here: "One finger closes alone, and its tip meets a fixed smooth sensor head-on, at three places of its way",
        published: Some(15.0),
        theirs: "15 N, recalled",
        unit: "N",
        why: "The torque limits are made from this number and the distance of the tip from the outer joint",
        measure: barrett::fingertip,
    },
    Study {
        key: "robotiq_2f85_grip",
        title: "Robotiq 2F-85: grip force",
        source: "Robotiq, *2F-85 & 2F-140 instruction manual*, specifications",
        protocol: "Parallel grip; the force is set between 20 and 235 N",
        here: "The pads on a cylinder of 52 mm, full command",
        published: Some(235.0),
        theirs: "20 to 235 N, as set",
        unit: "N",
        why: "Ours has the limit of the published MuJoCo model (5 N·m on the drivers), which gives the lower part of the \
            maker's range: the model is weak, not the solver",
        measure: |effort| measure(effort, &ROBOTIQ_2F, (Way::Pinch, Reading::Split), Some(235.0)),
    },
    Study {
        key: "robotiq_3f_grip",
        title: "Robotiq 3F: grip force",
        source: "Robotiq, *3-Finger Adaptive Robot Gripper instruction manual*, registers of force",
        protocol: "The force is set between 15 and 60 N, 0.175 N a count",
        here: "Two fingers against one on a cylinder of 52 mm between the fingertips, full command",
        published: Some(60.0),
        theirs: "15 to 60 N, as set",
        unit: "N",
        why: "Fitted: the tension limit is chosen so; the reading is that of the single finger",
        measure: |effort| measure(effort, &ROBOTIQ_3F, (Way::Pinch, Reading::Split), Some(60.0)),
    },
    Study {
        key: "yale_t42_grip",
        title: "Yale T42: grip force",
        source: "Yale OpenHand Project, *About Model T*: holding force 10 to 13 N, of the four-fingered Model T. No grasp force \
            of the T42 was found",
        protocol: "Not described",
        here: "Both fingertips on a cylinder of 52 mm, full command",
        published: Some(11.5),
        theirs: "10 to 13 N, of a sister hand",
        unit: "N",
        why: "The tension limit is a guess made from this number",
        measure: |effort| measure(effort, &T42, (Way::Pinch, Reading::Split), Some(11.5)),
    },
    Study {
        key: "reflex_mass",
        title: "ReFlex: mass",
        source: "König: reflex_stack (github.com/axkoenig/reflex_stack), reflex.urdf.xacro, commit 192306ab",
        protocol: "Measured by a user",
        here: "Sum of the links",
        published: Some(0.9),
        theirs: "about 0.9 kg",
        unit: "kg",
        why: "The shares of the links are guesses",
        measure: |_| grips::mass("reflex", 0.9),
    },
    nist("nist_pinch_reflex", "NIST grasp strength, pinch: ReFlex", NIST_STRENGTH, |e| pinch(e, &REFLEX)),
    nist("nist_wrap_reflex", "NIST grasp strength, wrap: ReFlex", NIST_STRENGTH, |e| wrap(e, &REFLEX)),
    nist("nist_slip_reflex", "NIST slip resistance: ReFlex", NIST_SLIP, |e| slip(e, &REFLEX)),
    nist("nist_wrap_yale_t42", "NIST grasp strength, wrap: T42", NIST_STRENGTH, |e| wrap(e, &T42)),
    nist("nist_slip_yale_t42", "NIST slip resistance: T42", NIST_SLIP, |e| slip(e, &T42)),
    nist("nist_pinch_yale_model_o", "NIST grasp strength, pinch: Model O", NIST_STRENGTH, |e| {
        pinch(e, &MODEL_O)
    }),
    nist("nist_wrap_yale_model_o", "NIST grasp strength, wrap: Model O", NIST_STRENGTH, |e| {
        wrap(e, &MODEL_O)
    }),
    nist("nist_slip_yale_model_o", "NIST slip resistance: Model O", NIST_SLIP, |e| slip(e, &MODEL_O)),
    nist("nist_wrap_barrett_bh282", "NIST grasp strength, wrap: Barrett", NIST_STRENGTH, |e| {
        wrap(e, &BARRETT)
    }),
    nist("nist_slip_barrett_bh282", "NIST slip resistance: Barrett", NIST_SLIP, |e| slip(e, &BARRETT)),
    nist("nist_wrap_robotiq_3f", "NIST grasp strength, wrap: Robotiq 3F", NIST_STRENGTH, |e| {
        wrap(e, &ROBOTIQ_3F)
    }),
    nist("nist_slip_robotiq_3f", "NIST slip resistance: Robotiq 3F", NIST_SLIP, |e| slip(e, &ROBOTIQ_3F)),
];
