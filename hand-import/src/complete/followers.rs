//! Springs, tendons and motors of a joint that follows another belong to its leader: only leaders are coordinates of a hand.
//!
//! With `x = offset + ratio y` for the follower's coordinate x and the leader's y, each law of x is one of y: a spring of
//! stiffness k has ratio² k at y, a moment arm r is ratio r, and a constant part moves to the length at which it is slack.

use std::collections::BTreeMap;

use palmares_models::hand::path::{Table, TablePoints, TendonPath as HandPath};

use crate::decision::{At, Log};
use crate::draft::{Draft, Drive, JointKind, TendonPath};

/// The law of a joint that follows another.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct Follows {
    pub(super) ratio: f64,
    pub(super) offset: f64,
}

/// Moves all laws of followers to the joints that lead them, also through other followers.
pub(super) fn complete(draft: &mut Draft, log: &mut Log) {
    for (joint, leader, law) in laws(draft) {
        relocate(draft, (&joint, &leader, law), log);
    }
}

/// Every follower with its last leader.
fn laws(draft: &Draft) -> Vec<(String, String, Follows)> {
    let by_joint: BTreeMap<&str, (&str, Follows)> = draft
        .couplings
        .iter()
        .map(|c| {
            let law = Follows { offset: c.coefficients[0], ratio: c.coefficients[1] };
            (c.joint.as_str(), (c.leader.as_str(), law))
        })
        .collect();
    let last = |joint: &str| {
        let (mut leader, mut law) = *by_joint.get(joint)?;
        for _ in 0..by_joint.len() {
            let Some(&(next, of)) = by_joint.get(leader) else { break };
            law = Follows { offset: law.offset + law.ratio * of.offset, ratio: law.ratio * of.ratio };
            leader = next;
        }
        Some((joint.to_owned(), leader.to_owned(), law))
    };
    draft.couplings.iter().filter_map(|c| last(&c.joint)).collect()
}

/// Moves the spring, the tendons and the motor of one joint to another.
pub(super) fn relocate(draft: &mut Draft, (joint, leader, law): (&str, &str, Follows), log: &mut Log) {
    spring(draft, (joint, leader, law), log);
    for spring in &mut draft.springs {
        let Some(at) = spring.joints.iter().position(|(name, _)| name == joint) else { continue };
        let (_, weight) = spring.joints.remove(at);
        spring.numbers.rest -= weight * law.offset;
        match spring.joints.iter_mut().find(|(name, _)| name == leader) {
            Some((_, own)) => *own += law.ratio * weight,
            None => spring.joints.insert(at, (leader.to_owned(), law.ratio * weight)),
        }
        let text = format!("joint '{joint}' follows '{leader}', which gets its weight");
        log.taken(At::Hand, format!("spring '{}'", spring.name), text);
    }
    for index in 0..draft.tendons.len() {
        tendon(draft, index, (joint, leader, law), log);
    }
    motor(draft, (joint, leader, law), log);
}

fn spring(draft: &mut Draft, (joint, leader, law): (&str, &str, Follows), log: &mut Log) {
    let Some(own) = draft.joints.iter_mut().find(|other| other.name == joint) else { return };
    let own = &mut own.stated;
    let (stiffness, rest) = (own.stiffness.take().unwrap_or_default(), own.rest.take().unwrap_or_default());
    if stiffness == 0.0 {
        return;
    }
    let Some(leads) = draft.joints.iter_mut().find(|other| other.name == leader) else { return };
    if leads.kind == JointKind::Fixed {
        return;
    }
    let added = law.ratio * law.ratio * stiffness;
    let leads = &mut leads.stated;
    let before = leads.stiffness.unwrap_or_default();
    let total = before + added;
    let rest = (before * leads.rest.unwrap_or_default() + added * (rest - law.offset) / law.ratio) / total;
    (leads.stiffness, leads.rest) = (Some(total), Some(rest));
    let text = format!("its spring of {stiffness} is part of that of '{leader}', which it follows");
    log.taken(At::Joint(joint.to_owned()), format!("joint '{joint}'"), text);
}

