//! The tried grasps: families of objects and their poses in the hand, drawn from a fixed seed.
//!
//! The ranges and the seed were written down before any engine had played a grasp. Every number of a draw is uniform and
//! independent, so that the first n grasps of a family are a sample of it for every n.

use anyhow::{Context, Result, bail};
use palmares_bench::cases::grasp::Grasp;
use palmares_bench::cases::grasp_scene::Lie;
use palmares_bench::random::Random;
use palmares_bench::rigs::softhand;
use palmares_bench::robust::placements;
use palmares_models::catalogue::{Catalogue, Item};
use palmares_models::hand::Hand;
use palmares_models::object::Object;
use palmares_models::shape::Shape;
use palmares_models::{Mat3, Pose, Rotation, Vec3, rotation};
use std::f64::consts::{FRAC_PI_2, FRAC_PI_6};
use std::sync::Arc;

/// Seed of all draws.
const SEED: u64 = 2016;
/// Friction of the drawn objects, that of the grasp cases; those of the catalogue have their own.
const FRICTION: f64 = 0.8;
/// Wall of the cups, m, and the number of slabs it is made of.
const WALL_M: f64 = 0.003;
const WALL_SIDES: usize = 12;
/// Number of objects of the catalogue that are drawn, of those that a hand can close around: no wider across
/// the fingers than this, no flatter, no heavier (m, m, kg).
const CATALOGUE: usize = 20;
const WIDEST_M: f64 = 0.1;
const FLATTEST_M: f64 = 0.02;
const HEAVIEST_KG: f64 = 0.7;
/// Friction of the pedestal.
const PEDESTAL_FRICTION: f64 = 0.5;

/// The hands.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum HandKind {
    /// One motor, 19 coordinates.
    SoftHand,
    /// Four motors, 7 coordinates.
    ReFlex,
}

/// The grip of a hand: a frame with the palm's normal as x, the knuckles along y and the fingers along z; and
/// the range of objects' places in it.
struct Grip {
    hand_from_grip: Rotation,
    along_m: [f64; 2],
    across_m: [f64; 2],
    gap_m: [f64; 2],
}

impl HandKind {
    /// Both.
    pub const ALL: [HandKind; 2] = [HandKind::SoftHand, HandKind::ReFlex];

    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            HandKind::SoftHand => "softhand",
            HandKind::ReFlex => "reflex",
        }
    }

    /// From the command line.
    ///
    /// # Errors
    /// The known names.
    pub fn from_name(name: &str) -> Result<Self> {
        one_of("hand", name, &Self::ALL, |hand| hand.name())
    }

    /// The hand itself, as in the cases.
    ///
    /// # Errors
    /// Never: they are built in.
    pub fn model(self) -> Result<Arc<Hand>> {
        match self {
            HandKind::SoftHand => softhand(),
            HandKind::ReFlex => Hand::builtin(self.name()).context("the hand is built in"),
        }
    }

    /// Around the placements of the grasp cases. The ReFlex' palm looks along z, its fingers 1 and 2 point along x.
    fn grip(self) -> Grip {
        match self {
            HandKind::SoftHand => Grip {
                hand_from_grip: Rotation::IDENTITY,
                along_m: [0.14, 0.175],
                across_m: [-0.03, 0.01],
                gap_m: [0.001, 0.01],
            },
            HandKind::ReFlex => Grip {
                hand_from_grip: rotation::from_rpy([0.0, -FRAC_PI_2, 0.0]),
                along_m: [-0.035, 0.005],
                across_m: [-0.015, 0.015],
                gap_m: [0.001, 0.02],
            },
        }
    }
}

/// The families of objects.
#[derive(Clone, Copy, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub enum Family {
    /// Cylinders, their axis along the knuckles.
    Cylinder,
    /// Boxes, their long side along the knuckles.
    Box,
    /// Discs, flat before the palm.
    Plate,
    /// Balls.
    Ball,
    /// Vessels of a bottom and a ring of slabs, their axis along the knuckles.
    Cup,
    /// Twenty objects of the catalogue, the longest side along the knuckles, the shortest along the palm's normal.
    Catalogue,
    /// The cylinder of the grasp cases at the placements of `robust --placements`.
    CaseCylinder,
    /// The box of the grasp cases at these placements.
    CaseBox,
}

