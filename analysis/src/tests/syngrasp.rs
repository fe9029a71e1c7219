//! The basic example of SynGrasp 2.2 (Malvezzi, Gioioso, Salvietti and Prattichizzo, "SynGrasp: A MATLAB Toolbox for
//! Underactuated and Compliant Hands", IEEE Robotics & Automation Magazine 22(4), 2015; file `examples/Basic/example.m`): the paradigmatic hand of
//! 20 joints in the mean posture of Santello's synergies holds an object with five fingertips, driven by four soft synergies. The numbers
//! below are the results of its functions under Octave, to twelve digits, without the joint of the palm that it adds. Its units are mm, N/mm and N·mm/rad.

use crate::contact::{Contact, ContactModel, LinkContact};
use crate::grasp::Grasp;
use crate::hand::CompliantHand;
use crate::quasistatic::QuasiStatic;
use nalgebra::DMatrix;
use palmares_models::hand::{Coordinate, CoordinateSettings, Hand, Hinge, HingeKind, Joint, Link};
use palmares_models::{Pose, Rotation, Vec3};
use palmares_sim::dynamics::tree::Kinematics;
use std::f64::consts::FRAC_PI_2;

/// Joint angles, thumb first.
#[rustfmt::skip]
const Q: [f64; 20] = [
    -0.982586568482, 1.75956782011, -0.43046272156, 0.0915916834714,
    0.453336367602, 0.466532040031, 1.05978850391, 0.706525669275,
    0.0, 0.49539757347, 1.06006689622, 0.706711264147,
    -0.222911116765, 0.59139068233, 1.26814640166, 0.845430934439,
    -0.52827306232, 0.839388448882, 1.15132364855, 0.767549099033,
];
/// Synergies, 20 × 4.
#[rustfmt::skip]
const S: [f64; 80] = [
    -0.078923305969, 0.0961555713221, -0.0708411703142, 0.0555374754073,
    0.25275887825, -0.071506210569, 0.0140026151076, -0.877539055456,
    0.17350813288, -0.168170570205, 0.0341202020911, -0.213807098937,
    -0.0524455023023, 0.088755655964, 0.0174704927532, -0.130985054519,
    0.143787914829, -0.0130894793109, 0.582211661058, -0.0360127750285,
    -0.242862013802, -0.218255387208, -0.150803307006, -0.219308296327,
    -0.232163977778, 0.260380285949, -0.0722360217018, -0.241441414237,
    -0.154775985185, 0.173586857299, -0.0481573478012, -0.160960942825,
    0.0, 0.0, 0.0, 0.0,
    -0.341985305463, -0.206203661688, -0.163697818187, -0.0814342115362,
    -0.196034034444, 0.31760715846, 0.039661546732, -0.140493197351,
    -0.130689356296, 0.21173810564, 0.0264410311547, -0.0936621315674,
    -0.200510119638, 0.0888565898107, -0.469603984087, -0.0805828102502,
    -0.385865634415, -0.39218038754, 0.126194952575, -0.042055703347,
    -0.303494604576, 0.282997398665, 0.146793429626, -0.136324324017,
    -0.202329736384, 0.188664932443, 0.0978622864171, -0.090882882678,
    -0.355217987462, 0.0500233571752, -0.823430261468, -0.0712846812204,
    -0.352162755888, -0.521897044409, 0.295467700689, -0.00440258544545,
    -0.423000508104, 0.418103024729, 0.357099931325, -0.0544144237986,
    -0.282000338736, 0.278735349819, 0.238066620883, -0.0362762825324,
];
/// Contact points, mm.
#[rustfmt::skip]
const POINTS: [f64; 15] = [
    -36.4407287591, 46.4724233006, -48.7885545589,
    -35.0187102843, 95.6174864331, -58.4436306197,
    -8.0, 97.888577734, -67.1073881058,
    9.89700404405, 81.3687129786, -55.729437817,
    23.2779398738, 71.7627473129, -46.6625435935,
];
/// Origin of the object's frame, mm.
const CENTRE: [f64; 3] = [-9.25689902511, 78.6219895519, -55.346310939];
/// `SGgraspStiffness`
#[rustfmt::skip]
const STIFFNESS: [f64; 36] = [
    0.217422846814, -0.122743251895, 0.000255890348389, 1.06442963411, 1.60942155856, -2.26910568216,
    -0.122743251895, 0.0768280188996, -0.00446481252071, -0.521269195457, -1.12635041392, 1.03194329118,
    0.000255890348389, -0.00446481252071, 0.042114123283, -1.22880415464, 1.06120296521, 0.155872477252,
    1.06442963411, -0.521269195457, -1.22880415464, 47.4708934721, -25.2260943914, -14.2284777102,
    1.60942155856, -1.12635041392, 1.06120296521, -25.2260943914, 48.1877587778, -14.0976902814,
    -2.26910568216, 1.03194329118, 0.155872477252, -14.2284777102, -14.0976902814, 46.5671571677,
];
/// `SGquasistaticMaps`: object motion per command of a synergy.
#[rustfmt::skip]
const OBJECT: [f64; 24] = [
    3.07423711872, 0.534757982799, -1.46832925967, 3.41740808295,
    6.01841995647, 1.20851862021, -2.77626219478, 5.72980773529,
    -1.8910906926, 8.79897620266, 2.10473787882, -2.09737448059,
    0.0299337958975, 0.169144033955, -0.0208589552495, 0.0139663140922,
    0.11245980253, -0.100744092209, -0.10936397015, 0.0868025966652,
    0.0860838821248, -0.0077483690939, -0.0212527667437, 0.0834928001699,
];
/// `SGquasistaticMaps`: contact forces per command.
#[rustfmt::skip]
const FORCES: [f64; 60] = [
    -0.00482432362205, -0.00150413612777, -0.00158347243676, 0.00532442277908,
    -0.000660866137102, 0.00536143834307, 0.00323721676446, 0.00420127308385,
    0.00118241758929, -0.00189820738457, -0.000395796197902, 3.53017310596e-05,
    -0.00766459045149, -0.00374864979175, -0.00941808917641, -0.0044996572564,
    0.000228978159347, -0.00213197806997, -0.0040255431477, 0.00164781292892,
    -0.00466277407573, -0.000707395855204, 0.00348342575378, -0.00381122807594,
    -0.000149967445303, -0.00301221349536, -0.000366476468515, -0.00126989393866,
    0.00171862926064, -0.000843258405212, 0.000597913703531, 0.000606259376014,
    0.00258697213282, -0.00169502366029, 0.00123668699216, 0.000854935762006,
    -0.000544052505589, -0.00907196083004, 0.0354693294926, -0.0138936615594,
    0.00316379033102, 0.00356545328508, -0.00925729224142, 0.00319220151014,
    0.000877655084181, 0.00122669667549, -0.00137018485466, -2.19108961117e-05,
    0.0131829340244, 0.0173369602449, -0.024101291411, 0.0143387899753,
    -0.0044505316139, -0.00595165515297, 0.00944770492112, -0.00964754689892,
    1.57292694451e-05, 0.00307393022459, -0.00295413169338, 0.00294290147899,
];
/// `SGquasistaticMaps`: joint motion per command.
#[rustfmt::skip]
const JOINTS: [f64; 80] = [
    -0.0476708404206, 0.0733287583025, -0.0354583215528, 0.0313632381818,
    -0.143661458901, 0.0560683939445, 0.0639642875206, -0.18013595603,
    -0.0137591953125, -0.110288355112, 0.0183019782162, 0.0559114794168,
    -0.0693488889932, 0.0378786770955, -0.00747037326099, -0.0942694874477,
    -0.112633982671, -0.0684257378046, 0.0677865315714, -0.124724253186,
    -0.0617007544172, -0.225715014067, 0.0341278399335, -0.0315797268615,
    0.022393386974, 0.237443215674, -0.00021293386564, -0.00362930432717,
    -0.0237262418254, 0.165506344147, -0.0220591263264, -0.0426753635048,
    -0.003732476421, -0.0749697097287, -0.00912107807347, -0.0316058540072,
    -0.0183681222954, -0.285401940714, -0.0221954468441, -0.000339598542824,
    -0.0824730879446, 0.275729019382, 0.0835928907941, -0.101750920757,
    -0.0978485110594, 0.206542488188, 0.0394784200655, -0.0827265409201,
    -0.119658367521, -0.0374788018371, 0.0689965776268, -0.16794043944,
    -0.0548399611328, -0.234395162588, -0.0240885249404, -0.0475817280004,
    -0.120491994951, 0.30467411543, 0.117978262493, -0.132061424353,
    -0.129886411955, 0.179440163707, 0.0973056901548, -0.0887786665435,
    -0.203833139924, -0.0442485357178, -0.407178251235, -0.0570286933937,
    -0.0772238391461, -0.266397776454, -0.0474506409316, -0.0826026694806,
    -0.205941701441, 0.454668167276, 0.212702275791, -0.200407038438,
    -0.176370852629, 0.264221071225, 0.186585948251, -0.10726683499,
];
/// `SGquasistaticMaps`: synergies per command.
#[rustfmt::skip]
const INPUTS: [f64; 16] = [
    0.591290397532, -0.0245418406399, -0.0408360956588, 0.0935684146371,
    -0.0245418406498, 0.892516665702, 0.0915326583163, -0.0491759984662,
    -0.0408360956623, 0.091532658313, 0.567101152459, -0.0570152492691,
    0.0935684146503, -0.0491759984795, -0.0570152492767, 0.611250922781,
];

