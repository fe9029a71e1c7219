//! Where links are for given coordinates. Needed here to know which links touch at rest.

use parry3d_f64::query;

use crate::hand::{Geom, Hand, Hinge, HingeKind};
use crate::{Pose, Rotation};

impl Hinge {
    /// Pose of the moved frame in the frame before the hinge, at coordinate q.
    pub fn pose(&self, q: f64) -> Pose {
        let x = self.ratio * q + self.offset;
        let motion = match self.kind {
            HingeKind::Revolute => {
                let (s, c) = libm::sincos(0.5 * x);
                let v = self.axis * s;
                Pose::from_rotation(Rotation::from_xyzw(v.x, v.y, v.z, c))
            }
            HingeKind::Prismatic => Pose::from_translation(self.axis * x),
        };
        self.parent_from_hinge * motion
    }
}

impl Hand {
    /// Pose of each link in the base frame at coordinates q (one per [`Hand::coordinates`]).
    pub fn base_from_links(&self, q: &[f64]) -> Vec<Pose> {
        let mut poses: Vec<Pose> = Vec::with_capacity(self.links.len());
        for link in &self.links {
            let mut pose = link.parent.map_or(Pose::IDENTITY, |p| poses[p]);
            if let Some(joint) = &link.joint {
                for hinge in &joint.hinges {
                    pose *= hinge.pose(q[joint.coordinate]);
                }
            }
            poses.push(pose);
        }
        poses
    }

    /// Index of the link of that name.
    pub fn link(&self, name: &str) -> Option<usize> {
        self.links.iter().position(|l| l.name == name)
    }

    /// Index of the coordinate of that name.
    pub fn coordinate(&self, name: &str) -> Option<usize> {
        self.coordinates.iter().position(|c| c.name == name)
    }

    /// Pairs of links, beside parent and child, that are closer than `distance` at coordinates q.
    pub fn pairs_closer_than(&self, distance: f64, q: &[f64]) -> Vec<[usize; 2]> {
        let poses = self.base_from_links(q);
        let near = |a: usize, b: usize| {
            let (ga, gb) = (&self.links[a].geoms, &self.links[b].geoms);
            ga.iter().any(|x| gb.iter().any(|y| closer_than(distance, (&poses[a], x), (&poses[b], y))))
        };
        let mut pairs = Vec::new();
        for a in 0..self.links.len() {
            for b in a + 1..self.links.len() {
                if self.links[b].parent != Some(a) && near(a, b) {
                    pairs.push([a, b]);
                }
            }
        }
        pairs
    }
}

fn closer_than(distance: f64, a: (&Pose, &Geom), b: (&Pose, &Geom)) -> bool {
    let (Some((shape_a, up_a)), Some((shape_b, up_b))) = (a.1.shape.to_parry(), b.1.shape.to_parry()) else {
        return false;
    };
    let (pose_a, pose_b) = (*a.0 * a.1.link_from_geom * up_a, *b.0 * b.1.link_from_geom * up_b);
    query::distance(&pose_a, shape_a.as_ref(), &pose_b, shape_b.as_ref()).is_ok_and(|d| d.distance < distance)
}