impl Family {
    /// All of them.
    pub const ALL: [Family; 8] = [
        Family::Cylinder,
        Family::Box,
        Family::Plate,
        Family::Ball,
        Family::Cup,
        Family::Catalogue,
        Family::CaseCylinder,
        Family::CaseBox,
    ];
    /// Families with drawn placements.
    pub const DRAWN: [Family; 6] =
        [Family::Cylinder, Family::Box, Family::Plate, Family::Ball, Family::Cup, Family::Catalogue];

    /// As on the command line.
    pub fn name(self) -> &'static str {
        match self {
            Family::Cylinder => "cylinder",
            Family::Box => "box",
            Family::Plate => "plate",
            Family::Ball => "ball",
            Family::Cup => "cup",
            Family::Catalogue => "catalogue",
            Family::CaseCylinder => "case_cylinder",
            Family::CaseBox => "case_box",
        }
    }

    /// From the command line.
    ///
    /// # Errors
    /// The known names.
    pub fn from_name(name: &str) -> Result<Self> {
        one_of("family", name, &Self::ALL, |family| family.name())
    }

    /// One line about it.
    pub fn about(self) -> &'static str {
        match self {
            Family::Cylinder => "radius 25 to 45 mm, 60 to 120 mm long, 50 to 300 g, axis along the knuckles",
            Family::Box => {
                "40 to 70 mm thick and wide, 60 to 140 mm long, 100 to 600 g, long side along the knuckles"
            }
            Family::Plate => {
                "discs of radius 40 to 65 mm, 6 to 16 mm thick, 50 to 300 g, flat before the palm"
            }
            Family::Ball => "radius 25 to 50 mm, 50 to 500 g",
            Family::Cup => {
                "vessels of a bottom and 12 slabs, radius 28 to 34 mm below and 34 to 42 mm above, 80 to 110 mm high, \
                 50 to 300 g, axis along the knuckles"
            }
            Family::Catalogue => {
                "20 objects of the catalogue, the longest side along the knuckles, the shortest along the palm's normal"
            }
            Family::CaseCylinder => {
                "the cylinder of `softhand_cylinder` at the 96 placements of `robust --placements`"
            }
            Family::CaseBox => "the box of `softhand_box` at the 96 placements of `robust --placements`",
        }
    }

    /// Whether it is tried with a hand: the placements of the cases are the SoftHand's.
    pub fn fits(self, hand: HandKind) -> bool {
        hand == HandKind::SoftHand || !matches!(self, Family::CaseCylinder | Family::CaseBox)
    }
}

fn one_of<T: Copy>(what: &str, name: &str, all: &[T], of: impl Fn(T) -> &'static str) -> Result<T> {
    if let Some(it) = all.iter().find(|it| of(**it) == name) {
        return Ok(*it);
    }
    let names: Vec<&str> = all.iter().map(|it| of(*it)).collect();
    bail!("unknown {what} `{name}`; known: {}", names.join(", "))
}

/// A grasp to be tried.
#[derive(Clone, Debug)]
pub struct Trial {
    /// By which hand.
    pub hand: HandKind,
    /// Family of its object.
    pub family: Family,
    /// Its place in the family.
    pub index: usize,
    /// The object, and its pose before the hand.
    pub lie: Lie,
    /// Set point of the fingers' motors.
    pub sigma: f64,
    /// Set point of the preshape drive, if there is one.
    pub preshape: f64,
}

impl Trial {
    /// The first `count` of a family; fewer where it has fewer.
    ///
    /// # Errors
    /// The family is not tried with this hand.
    pub fn of(hand: HandKind, family: Family, count: usize) -> Result<Vec<Trial>> {
        if !family.fits(hand) {
            bail!("family `{}` is the SoftHand's; it has no placements for `{}`", family.name(), hand.name());
        }
        match family {
            Family::CaseCylinder | Family::CaseBox => cases(family, count),
            _ => drawn(hand, family, count),
        }
    }
}

fn cases(family: Family, count: usize) -> Result<Vec<Trial>> {
    let grasp = if family == Family::CaseBox { Grasp::cuboid() } else { Grasp::cylinder() };
    let parts = vec![(Pose::IDENTITY, grasp.shape)];
    let object = Arc::new(Object::new(family.name(), parts, grasp.mass, FRICTION, 0.0)?);
    let trial = |(index, place): (usize, palmares_bench::cases::grasp::Placement)| Trial {
        hand: HandKind::SoftHand,
        family,
        index,
        lie: Lie {
            object: Arc::clone(&object),
            hand_from_grip: Rotation::IDENTITY,
            grip_from_object: grasp.hand_from_object,
            along_m: place.along_m,
            across_m: place.across_m,
            gap_m: 1e-3,
            pedestal_friction: PEDESTAL_FRICTION,
        },
        sigma: place.sigma,
        preshape: 0.0,
    };
    Ok(placements::grid().into_iter().enumerate().map(trial).take(count).collect())
}