/// Base position, three joints and the last length of a finger.
type Finger = ([f64; 2], [(f64, f64); 3], f64);

/// Each finger: x and y of its base, the twist and length of its first three links (Denavit and Hartenberg), the length of the last, mm.
const FINGERS: [Finger; 5] = [
    ([-37.0, 45.0], [(-FRAC_PI_2, 0.0), (0.0, 25.0), (FRAC_PI_2, 15.0)], 10.0),
    ([-24.0, 73.0], [(-FRAC_PI_2, 0.0), (0.0, 37.0), (0.0, 30.0)], 15.0),
    ([-8.0, 73.0], [(-FRAC_PI_2, 0.0), (0.0, 40.0), (0.0, 35.0)], 17.0),
    ([8.0, 73.0], [(-FRAC_PI_2, 0.0), (0.0, 37.0), (0.0, 30.0)], 15.0),
    ([24.0, 73.0], [(-FRAC_PI_2, 0.0), (0.0, 27.0), (0.0, 25.0)], 10.0),
];

fn paradigmatic_hand() -> Hand {
    let mut hand = Hand::clone(&Hand::builtin("pinch").expect("it is built in"));
    let mut palm = hand.links[0].clone();
    palm.geoms.clear();
    hand.links = vec![palm.clone()];
    hand.coordinates.clear();
    hand.tendons.clear();
    hand.motors.clear();
    for (finger, ([x, y], links, _)) in FINGERS.iter().enumerate() {
        let mut fixed = Pose::from_parts(Vec3::new(*x, *y, 0.0), Rotation::from_rotation_z(FRAC_PI_2));
        let mut parent = 0;
        for joint in 0..4 {
            let name = format!("finger_{finger}_{joint}");
            let coordinate = hand.coordinates.len();
            let hinge = Hinge {
                parent_from_hinge: fixed,
                axis: Vec3::Z,
                kind: HingeKind::Revolute,
                ratio: 1.0,
                offset: 0.0,
            };
            hand.links.push(Link {
                name: name.clone(),
                parent: Some(parent),
                joint: Some(Joint { name: name.clone(), coordinate, hinges: vec![hinge] }),
                ..palm.clone()
            });
            let stated = CoordinateSettings { stiffness: Some(1.0), ..CoordinateSettings::default() };
            hand.coordinates.push(Coordinate { name, lower: -3.0, upper: 3.0, numbers: stated.numbers() });
            parent = hand.links.len() - 1;
            if let Some((twist, length)) = links.get(joint) {
                fixed = Pose::from_parts(Vec3::new(*length, 0.0, 0.0), Rotation::from_rotation_x(*twist));
            }
        }
    }
    hand
}