fn tendon(draft: &mut Draft, index: usize, (joint, leader, law): (&str, &str, Follows), log: &mut Log) {
    let tendon = &mut draft.tendons[index];
    let Some(at) = tendon.joints.iter().position(|(name, _)| name == joint) else { return };
    let (_, path) = tendon.joints.remove(at);
    let (path, mut constant) = substituted(path, law);
    match tendon.joints.iter_mut().find(|(name, _)| name == leader) {
        Some((_, own)) => {
            let (sum, more) = added(std::mem::replace(own, TendonPath::Arm(0.0)), path);
            *own = sum;
            constant += more;
        }
        None => tendon.joints.insert(at.min(tendon.joints.len()), (leader.to_owned(), path)),
    }
    let name = tendon.name.clone();
    let text = format!(
        "joint '{joint}' follows '{leader}' as {} + {} · its coordinate; its moment arm counts there",
        law.offset, law.ratio
    );
    log.taken(At::Tendon(name.clone()), format!("tendon '{name}'"), text);
    shorten(draft, index, constant);
}

/// A tendon whose paths lost a constant part has the same tension at a length that is shorter by it.
pub(super) fn shorten(draft: &mut Draft, index: usize, constant: f64) {
    let tendon = &mut draft.tendons[index];
    if constant == 0.0 {
        return;
    }
    if tendon.motors.is_empty() {
        tendon.stated.rest = Some(tendon.stated.rest.unwrap_or_default() - constant);
    }
    let name = Drive::Tendon(tendon.name.clone());
    for actuator in draft.actuators.iter_mut().filter(|actuator| actuator.drive == name) {
        actuator.range = actuator.range.map(|range| range.map(|s| s - constant));
    }
}

/// A motor of a follower drives the leader, unless another motor does.
fn motor(draft: &mut Draft, (joint, leader, law): (&str, &str, Follows), log: &mut Log) {
    let (follower, leads) = (Drive::Joint(joint.to_owned()), Drive::Joint(leader.to_owned()));
    if draft.actuators.iter().any(|actuator| actuator.drive == leads) {
        return;
    }
    let Some(actuator) = draft.actuators.iter_mut().find(|actuator| actuator.drive == follower) else {
        return;
    };
    let ratio = law.ratio;
    actuator.drive = leads;
    actuator.gain = actuator.gain.map(|k| k * ratio * ratio);
    actuator.damping = actuator.damping.map(|b| b * ratio * ratio);
    actuator.force_limit = actuator.force_limit.map(|f| f * ratio.abs());
    actuator.speed_limit = actuator.speed_limit.map(|v| v / ratio.abs());
    actuator.range = actuator.range.map(|range| range.map(|x| (x - law.offset) / ratio));
    let text = format!("drives joint '{joint}', which follows '{leader}'; it drives that one");
    log.taken(At::Motor(actuator.name.clone()), format!("actuator '{}'", actuator.name), text);
}

/// The path as a function of the leader's coordinate, without its constant.
fn substituted(path: TendonPath, law: Follows) -> (TendonPath, f64) {
    match path {
        TendonPath::Arm(r) => (TendonPath::Arm(r * law.ratio), r * law.offset),
        TendonPath::Polynomial(coefficients) => {
            // Horner's scheme with the line for the coordinate.
            let mut all = vec![0.0; coefficients.len()];
            for c in coefficients.iter().rev() {
                let mut next = vec![0.0; all.len()];
                for (power, old) in all.iter().enumerate() {
                    next[power] += law.offset * old;
                    if power + 1 < next.len() {
                        next[power + 1] += law.ratio * old;
                    }
                }
                next[0] += c;
                all = next;
            }
            let constant = std::mem::take(&mut all[0]);
            (TendonPath::Polynomial(all), constant)
        }
        TendonPath::Table(points) => {
            let mut moved: Vec<[f64; 2]> =
                points.into_iter().map(|[x, s]| [(x - law.offset) / law.ratio, s]).collect();
            moved.sort_by(|a, b| a[0].total_cmp(&b[0]));
            (TendonPath::Table(moved), 0.0)
        }
    }
}

