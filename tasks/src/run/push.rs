//! Wrenches on links of the hand from outside, for a while: the virtual contacts of Rocchi & Hauser 2016. And on objects, for learners
//! in the same process.

use super::Run;
use super::push_error::{MAX_PUSHES, PushError};
use super::targets::{Pushed, PushedPart, Pushing, within};
use crate::observation::Wrench;
use palmares_models::Vec3;
use palmares_sim::Push;

/// Half the arm of the couple that a torque is made of, m.
const COUPLE_ARM: f64 = 0.05;

impl Run {
    /// Greatest force of a push, N, and greatest torque, N·m.
    pub const PUSH_LIMITS: (f64, f64) = (200.0, 20.0);

    /// Maximum number of pushes at once.
    pub const MAX_PUSHES: usize = MAX_PUSHES;

    /// Maximum duration of a push, s.
    pub const MAX_PUSH_S: f64 = 60.0;

    /// Pushes a link from the next tick on, for a duration rounded up to whole ticks. Force and torque are in the
    /// world frame, the torque about the link's origin, where the force acts. Pushes add up. They are no part of
    /// the applied actions: to replay a run, push again before the same tick.
    pub fn push(&mut self, link: &str, wrench: Wrench, duration_s: f64) -> Result<(), PushError> {
        self.push_part(PushedPart::Link(link), wrench, duration_s)
    }

    /// Pushes a link or an object, as [`Run::push`].
    ///
    /// # Errors
    /// There is no such link or object, a number is out of bounds, or too many pushes act.
    pub fn push_part(
        &mut self,
        part: PushedPart<'_>,
        wrench: Wrench,
        duration_s: f64,
    ) -> Result<(), PushError> {
        let pushing = self.pushing_of(part, wrench, duration_s)?;
        self.pushing.push(pushing);
        self.altered |= matches!(part, PushedPart::Object(_));
        Ok(())
    }

    /// Whether [`Run::push_part`] would take this push.
    ///
    /// # Errors
    /// Those of [`Run::push_part`].
    pub fn check_push(&self, part: PushedPart<'_>, wrench: Wrench, duration_s: f64) -> Result<(), PushError> {
        self.pushing_of(part, wrench, duration_s).map(drop)
    }

    fn pushing_of(
        &self,
        part: PushedPart<'_>,
        wrench: Wrench,
        duration_s: f64,
    ) -> Result<Pushing, PushError> {
        let on = match part {
            PushedPart::Link(link) => Pushed::Link(self.hand.link(link).ok_or_else(|| {
                let known: Vec<&str> = self.hand.links.iter().map(|link| link.name.as_str()).collect();
                PushError::UnknownLink {
                    hand: self.hand.name.clone(),
                    link: link.chars().take(64).collect(),
                    known: known.join(", "),
                }
            })?),
            PushedPart::Object(object) => {
                let count = self.world.model().objects().len();
                if object >= count {
                    return Err(PushError::UnknownObject { object, count });
                }
                Pushed::Object(object)
            }
        };
        let (force, torque) = (Vec3::from_array(wrench.force), Vec3::from_array(wrench.torque));
        let bad = |field, expected| Err(PushError::BadNumber { field, expected });
        if !within(force, Self::PUSH_LIMITS.0) {
            return bad("wrench.force", "finite numbers, at most 200 N together");
        }
        if !within(torque, Self::PUSH_LIMITS.1) {
            return bad("wrench.torque", "finite numbers, at most 20 N·m together");
        }
        if !(duration_s > 0.0 && duration_s <= Self::MAX_PUSH_S) {
            return bad("duration_s", "more than 0 and at most 60 s");
        }
        if self.pushing.len() >= Self::MAX_PUSHES {
            return Err(PushError::TooMany);
        }
        // Durations that are whole ticks must not become one more by rounding.
        let ticks_left = (duration_s / self.task.tick_s - 1e-9).ceil().max(1.0) as u64;
        Ok(Pushing { on, force, torque, ticks_left })
    }

    /// A tick has passed.
    pub(super) fn push_on(&mut self) {
        for pushing in &mut self.pushing {
            pushing.ticks_left -= 1;
        }
        self.pushing.retain(|pushing| pushing.ticks_left > 0);
    }

    /// Applies the active pushes on objects in the next step.
    pub(super) fn push_objects(&mut self) {
        for &Pushing { on, force, torque, .. } in &self.pushing {
            if let Pushed::Object(object) = on {
                self.world.push_object(object, force, torque);
            }
        }
    }

    /// The active pushes on links as forces: a torque is a couple.
    pub(super) fn pushes_into(&self, pushes: &mut Vec<Push>) {
        pushes.clear();
        if self.pushing.is_empty() {
            return;
        }
        let state = self.world.state();
        let base_from_links = self.hand.base_from_links(&state.q);
        for &Pushing { on, force, torque, .. } in &self.pushing {
            let Pushed::Link(link) = on else { continue };
            if force != Vec3::ZERO {
                pushes.push(Push { link, point: Vec3::ZERO, force });
            }
            if torque != Vec3::ZERO {
                let arm = torque.normalize().any_orthonormal_vector();
                let each = torque.cross(arm) / (2.0 * COUPLE_ARM);
                let link_from_world = (state.base.rotation * base_from_links[link].rotation).inverse();
                let point = link_from_world * arm * COUPLE_ARM;
                pushes.push(Push { link, point, force: each });
                pushes.push(Push { link, point: -point, force: -each });
            }
        }
    }
}