fn drawn(hand: HandKind, family: Family, count: usize) -> Result<Vec<Trial>> {
    let seed = SEED * 1000 + 100 * hand as u64 + family as u64;
    let mut random = Random::new(seed);
    let items = if family == Family::Catalogue { items() } else { Vec::new() };
    let grip = hand.grip();
    (0..count)
        .map(|index| {
            let mut within = |[low, high]: [f64; 2]| random.between(low, high);
            let (along_m, across_m, gap_m) =
                (within(grip.along_m), within(grip.across_m), within(grip.gap_m));
            let turn = within([-FRAC_PI_6, FRAC_PI_6]);
            let (sigma, preshape) = (within([0.6, 1.0]), within([0.0, 0.6]));
            let sizes = [within([0.0, 1.0]), within([0.0, 1.0]), within([0.0, 1.0])];
            let mass = within([0.0, 1.0]);
            let (object, upright) = object(family, sizes, mass, &items, index)?;
            Ok(Trial {
                hand,
                family,
                index,
                lie: Lie {
                    object,
                    hand_from_grip: grip.hand_from_grip,
                    grip_from_object: rotation::from_rpy([turn, 0.0, 0.0]) * upright,
                    along_m,
                    across_m,
                    gap_m,
                    pedestal_friction: PEDESTAL_FRICTION,
                },
                sigma,
                preshape,
            })
        })
        .collect()
}

/// The object, and its rotation before the one about the palm's normal. `sizes` and `mass` are in [0, 1).
fn object(
    family: Family,
    sizes: [f64; 3],
    mass: f64,
    items: &[&Arc<Item>],
    index: usize,
) -> Result<(Arc<Object>, Rotation)> {
    let part = |k: usize, low: f64, high: f64| low + (high - low) * sizes[k];
    let mass = |low: f64, high: f64| low * libm::pow(high / low, mass);
    let along_knuckles = rotation::from_rpy([FRAC_PI_2, 0.0, 0.0]);
    let single = |shape: Shape, mass: f64| -> Result<Arc<Object>> {
        Ok(Arc::new(Object::new(family.name(), vec![(Pose::IDENTITY, shape)], mass, FRICTION, 0.0)?))
    };
    Ok(match family {
        Family::Cylinder | Family::CaseCylinder => {
            let shape = Shape::Cylinder { radius: part(0, 0.025, 0.045), half_length: part(1, 0.03, 0.06) };
            (single(shape, mass(0.05, 0.3))?, along_knuckles)
        }
        Family::Box | Family::CaseBox => {
            let half_extents = [part(0, 0.02, 0.035), part(1, 0.03, 0.07), part(2, 0.02, 0.035)];
            (single(Shape::Box { half_extents, rounding: 0.0 }, mass(0.1, 0.6))?, Rotation::IDENTITY)
        }
        Family::Plate => {
            let shape = Shape::Cylinder { radius: part(0, 0.04, 0.065), half_length: part(1, 0.003, 0.008) };
            (single(shape, mass(0.05, 0.3))?, rotation::from_rpy([0.0, FRAC_PI_2, 0.0]))
        }
        Family::Ball => {
            (single(Shape::Sphere { radius: part(0, 0.025, 0.05) }, mass(0.05, 0.5))?, Rotation::IDENTITY)
        }
        Family::Cup => {
            let (bottom, top, height) = (part(0, 0.028, 0.034), part(1, 0.034, 0.042), part(2, 0.08, 0.11));
            (cup(bottom, top, height, mass(0.05, 0.3))?, along_knuckles)
        }
        Family::Catalogue => {
            let item = items[index % items.len()];
            (Arc::clone(&item.object), longest_along_knuckles(item.size))
        }
    })
}