#[test]
fn synergies_and_stiffness_are_those_of_syngrasp() {
    let hand = paradigmatic_hand();
    let mut kin = Kinematics::default();
    kin.update(&hand, Pose::IDENTITY, &Q);
    let contact = |finger: usize| {
        let tip = 4 * (finger + 1);
        // The fingertips are where the example has its contacts.
        let point = kin.pose[tip].transform_point(Vec3::new(FINGERS[finger].2, 0.0, 0.0));
        let expected = Vec3::from_slice(&POINTS[3 * finger..3 * finger + 3]);
        assert!((point - expected).length() < 1e-9, "{finger}: {point} {expected}");
        // SynGrasp has contact forces in world axes.
        let world = Contact {
            point,
            normal: Vec3::X,
            tangent: Vec3::Y,
            model: ContactModel::HardFinger,
            friction: 0.8,
            arm: 0.0,
        };
        LinkContact::fixed_to(tip, &world, &hand, &kin)
    };
    let contacts: Vec<LinkContact> = (0..5).map(contact).collect();
    let object = Pose::from_translation(Vec3::from_slice(&CENTRE));
    let grasp = Grasp::new(&hand, Pose::IDENTITY, &Q, &contacts, object).expect("contacts of the hand");
    let soft = CompliantHand::soft_synergies(
        &DMatrix::from_row_slice(20, 4, &S),
        &DMatrix::identity(20, 20),
        &DMatrix::identity(4, 4),
    )
    .expect("a hand");
    let found =
        QuasiStatic::new(&soft, &grasp.g, &grasp.j, &DMatrix::identity(15, 15), None).expect("a grasp");
    let same = |found: &DMatrix<f64>, expected: &[f64], name: &str| {
        let expected = DMatrix::from_row_slice(found.nrows(), found.ncols(), expected);
        let size = expected.amax();
        let worst = (found - expected).amax() / size;
        assert!(worst < 1e-9, "{name}: {worst}");
    };
    same(&found.object_stiffness, &STIFFNESS, "grasp stiffness");
    same(&found.object_per_input, &OBJECT, "object motion");
    same(&found.forces_per_input, &FORCES, "contact forces");
    same(&found.joints_per_input, &JOINTS, "joint motion");
    // z = z_ref − η, with K_z = 1.
    same(&(DMatrix::identity(4, 4) - &found.tension_per_input), &INPUTS, "synergies");
    // Four synergies control four directions of the nine of the internal forces (Prattichizzo et al. 2013).
    assert_eq!(found.internal_forces().ncols(), 9);
    assert_eq!(found.controllable_internal_forces().ncols(), 4);
    assert!((&grasp.g * found.controllable_internal_forces()).amax() < 1e-9);
}
