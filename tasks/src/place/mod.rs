//! Objects of a run and their initial poses.

mod fixed;
mod placed;
mod pour;
mod rng;
mod scatter;

pub use placed::Placed;
pub use pour::drop_points;
pub use rng::SceneRng;

use crate::task::{DrawableObject, Placing, Task};
use palmares_models::Pose;
use palmares_models::object::Object;
use std::sync::Arc;

/// Draws a task's objects and places them; says what did not work out, if it did not.
pub fn place(task: &Task, dice: &mut SceneRng) -> Result<Vec<Placed>, String> {
    let mut chosen = draw(task, dice);
    if let Some(variation) = task.variation() {
        for (k, placed) in chosen.iter_mut().enumerate() {
            (placed.object, placed.pose) = variation.object(k, &placed.object);
        }
    }
    let poses = match &task.place {
        Placing::Pour(pour) => pour::pour(task, pour, &chosen, dice),
        Placing::Scatter(scatter) => scatter::scatter(task, scatter, &chosen, dice)?,
        Placing::Fixed(list) => fixed::fixed(list, &chosen, dice),
    };
    for (placed, pose) in chosen.iter_mut().zip(poses) {
        placed.pose = pose;
    }
    Ok(chosen)
}

/// Lowest and highest corner of the volume in which any seed may place objects, m. It is as wide as their region, and as high as
/// the tallest object or its drop. With `place.fixed` it is the union of what each object can fill.
pub fn placing_room(task: &Task) -> Option<([f64; 3], [f64; 3])> {
    let sizes = task.objects.kinds.iter().map(|kind| {
        let (min, max) = kind.object.bounds();
        max - min
    });
    let (into, top) = match &task.place {
        Placing::Scatter(scatter) => (&scatter.into, sizes.map(|size| size.z).fold(0.0, f64::max)),
        Placing::Pour(pour) => {
            let layers = task.objects.count.div_ceil(pour.layer.max(1));
            let half = sizes.map(|size| 0.5 * size.length()).fold(0.0, f64::max);
            let top = pour.first_height + pour.layer_height * layers.saturating_sub(1) as f64 + half;
            (&pour.into, top)
        }
        Placing::Fixed(list) => return fixed::room(list, &task.objects.kinds),
    };
    let (low, mut high) = task.region(into)?;
    high[2] = low[2] + top;
    Some((low, high))
}

/// The objects of a run, in the order of the scene.
fn draw(task: &Task, dice: &mut SceneRng) -> Vec<Placed> {
    let (kinds, count) = (&task.objects.kinds, task.objects.count);
    let placed = |object: Arc<Object>, kind: &DrawableObject| Placed {
        object,
        pose: Pose::IDENTITY,
        color: kind.color,
    };
    if let (Some(equal), [kind]) = (&task.objects.equal, kinds.as_slice()) {
        return (0..count)
            .map(|k| {
                let object = Object { name: format!("{}_{k}", equal.name), ..(*kind.object).clone() };
                placed(Arc::new(object), kind)
            })
            .collect();
    }
    // All of them: nothing to draw.
    if kinds.len() == count {
        return kinds.iter().map(|kind| placed(Arc::clone(&kind.object), kind)).collect();
    }
    let mut left: Vec<&DrawableObject> = kinds.iter().collect();
    (0..count.min(left.len()))
        .map(|_| {
            let kind = left.remove(dice.below(left.len()));
            placed(Arc::clone(&kind.object), kind)
        })
        .collect()
}