/// A vessel as the catalogue writes one, its frame in the middle of its bounds.
fn cup(bottom: f64, top: f64, height: f64, mass: f64) -> Result<Arc<Object>> {
    let low = -0.5 * height;
    let text = format!(
        "source = 'drawn'\n[[object]]\nid = 'cup'\nname = 'cup'\ncategory = 'kitchen'\nmass = {mass:?}\n\
         friction = {FRICTION:?}\ncolor = [0.5, 0.5, 0.5]\nparts = [\n\
         {{ shape = 'cylinder', radius = {bottom:?}, height = {WALL_M:?}, at = [0.0, 0.0, {:?}] }},\n\
         {{ shape = 'wall', sides = {WALL_SIDES}, bottom = {bottom:?}, top = {top:?}, height = {:?}, \
         thickness = {WALL_M:?}, at = [0.0, 0.0, {:?}] }},\n]\n",
        low + 0.5 * WALL_M,
        height - WALL_M,
        low + WALL_M,
    );
    let catalogue = Catalogue::parse("the drawn cup", &text)?;
    Ok(Arc::clone(&catalogue.get("cup").context("it was just parsed")?.object))
}

/// The drawn objects of the catalogue: the same for both hands.
pub fn items() -> Vec<&'static Arc<Item>> {
    let fits = |item: &&Arc<Item>| {
        let mut size = item.size;
        size.sort_by(f64::total_cmp);
        size[1] <= WIDEST_M && size[0] >= FLATTEST_M && item.object.mass <= HEAVIEST_KG
    };
    let mut left: Vec<&Arc<Item>> = Catalogue::builtin().items().iter().filter(fits).collect();
    let mut random = Random::new(SEED);
    let mut drawn = Vec::new();
    while drawn.len() < CATALOGUE && !left.is_empty() {
        drawn.push(left.remove(random.below(left.len())));
    }
    drawn
}

/// Turns the longest side to y, the shortest to x.
fn longest_along_knuckles(size: [f64; 3]) -> Rotation {
    let mut order = [0, 1, 2];
    order.sort_by(|a, b| size[*a].total_cmp(&size[*b]));
    let axis = |k: usize| Vec3::from_array([0, 1, 2].map(|j| f64::from(u8::from(j == k))));
    let (short, middle, long) = (axis(order[0]), axis(order[1]), axis(order[2]));
    // Its rows are the sources of x, y and z of the grip; z with the sign that makes it a rotation.
    let middle = if long.cross(middle).dot(short) < 0.0 { -middle } else { middle };
    Rotation::from_mat3(&Mat3::from_cols(short, long, middle).transpose()).normalize()
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_first_grasps_of_a_family_are_the_same_however_many_are_drawn() {
        for hand in HandKind::ALL {
            for family in Family::DRAWN {
                let (few, many) = (Trial::of(hand, family, 3), Trial::of(hand, family, 24));
                let (few, many) = (few.expect("drawn"), many.expect("drawn"));
                assert_eq!(many.len(), 24);
                for (a, b) in few.iter().zip(&many) {
                    assert_eq!(a.lie.along_m.to_bits(), b.lie.along_m.to_bits());
                    assert_eq!(a.lie.object.mass.to_bits(), b.lie.object.mass.to_bits());
                    assert_eq!(a.lie.grip_from_object, b.lie.grip_from_object);
                }
                assert_ne!(many[0].sigma, many[1].sigma);
            }
        }
    }

    #[test]
    fn hands_and_families_draw_their_own_numbers() {
        let mut closures = Vec::new();
        for hand in HandKind::ALL {
            for family in Family::DRAWN {
                closures.push(Trial::of(hand, family, 1).expect("drawn")[0].sigma.to_bits());
            }
        }
        let count = closures.len();
        closures.sort_unstable();
        closures.dedup();
        assert_eq!(closures.len(), count);
    }

    #[test]
    fn objects_of_the_catalogue_lie_with_the_longest_side_along_the_knuckles() {
        assert_eq!(items().len(), CATALOGUE);
        for item in items() {
            let turned = longest_along_knuckles(item.size) * Vec3::from_array(item.size);
            let [x, y, z] = turned.abs().to_array();
            assert!(
                x <= z + 1e-12 && z <= y + 1e-12,
                "{}: {:?} became {turned:?}",
                item.object.name,
                item.size
            );
        }
    }

    #[test]
    fn a_hand_that_a_family_does_not_fit_is_refused() {
        let error = Trial::of(HandKind::ReFlex, Family::CaseBox, 1).expect_err("refused").to_string();
        assert!(error.contains("case_box") && error.contains("reflex"), "{error}");
        let error = Family::from_name("boxes").expect_err("refused").to_string();
        assert!(error.contains("known: cylinder, box"), "{error}");
    }
}
