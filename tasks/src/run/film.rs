//! Pictures for people.

use super::Run;
use super::still::Still;
use super::view::View;
use std::sync::Arc;

impl Run {
    /// The view of a film. It is the same at every tick.
    pub(super) fn film_view(&self, size: (u32, u32)) -> View {
        let (lens, pose) = self.cameras.studio().view(size);
        View::new(lens, pose, None)
    }

    /// The present moment, for [`Still::picture`].
    pub fn still(&self) -> Still {
        Still::new(Arc::clone(&self.cameras), self.poses().collect())
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::run::FILM_SIZE;
    use crate::seed::Seed;
    use crate::task::Task;
    use palmares_models::hand::Hand;
    use palmares_senses::camera::{Film, GBuffer};

    fn run(task: &str, hand: &str) -> Run {
        let task = Task::builtin().into_iter().find(|known| known.name == task).expect("built in");
        Run::new(task, Hand::builtin(hand).expect("built in"), Seed::from_u64(1)).expect("a scene")
    }

    #[test]
    fn the_view_sees_fingers_and_objects_of_tasks_and_hands() {
        for (task, hand) in
            [("balls", "softhand"), ("grasp", "reflex"), ("shelf", "softhand"), ("pan", "pinch")]
        {
            let run = run(task, hand);
            let view = run.film_view(FILM_SIZE);
            let mut image = GBuffer::default();
            run.draw(&view, &mut image);
            let first = run.scene().bodies.len();
            let pixels = |body: usize| image.body.iter().filter(|shown| usize::from(**shown) == body).count();
            let fingers = run.hand().fingers();
            let of = |links: &[usize]| links.iter().map(|link| pixels(first + link)).sum::<usize>();
            let visible = fingers.iter().filter(|finger| of(&finger.links) > 20).count();
            assert!(2 * visible > fingers.len(), "{task} {hand}: {visible} of {} fingers", fingers.len());
            let objects = run.object_states().count();
            let shown = (0..objects).filter(|object| pixels(*object) > 20).count();
            assert!(2 * shown > objects, "{task} {hand}: {shown} of {objects} objects");
        }
    }

    #[test]
    fn a_still_is_the_picture_of_its_moment_and_the_view_stays() {
        let mut run = run("grasp", "pinch");
        let (view, before) = (run.film_view((64, 48)), run.still());
        let mut film = Film::default();
        let first = before.picture(&view, &mut film);
        for _ in 0..60 {
            let base = crate::BaseTarget::Twist { linear: [0.0, 0.0, -0.3], angular: [0.0; 3] };
            let action = crate::Action { base: Some(base), hand: Some(vec![1.0; 2]), effort: None };
            run.step(&action).expect("valid");
        }
        assert_eq!(run.film_view((64, 48)), view);
        assert_ne!(run.still().picture(&view, &mut film), first);
        assert_eq!(before.picture(&view, &mut film), first);
    }
}