/// The sum of two paths over one joint, without its constant.
fn added(first: TendonPath, second: TendonPath) -> (TendonPath, f64) {
    use TendonPath::{Arm, Polynomial};
    match (first, second) {
        (Arm(a), Arm(b)) => (Arm(a + b), 0.0),
        (Arm(r), other) | (other, Arm(r)) => added(other, Polynomial(vec![0.0, r])),
        (Polynomial(mut a), Polynomial(b)) => {
            a.resize(a.len().max(b.len()), 0.0);
            a.iter_mut().zip(&b).for_each(|(a, b)| *a += b);
            let constant = std::mem::take(&mut a[0]);
            (Polynomial(a), constant)
        }
        (TendonPath::Table(points), other) | (other, TendonPath::Table(points)) => {
            // The spline through sums is the sum of splines with the same points.
            let mut at: Vec<f64> = points.iter().map(|point| point[0]).collect();
            if let TendonPath::Table(more) = &other {
                at.extend(more.iter().map(|point| point[0]));
                at.sort_by(f64::total_cmp);
                at.dedup();
            }
            let (own, other) = (TendonPath::Table(points), other);
            (TendonPath::Table(at.iter().map(|&q| [q, length(&own, q) + length(&other, q)]).collect()), 0.0)
        }
    }
}

/// Length that a joint at q takes up.
pub(super) fn length(path: &TendonPath, q: f64) -> f64 {
    match path {
        TendonPath::Arm(r) => r * q,
        TendonPath::Polynomial(coefficients) => coefficients.iter().rev().fold(0.0, |sum, c| sum * q + c),
        TendonPath::Table(points) => {
            let points = TablePoints {
                at: points.iter().map(|point| point[0]).collect(),
                length: points.iter().map(|point| point[1]).collect(),
            };
            Table::new(points).map_or(0.0, |table| HandPath::Table(table).length(q).value)
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    const LAW: Follows = Follows { ratio: -2.0, offset: 0.3 };

    fn of_leader(path: TendonPath, y: f64) -> f64 {
        let (path, constant) = substituted(path, LAW);
        length(&path, y) + constant
    }

    #[test]
    fn a_path_over_a_follower_has_the_same_length_over_its_leader() {
        let at: Vec<[f64; 2]> = (0..9).map(|k| f64::from(k) * 0.3 - 1.2).map(|x| [x, x.sin()]).collect();
        let paths = [
            TendonPath::Arm(0.01),
            TendonPath::Polynomial(vec![0.002, 0.01, -0.003, 0.0007]),
            TendonPath::Table(at),
        ];
        for path in paths {
            for y in [-0.3, 0.0, 0.2, 0.5] {
                let (moved, own) = (of_leader(path.clone(), y), length(&path, 0.3 - 2.0 * y));
                assert!((moved - own).abs() < 1e-14, "{path:?} at {y}: {moved} and {own}");
            }
        }
    }

    #[test]
    fn paths_over_one_joint_add_up() {
        let table = TendonPath::Table(vec![[-1.0, 0.0], [0.0, 0.01], [0.6, 0.013], [1.0, 0.02]]);
        let other = TendonPath::Table(vec![[-1.0, 0.3], [0.0, 0.1], [0.6, 0.0], [1.0, -0.2]]);
        let curve = TendonPath::Polynomial(vec![0.1, 0.02, 0.003]);
        for (a, b) in [
            (TendonPath::Arm(0.2), TendonPath::Arm(-0.5)),
            (TendonPath::Arm(0.2), curve.clone()),
            (curve.clone(), curve),
            (table.clone(), TendonPath::Arm(0.2)),
            (table, other),
        ] {
            for q in [-0.7, 0.0, 0.4, 0.9] {
                let both = length(&a, q) + length(&b, q);
                let (sum, constant) = added(a.clone(), b.clone());
                assert!((length(&sum, q) + constant - both).abs() < 1e-14, "{a:?} and {b:?} at {q}");
            }
        }
    }
}
