//! The published measurements: their protocol, source and numbers, and how ours is taken. The texts appear on the page.

use super::ends::{Ends, over_ranges};
use super::grips::{BARRETT, Grip, MODEL_O, REFLEX, ROBOTIQ_2F, ROBOTIQ_3F, Reading, T42, Way, measure};
use super::outcome::{Effort, Kind, Study};
use super::press::{self, Finger};
use super::{barrett, fingertips, grips, softhand};
use anyhow::Result;
use palmares_bench::measured::Measured;
use palmares_models::hand::Hand;
use std::sync::Arc;

const IJRR: &str = "Catalano, Grioli, Farnioli, Serio, Piazza, Bicchi: *Adaptive synergies for the design and control of the \
    Pisa/IIT SoftHand*, IJRR 33(5), 2014, section V-A, figures 18 and 19";
const TAN: &str = "Tan, Xie, Correll 2026, arXiv 2603.08988, with github.com/correlllab/rh56_controller";
const TAN_PROTOCOL: &str = "A finger presses on a force sensor with commanded force limits from 0 to 1000; the force is fitted by a \
    straight line. The hand was damaged in part";
const TAN_HERE: &str = "The finger closes alone on a fixed smooth sensor that its tip meets head-on, at three places of its way. The \
    line is over ten parts of the largest force at the middle place";
const TAN_WHY: &str = "The torque limit of 1 N·m is that of a published description, with a range of 0.8 to 1 N·m. Where on the tip the \
    sensor was, and how far the finger was bent, is not known";
const TAN_WHY_THUMB: &str = "Ours is too weak: the published description gives every joint the same 1 N·m, and the real thumb has more. \
    2.3 N·m would agree; nothing but this measurement says so";
const MANUAL_2F: &str =
    "Robotiq, *2F-85 & 2F-140 instruction manual* for e-Series, 2019-02, specifications and grip force";
const CELL_PROTOCOL: &str = "A load cell between the pads, which are of several materials, at the least and the largest setting of the \
    force. The speed is not given";
const CELL_WHY: &str = "Ours is at rest, and from the manual's other number for the same gripper";
const CELL_WHY_SOFT: &str = "Ours does not depend on the pads: a motor with a limit of force presses as long as it is told to. The real \
    one stops when it has lost its speed, and its screw holds what it has reached: soft pads take the more of the motion";
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
const NIST_WHY: &str = "Nothing to compare it with was found. Friction, the artefact's length and the place in the hand are guesses";

const fn nist(
    key: &'static str,
    title: &'static str,
    protocol: &'static str,
    measure: fn(&Effort) -> Result<Vec<Measured>>,
) -> Study {
    Study {
        key,
        kind: Kind::Prediction,
        title,
        source: NIST,
        protocol,
        here: NIST_HERE,
        published: None,
        theirs: NIST_THEIRS,
        unit: "N",
        why: NIST_WHY,
        measure,
        ends: None,
    }
}

fn pinch(effort: &Effort, grip: &Grip) -> Result<Vec<Measured>> {
    measure(effort, grip, (Way::Pinch, Reading::Split), None)
}

fn pinch_ends(effort: &Effort, grip: &Grip) -> Result<Option<Ends>> {
    over_ranges(&grip.hand()?, |hand| grips::pinched(effort, grip, hand))
}

fn press_ends(effort: &Effort, finger: &Finger) -> Result<Option<Ends>> {
    over_ranges(&finger.hand()?, |hand| press::middle(effort, hand, finger))
}

