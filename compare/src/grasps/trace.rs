//! The trace of one grasp.

use crate::trials::family::Trial;
use crate::trials::play::{in_palm, play};
use anyhow::Result;
use palmares_bench::cases::Setup;
use palmares_bench::engine::Engine;
use palmares_models::{Pose, Vec3};
use palmares_sim::Owner;
use std::collections::BTreeMap;
use std::fmt::Write;

/// Plays a grasp and prints, every `every_ms`, the object's place in the palm and the force of each link.
///
/// # Errors
/// The engine fails.
pub(super) fn trace(setup: &Setup, trial: &Trial, every_ms: f64) -> Result<()> {
    println!(
        "# {} {} {}: {:.0} g, along {:.1} mm, across {:.1} mm, gap {:.1} mm, sigma {:.3}, preshape {:.3}",
        trial.hand.name(),
        trial.family.name(),
        trial.index,
        1e3 * trial.lie.object.mass,
        1e3 * trial.lie.along_m,
        1e3 * trial.lie.across_m,
        1e3 * trial.lie.gap_m,
        trial.sigma,
        trial.preshape
    );
    for (_, shape) in &trial.lie.object.parts {
        println!("# {shape:?}");
    }
    println!(
        "# {} ({}) at {} ms. Object's centre in the palm, mm, and its turn since the start, degrees; tension; deepest \
         contact, mm; of every link that touches it: normal and tangential force, N, and points",
        setup.engine.name(),
        setup.engine.settings(),
        1e3 * setup.dt_s
    );
    let mut start = None;
    let every_s = 1e-3 * every_ms;
    let fate = play(setup, trial, |t, engine| {
        let begin = *start.get_or_insert_with(|| in_palm(engine.state()));
        if (t / every_s + 1e-6).floor() > ((t - setup.dt_s) / every_s + 1e-6).floor() {
            println!("{}", line(t, engine, &begin)?);
        }
        Ok(())
    })?;
    println!("# {fate:?}");
    Ok(())
}

fn line(t: f64, engine: &mut dyn Engine, begin: &Pose) -> Result<String> {
    let contacts = engine.contacts()?;
    let state = engine.state();
    let now = in_palm(state);
    let turn = (now.rotation * begin.rotation.inverse()).to_scaled_axis() * (180.0 / std::f64::consts::PI);
    let at = now.translation * 1e3;
    let mut line = format!(
        "{t:.4} at {:+.2} {:+.2} {:+.2} turn {:+.2} {:+.2} {:+.2} f",
        at.x, at.y, at.z, turn.x, turn.y, turn.z
    );
    for tension in &state.tension {
        let _ = write!(line, " {tension:.3}");
    }
    let touches_object = |owner: Owner| matches!(owner, Owner::Object(_));
    let mut links: BTreeMap<String, (f64, Vec3, usize)> = BTreeMap::new();
    let mut deepest = f64::INFINITY;
    for contact in contacts.iter().filter(|it| touches_object(it.a) != touches_object(it.b)) {
        let other = if touches_object(contact.a) { contact.b } else { contact.a };
        let name = match (other, engine.model().hand()) {
            (Owner::Link(i), Some(hand)) => hand.links[i].name.clone(),
            _ => "pedestal".to_owned(),
        };
        let normal = contact.force.dot(contact.normal);
        let tangential = contact.force - contact.normal * normal;
        let sum = links.entry(name).or_insert((0.0, Vec3::ZERO, 0));
        *sum = (sum.0 + normal, sum.1 + tangential, sum.2 + 1);
        deepest = deepest.min(contact.distance);
    }
    let _ = write!(line, " deep {:.3} |", 1e3 * (-deepest).max(0.0));
    for (name, (normal, tangential, points)) in links {
        let _ = write!(line, " {name} {normal:.2} {:.2} {points};", tangential.length());
    }
    Ok(line)
}
