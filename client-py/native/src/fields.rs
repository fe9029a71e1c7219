//! An observation as a row of numbers: its fields for a task, a hand and a sensing, and their values. First come the channels of
//! the hand, as they are declared.

use palmares_models::hand::Hand;
use palmares_models::shape::Shape;
use palmares_senses::{CHANNELS, Channel};
use palmares_tasks::scene::SceneBody;
use palmares_tasks::{Run, Sensing, Task};
use std::iter::repeat_n;

/// A field of an observation.
#[derive(Clone, Debug)]
pub(crate) struct Field {
    pub(crate) name: &'static str,
    /// Shape in one world.
    pub(crate) shape: Vec<usize>,
    /// Numbers of one world.
    pub(crate) len: usize,
}

/// All fields, in the order in which a row has them; `drawn` numbers of the hand are drawn for each run.
pub(crate) fn fields(task: &Task, hand: &Hand, sensing: Sensing, drawn: usize) -> Vec<Field> {
    let objects = task.objects.count;
    let channels = CHANNELS.iter().filter(|channel| is_shown(channel, sensing));
    let mut shapes: Vec<_> = channels.map(|channel| (channel.name, channel.shape(hand))).collect();
    shapes.push(("time_left", vec![1]));
    shapes.push(("arm", vec![2, task.arm.as_ref().map_or(0, |carrier| carrier.arm().joints.len())]));
    if sensing == Sensing::Truth {
        shapes.extend([
            ("joints", vec![2, hand.coordinates.len()]),
            ("objects", vec![objects, 13]),
            ("object_kind", vec![objects]),
            ("object_half_extents", vec![objects, 3]),
            ("object_mass", vec![objects]),
            ("hand_drawn", vec![drawn]),
        ]);
    }
    let fields = shapes.into_iter().map(|(name, shape)| {
        let len = shape.iter().product();
        Field { name, shape, len }
    });
    fields.filter(|field| field.len > 0).collect()
}

/// The fields that do not change in a run: the last ones. Objects that the run lacks of `objects` have kind −1, and zeros as size
/// and mass. `drawn` are the drawn numbers of the hand.
pub(crate) fn constant(run: &Run, sensing: Sensing, objects: usize, drawn: &[f64]) -> Vec<f64> {
    if sensing == Sensing::Sensors {
        return Vec::new();
    }
    let free: Vec<&SceneBody> = run.scene().bodies.iter().filter(|body| body.free).collect();
    let missing = objects.saturating_sub(free.len());
    let mut row: Vec<f64> = free.iter().map(|body| kind(body)).collect();
    row.extend(repeat_n(-1.0, missing));
    row.extend(free.iter().flat_map(|body| body.half_extents()));
    row.extend(repeat_n(0.0, 3 * missing));
    row.extend(free.iter().map(|body| body.mass));
    row.extend(repeat_n(0.0, missing));
    row.extend(drawn);
    row
}

/// Writes a run's fields one after the other; `constant` are the last. Objects that the run lacks of `objects` are zeros.
pub(crate) fn write(run: &Run, sensing: Sensing, objects: usize, constant: &[f64], row: &mut Vec<f64>) {
    let (state, table) = (run.world().state(), run.sensor_table());
    row.clear();
    row.resize(table.dimension(), 0.0);
    run.read_sensors_into(row);
    for hidden in table.entries().iter().rev().filter(|entry| !is_shown(entry.channel, sensing)) {
        row.drain(hidden.address..hidden.address + hidden.dimension);
    }
    row.push(run.task().time_limit_s - run.sim_time_s());
    if let Some(arm) = run.arm_reading() {
        row.extend(arm.position);
        row.extend(arm.velocity);
    }
    if sensing == Sensing::Truth {
        let joints = run.hand().coordinates.len();
        row.extend_from_slice(&state.q);
        row.extend_from_slice(&state.v[6..6 + joints]);
        let mut missing = objects;
        for object in run.object_states() {
            missing = missing.saturating_sub(1);
            row.extend(object.position);
            row.extend(object.quat_xyzw);
            row.extend(object.linear);
            row.extend(object.angular);
        }
        row.extend(repeat_n(0.0, 13 * missing));
    }
    row.extend_from_slice(constant);
}

fn is_shown(channel: &Channel, sensing: Sensing) -> bool {
    !channel.truth || sensing == Sensing::Truth
}

/// 0 sphere, 1 capsule, 2 cylinder, 3 box, 4 hull, 5 several parts.
fn kind(body: &SceneBody) -> f64 {
    match body.parts.as_slice() {
        [part] => match part.shape {
            Shape::Sphere { .. } => 0.0,
            Shape::Capsule { .. } => 1.0,
            Shape::Cylinder { .. } => 2.0,
            Shape::Box { .. } => 3.0,
            Shape::Hull { .. } => 4.0,
        },
        _ => 5.0,
    }
}
