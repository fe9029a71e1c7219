//! Poses of all moving bodies, for recorders and viewers.

use super::Run;
use super::hand_body::HandBody;
use crate::scene::ScenePart;
use palmares_models::Pose;

impl Run {
    /// The hand's links as bodies. Their ids follow those of the scene.
    pub fn hand_bodies(&self) -> Vec<HandBody> {
        let first = self.scene.bodies.len();
        let links = self.hand.links.iter().enumerate();
        links
            .map(|(k, link)| HandBody {
                id: first + k,
                name: link.name.clone(),
                parts: link
                    .geoms
                    .iter()
                    .map(|geom| ScenePart {
                        position: geom.link_from_geom.translation.to_array(),
                        quat_xyzw: geom.link_from_geom.rotation.to_array(),
                        shape: geom.shape.clone(),
                    })
                    .collect(),
            })
            .collect()
    }

    /// World pose of every body that can move: the free objects, then the hand's links.
    pub fn poses(&self) -> impl Iterator<Item = (usize, Pose)> + '_ {
        let (model, state) = (self.world.model(), self.world.state());
        let first = self.scene.bodies.len();
        let objects = (0..state.objects.len()).map(|k| (k, state.object_pose(model, k)));
        let links = self.hand.base_from_links(&state.q).into_iter().enumerate();
        objects.chain(links.map(move |(k, base_from_link)| (first + k, state.base * base_from_link)))
    }
}
