//! Links of the hand and their frames: a link's frame is that of its joint, a body's frame is where the document puts it.

use palmares_models::{Pose, Vec3};

use super::model::{JointKind, Model};
use crate::decision::{At, Log};
use crate::read::element::Notes;

/// The part of a document that is the hand.
#[derive(Clone, Debug)]
pub(crate) struct Frames {
    /// Bodies of the hand, parents first. The first is the base; the world only if several bodies move on it.
    pub(crate) bodies: Vec<usize>,
    /// Per body: its frame in that of its link; `None` outside the hand.
    pub(crate) link_from_body: Vec<Option<Pose>>,
}

impl Frames {
    /// Chooses the hand.
    pub(crate) fn choose(model: &Model, log: &mut Log) -> Frames {
        let moves = |top: usize| {
            model
                .joints
                .iter()
                .filter(|joint| joint.kind != JointKind::Free && inside(model, joint.body, top))
                .count()
        };
        let tops: Vec<usize> = (1..model.bodies.len()).filter(|&b| model.bodies[b].parent == 0).collect();
        let free =
            |top: usize| model.bodies[top].joints.iter().any(|&j| model.joints[j].kind == JointKind::Free);
        let moving: Vec<usize> = tops.iter().copied().filter(|&top| moves(top) > 0).collect();
        // An object of the scene flies; the hand may, too.
        let fixed: Vec<usize> = moving.iter().copied().filter(|&top| !free(top)).collect();
        let chosen = match (fixed.as_slice(), moving.as_slice()) {
            ([], []) => tops.first().copied().unwrap_or(0),
            ([one], _) | ([], [one]) => *one,
            ([], several) => several.iter().copied().max_by_key(|&top| moves(top)).unwrap_or(0),
            // Fingers that stand on the world have it as their base.
            _ => 0,
        };
        let placed = places(model, chosen);
        let base = if chosen != 0 && hinges(model, chosen) > 0 && !placed { 0 } else { chosen };
        if placed && let Some(element) = &model.bodies[chosen].element {
            let text = "slides and turns as a whole by joints of its own; the base of a hand is moved by its servo, so that they are left out";
            log.lost(At::Hand, element, text);
        }
        let of_hand = |body: usize| match (base, chosen) {
            (0, 0) => body == 0 || fixed.iter().any(|&top| inside(model, body, top)),
            (0, chosen) => body == 0 || inside(model, body, chosen),
            (base, _) => inside(model, body, base),
        };
        let bodies: Vec<usize> = (0..model.bodies.len()).filter(|&body| of_hand(body)).collect();
        for &top in &tops {
            if !bodies.contains(&top)
                && let Some(element) = &model.bodies[top].element
            {
                log.lost(At::Hand, element, "is no part of the hand; it and what it carries are left out");
            }
        }
        if base != 0
            && model.bodies[base].pose != Pose::IDENTITY
            && let Some(element) = &model.bodies[base].element
        {
            log.lost(At::Hand, element, "is the base: its place in the world is left out");
        }
        if base != 0
            && free(base)
            && let Some(element) = &model.bodies[base].element
        {
            log.lost(At::Hand, element, "flies by a free joint; the base of a hand is moved by its servo");
        }
        let mut link_from_body = vec![None; model.bodies.len()];
        for &body in &bodies {
            let last = model.bodies[body].joints.iter().rev().map(|&j| &model.joints[j]);
            let last = last.filter(|_| body != base).find(|joint| joint.kind != JointKind::Free);
            let at = last.map_or(Vec3::ZERO, |joint| joint.at);
            link_from_body[body] = Some(Pose::from_translation(-at));
        }
        Frames { bodies, link_from_body }
    }

    /// The base's body.
    pub(crate) fn base(&self) -> usize {
        self.bodies.first().copied().unwrap_or(0)
    }

    /// Whether the joints of the body are part of the hand: the base has none.
    pub(crate) fn moves(&self, body: usize) -> bool {
        self.has(body) && body != self.base()
    }

    /// Whether the body is part of the hand.
    pub(crate) fn has(&self, body: usize) -> bool {
        self.link_from_body[body].is_some()
    }
}

/// Whether the joints of a body put the whole hand to its place: several, and one at least slides.
fn places(model: &Model, body: usize) -> bool {
    let slide = |&j: &usize| model.joints[j].kind == JointKind::Slide;
    body != 0 && hinges(model, body) >= 3 && model.bodies[body].joints.iter().any(slide)
}

/// Joints of a body that are no free joint.
fn hinges(model: &Model, body: usize) -> usize {
    model.bodies[body].joints.iter().filter(|&&j| model.joints[j].kind != JointKind::Free).count()
}

fn inside(model: &Model, body: usize, top: usize) -> bool {
    let mut at = body;
    while at != top && at != 0 {
        at = model.bodies[at].parent;
    }
    at == top
}