/// The 2F-85 with its motor limited to the least setting of its range, N.
fn least_setting(effort: &Effort) -> Result<Vec<Measured>> {
    let mut hand = Hand::clone(&*ROBOTIQ_2F.hand()?);
    for tendon in &mut hand.tendons {
        tendon.force_limit *= 20.0 / 235.0;
    }
    let value = grips::pinched(effort, &ROBOTIQ_2F, &Arc::new(hand))?;
    Ok(vec![Measured {
        quantity: "force between the halves".to_owned(),
        unit: "N".to_owned(),
        hand: ROBOTIQ_2F.hand.to_owned(),
        published: Some(25.0),
        placements: vec![("near the tips' end".to_owned(), value)],
    }])
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
        kind: Kind::Calibration,
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
        ends: None,
    },
    Study {
        key: "softhand_disc_torque",
        kind: Kind::Prediction,
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
        ends: None,
    },
    Study {
        key: "softhand_strong_split_cylinder",
        kind: Kind::Calibration,
        title: "SoftHand with the stronger motor: force on a split cylinder",
        source: IJRR,
        protocol: "The same test in what the authors call an occasional experiment with a stronger motor",
        here: "The same as above with the hand `softhand_strong`",
        published: Some(28.0),
        theirs: "28 N",
        unit: "N",
        why: "As above; the paper does not name the motor",
        measure: |effort| softhand::split(effort, "softhand_strong"),
        ends: None,
    },
    Study {
        key: "softhand_strong_disc_torque",
        kind: Kind::Prediction,
        title: "SoftHand with the stronger motor: torque on a disc",
        source: IJRR,
        protocol: "The same test with the stronger motor",
        here: "The same as above with the hand `softhand_strong`",
        published: Some(3.5),
        theirs: "3.5 N·m",
        unit: "N·m",
        why: "As above",
        measure: |effort| softhand::disc(effort, "softhand_strong"),
        ends: None,
    },
    Study {
        key: "softhand_closing_time",
        kind: Kind::Calibration,
        title: "SoftHand: closing time in air",
        source: "qb robotics' data sheet of the qb SoftHand, the product that followed; IJRR prints no closing time",
        protocol: "Open to fist, full command",
        here: "The full command at once; time until the sum of all joint angles has reached 95 and 99 % of its final value",
        published: Some(1.1),
        theirs: "1.1 s, of the product, whose motor and gears are others",
        unit: "s",
        why: "Another hand: an order of magnitude, not a test",
        measure: softhand::time,
        ends: None,
    },
    Study {
        key: "softhand_motor_power",
        kind: Kind::Prediction,
        title: "SoftHand: power of the motor, closing in air",
        source: "IJRR, section V: Maxon RE-max 21, 6 W, 84:1",
        protocol: "The rated power of the motor; not a measurement",
        here: "Work of the motor on its tendon until the joints have reached 99 % of the fist, over that time",
        published: Some(6.0),
        theirs: "6 W rated: an upper bound of the mean",
        unit: "W",
        why: "The rating is electrical power at full load; gears and tendon lose part of it. Ours must stay below",
        measure: softhand::power,
        ends: None,
    },
    Study {
        key: "rocchi_hauser_free_equilibrium",
        kind: Kind::Prediction,
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
        ends: None,
    },
    Study {
        key: "barrett_joint_ratio",
        kind: Kind::Calibration,
        title: "Barrett: ratio of the joints",
        source: "Barrett Technology's support pages, *BarrettHand BH8-280/282 Kinematics, joint ranges, conversion factors*",
        protocol: "Gears of 125:1 from the motor to the inner joint, 93.75:1 to the outer one; in air both are engaged",
        here: "The hand at rest in air at σ = 0.2, 0.4, 0.6",
        published: Some(1.0 / 3.0),
        theirs: "outer = inner / 3, from 125 / 93.75 − 1",
        unit: "1",
        why: "The drives yield by 0.4 % under the small springs that make the rest unique",
        measure: barrett::ratio,
        ends: None,
    },
    Study {
        key: "barrett_fingertip_force",
        kind: Kind::Calibration,
        title: "Barrett: force of a fingertip",
        source: "15 N is recalled from the maker's data sheet, which was not found again; the support pages name a fingertip \
            torque sensor of ± 1 N·m, 20 N at 5 cm",
        protocol: "Not described",
        here: "One finger closes alone, and its tip meets a fixed smooth sensor head-on, at three places of its way",
        published: Some(15.0),
        theirs: "15 N, recalled",
        unit: "N",
        why: "The torque limits are made from this number and the distance of the tip from the outer joint",
        measure: |effort| press::full(effort, &barrett::FINGERS, 15.0),
        ends: Some(|effort| press_ends(effort, &barrett::FINGERS[0])),
    },
    Study {
        key: "barrett_finger_load",
        kind: Kind::Prediction,
        title: "Barrett: load of a finger",
        source: "Barrett Technology, of the BH8-262: at most 2 kg a finger",
        protocol: "Not described; a limit, not a measurement, of an earlier version of the hand",
        here: "As above",
        published: Some(19.6),
        theirs: "2 kg, 19.6 N, at most",
        unit: "N",
        why: "Ours must stay below. It follows from the 15 N of the row above",
        measure: |effort| press::full(effort, &barrett::FINGERS, 19.6),
        ends: None,
    },
    Study {
        key: "robotiq_2f85_grip",
        kind: Kind::Calibration,
        title: "Robotiq 2F-85: grip force",
        source: MANUAL_2F,
        protocol: "Parallel grip; the force is set between 20 and 235 N, within 10 %",
        here: "The pads on a cylinder of 52 mm, full command",
        published: Some(235.0),
        theirs: "20 to 235 N, as set",
        unit: "N",
        why: "Fitted: the largest force of the motor is made from 235 N. A pad moves by 53.5 mm a radian of its driver here, so that \
            25 N·m on both drivers press with 25/2/0.0535 = 234 N. The 5 N·m of the published MuJoCo model, which ours had before, \
            are 47 N: they are a choice of that model, not of the maker",
        measure: |effort| measure(effort, &ROBOTIQ_2F, (Way::Pinch, Reading::Split), Some(235.0)),
        ends: Some(|effort| pinch_ends(effort, &ROBOTIQ_2F)),
    },
    Study {
        key: "robotiq_2f85_cell_hard",
        kind: Kind::Prediction,
        title: "Robotiq 2F-85: load cell, hard pads",
        source: MANUAL_2F,
        protocol: CELL_PROTOCOL,
        here: "The pads on a cylinder of 52 mm, full command",
        published: Some(220.0),
        theirs: "25 to 220 N with steel or aluminium",
        unit: "N",
        why: CELL_WHY,
        measure: |effort| measure(effort, &ROBOTIQ_2F, (Way::Pinch, Reading::Split), Some(220.0)),
        ends: None,
    },
    Study {
        key: "robotiq_2f85_cell_silicone",
        kind: Kind::Prediction,
        title: "Robotiq 2F-85: load cell, silicone pads",
        source: MANUAL_2F,
        protocol: CELL_PROTOCOL,
        here: "The pads on a cylinder of 52 mm, full command",
        published: Some(155.0),
        theirs: "25 to 155 N with silicone of 40 Shore A",
        unit: "N",
        why: CELL_WHY_SOFT,
        measure: |effort| measure(effort, &ROBOTIQ_2F, (Way::Pinch, Reading::Split), Some(155.0)),
        ends: None,
    },
    Study {
        key: "robotiq_2f85_cell_soft",
        kind: Kind::Prediction,
        title: "Robotiq 2F-85: load cell, soft pads",
        source: MANUAL_2F,
        protocol: CELL_PROTOCOL,
        here: "The pads on a cylinder of 52 mm, full command",
        published: Some(115.0),
        theirs: "25 to 115 N with neoprene of 10 Shore A or polyurethane of 30 Shore OO",
        unit: "N",
        why: CELL_WHY_SOFT,
        measure: |effort| measure(effort, &ROBOTIQ_2F, (Way::Pinch, Reading::Split), Some(115.0)),
        ends: None,
    },
    Study {
        key: "robotiq_2f85_cell_least",
        kind: Kind::Prediction,
        title: "Robotiq 2F-85: load cell, least setting",
        source: MANUAL_2F,
        protocol: CELL_PROTOCOL,
        here: "The pads on a cylinder of 52 mm, motor limited to 20/235 of its force",
        published: Some(25.0),
        theirs: "25 N with every pad",
        unit: "N",
        why: "The register of force is taken as linear from 20 to 235 N, so that ours follows from the row of the grip force",
        measure: |effort| least_setting(effort),
        ends: None,
    },
    Study {
        key: "robotiq_3f_grip",
        kind: Kind::Calibration,
        title: "Robotiq 3F: grip force",
        source: "Robotiq, *3-Finger Adaptive Robot Gripper instruction manual*, registers of force",
        protocol: "The force is set between 15 and 60 N, 0.175 N a count",
        here: "Two fingers against one on a cylinder of 52 mm between the fingertips, full command",
        published: Some(60.0),
        theirs: "15 to 60 N, as set",
        unit: "N",
        why: "Fitted: the tension limit is chosen so; the reading is that of the single finger",
        measure: |effort| measure(effort, &ROBOTIQ_3F, (Way::Pinch, Reading::Split), Some(60.0)),
        ends: Some(|effort| pinch_ends(effort, &ROBOTIQ_3F)),
    },
    Study {
        key: "robotiq_3f_tip",
        kind: Kind::Prediction,
        title: "Robotiq 3F: force of a fingertip",
        source: "Robotiq, *3-Finger Adaptive Robot Gripper instruction manual*, 2019, specifications",
        protocol: "Not described; the largest force of a fingertip",
        here: "The middle finger closes alone, and its tip meets a fixed smooth sensor 10 mm before its end, at three places of its way",
        published: Some(70.0),
        theirs: "70 N, the most",
        unit: "N",
        why: "The grip of the row above is two fingers against one, half of it for each. A single tip of ours has as much as one of \
            the two: either the manuals' forces are those of a finger, and ours are too weak, or they are those of the hand",
        measure: |effort| press::full(effort, &[fingertips::ROBOTIQ_3F], 70.0),
        ends: Some(|effort| press_ends(effort, &fingertips::ROBOTIQ_3F)),
    },
    Study {
        key: "inspire_index_force",
        kind: Kind::Prediction,
        title: "Inspire RH56: force of the index finger",
        source: TAN,
        protocol: TAN_PROTOCOL,
        here: TAN_HERE,
        published: Some(7.064),
        theirs: "F = 0.007478 r − 0.414 N for commands r from 0 to 1000, R² 0.987, n = 10: 7.06 N at most",
        unit: "N",
        why: TAN_WHY,
        measure: |effort| press::against_command(effort, &fingertips::INDEX, fingertips::INDEX_LINE),
        ends: Some(|effort| press_ends(effort, &fingertips::INDEX)),
    },
    Study {
        key: "inspire_middle_force",
        kind: Kind::Prediction,
        title: "Inspire RH56: force of the middle finger",
        source: TAN,
        protocol: TAN_PROTOCOL,
        here: TAN_HERE,
        published: Some(6.47),
        theirs: "F = 0.006452 r + 0.018 N, R² 0.986, n = 10: 6.47 N at most",
        unit: "N",
        why: TAN_WHY,
        measure: |effort| press::against_command(effort, &fingertips::MIDDLE, fingertips::MIDDLE_LINE),
        ends: Some(|effort| press_ends(effort, &fingertips::MIDDLE)),
    },
    Study {
        key: "inspire_thumb_force",
        kind: Kind::Prediction,
        title: "Inspire RH56: force of the thumb",
        source: TAN,
        protocol: TAN_PROTOCOL,
        here: TAN_HERE,
        published: Some(12.931),
        theirs: "F = 0.012547 r + 0.384 N, R² 0.993, n = 9: 12.93 N at most, of the bend",
        unit: "N",
        why: TAN_WHY_THUMB,
        measure: |effort| press::against_command(effort, &fingertips::THUMB, fingertips::THUMB_LINE),
        ends: Some(|effort| press_ends(effort, &fingertips::THUMB)),
    },
    Study {
        key: "yale_t42_grip",
        kind: Kind::Calibration,
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
        ends: Some(|effort| pinch_ends(effort, &T42)),
    },
    Study {
        key: "reflex_mass",
        kind: Kind::Calibration,
        title: "ReFlex: mass",
        source: "König: reflex_stack (github.com/axkoenig/reflex_stack), reflex.urdf.xacro, commit 192306ab",
        protocol: "Measured by a user",
        here: "Sum of the links",
        published: Some(0.9),
        theirs: "about 0.9 kg",
        unit: "kg",
        why: "The shares of the links are guesses",
        measure: |_| grips::mass("reflex", 0.9),
        ends: None,
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
