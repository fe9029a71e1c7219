//! Small things are thrown at thin plates: none may pass through.

use super::case::{Case, Finding};
use super::scene::{SceneBuilder, cuboid, set_velocity, weightless};
use super::setup::Setup;
use crate::case_report::Figure;
use crate::random::Random;
use crate::recorder::Recorder;
use anyhow::{Result, bail};
use palmares_models::shape::Shape;
use palmares_models::{Pose, Vec3};

/// Cases of this file.
pub const CASES: &[Case] = &[
    Case::ours("thin_plate", "a spinning rod is thrown 40 times at a free plate of 1 mm", thin_plate),
    Case::ours(
        "thin_things",
        "rods, bars, balls, plates, hulls and discs are thrown at plates of half and of one millimetre",
        thin_things,
    ),
];

/// Edge of the plates, m, and their mass, kg.
const PLATE: (f64, f64) = (0.6, 1.0);

/// Throws of each thing.
const TRIES: usize = 20;

/// Way of a thrown thing in a step of more than a millisecond, m, and its least and largest speed, m/s.
const WAY_M: f64 = 0.01;
const SPEEDS: [f64; 2] = [2.0, 10.0];

/// Distance from the plate at the start, m; every point of a thing is nearer to its centre.
const BEFORE_M: f64 = 0.08;

/// Length of a throw, in multiples of that distance.
const LONG: f64 = 8.0;

/// Something small.
struct Thing {
    mass: f64,
    shape: fn(&mut Random) -> Shape,
}

/// A rod of 62 mm.
const ROD: Thing = Thing { mass: 2e-3, shape: |_| Shape::Capsule { radius: 1e-3, half_length: 0.03 } };

/// Other small things.
const THINGS: &[Thing] = &[
    Thing { mass: 0.5e-3, shape: |_| Shape::Cylinder { radius: 0.5e-3, half_length: 0.03 } },
    Thing { mass: 2e-3, shape: |_| cuboid(2e-3, 0.06, 2e-3) },
    Thing { mass: 0.3e-3, shape: |_| Shape::Sphere { radius: 2e-3 } },
    Thing { mass: 6e-3, shape: |_| cuboid(1e-3, 0.04, 0.06) },
    Thing { mass: 5e-3, shape: |_| Shape::Cylinder { radius: 0.012, half_length: 0.8e-3 } },
    Thing {
        mass: 0.02,
        shape: |random| {
            let point = |random: &mut Random| (random.direction() * Vec3::new(0.02, 0.015, 0.01)).to_array();
            Shape::Hull { points: (0..16).map(|_| point(random)).collect(), rounding: 0.0 }
        },
    },
];

/// Whether a thing thrown at `speed`, m/s, with a `spin`, rad/s, passes through a plate of thickness `thick`,
/// m.
fn passes(
    setup: &Setup,
    recorder: &mut Recorder,
    random: &mut Random,
    thing: &Thing,
    (thick, speed, spin): (f64, f64, f64),
) -> Result<bool> {
    let shape = (thing.shape)(random);
    let way = speed * setup.dt_s;
    // A random place within a step, at least one step farther away than `BEFORE_M`.
    let at = Vec3::new(
        -BEFORE_M - way * random.between(1.0, 2.0),
        random.between(-0.1, 0.1),
        random.between(-0.1, 0.1),
    );
    let (mut engine, command) = SceneBuilder::new(weightless(setup.dt_s))?
        .body(cuboid(thick, PLATE.0, PLATE.0), PLATE.1, 0.5, Pose::IDENTITY)?
        .body(shape, thing.mass, 0.5, Pose::from_parts(at, random.rotation()))?
        .start(setup)?;
    set_velocity(&mut *engine, 1, Vec3::X * speed, random.direction() * spin);
    for _ in 0..(LONG * BEFORE_M / way).ceil() as u32 {
        recorder.step(&mut *engine, &command)?;
        if let Some(fault) = engine.world().and_then(|world| world.fault()) {
            bail!("{fault}");
        }
        let [plate, thing] = [0, 1].map(|k| engine.state().objects[k]);
        let place = plate.inverse_transform_point(thing.translation);
        if place.y.abs().max(place.z.abs()) > 0.45 * PLATE.0 {
            return Ok(false);
        }
        if place.x > thick {
            return Ok(true);
        }
    }
    Ok(false)
}

/// The speed at which things are thrown, m/s.
fn speed(setup: &Setup) -> f64 {
    (WAY_M / setup.dt_s).clamp(SPEEDS[0], SPEEDS[1])
}

/// Number of rods, out of 40 of 2 g, that pass through a free plate of 1 kg, 20 of them with spins of 3 rad/s
/// and 20 with 60: at 10 m/s with steps up to 1 ms, at 2 m/s with 10 ms.
pub fn thin_plate(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut random = Random::new(1);
    let mut through = 0;
    for spin in [3.0, 60.0] {
        for _ in 0..TRIES {
            let throw = (1e-3, speed(setup), spin);
            through += u32::from(passes(setup, recorder, &mut random, &ROD, throw)?);
        }
    }
    Ok(recorder.finding(Figure::bounded("rods that pass through", f64::from(through), "of 40", 0.0)))
}

/// Number of things, out of 280 of 0.3 to 20 g, that pass through: seven kinds, each thrown 20 times at a
/// plate of 1 mm and of half a millimetre, twice as fast as the rods of `thin_plate`, with spins of 60 rad/s.
pub fn thin_things(setup: &Setup, recorder: &mut Recorder) -> Result<Finding> {
    let mut random = Random::new(2);
    let mut through = 0;
    for thing in THINGS.iter().chain([&ROD]) {
        for thick in [1e-3, 0.5e-3] {
            for _ in 0..TRIES {
                let throw = (thick, 2.0 * speed(setup), 60.0);
                through += u32::from(passes(setup, recorder, &mut random, thing, throw)?);
            }
        }
    }
    Ok(recorder.finding(Figure::bounded("things that pass through", f64::from(through), "of 280", 0.0)))
}
