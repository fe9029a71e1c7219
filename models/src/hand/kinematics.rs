//! Poses of links and moment arms of tendons at given coordinates q.

use parry3d_f64::query;
use parry3d_f64::shape::SharedShape;

use super::tendon::Tendon;
use super::{Hand, Hinge, HingeKind, Link};
use crate::{Pose, Rotation};

impl Hinge {
    /// Pose of the moved frame in the frame before the hinge, at coordinate q.
    pub fn pose(&self, q: f64) -> Pose {
        self.pose_knowing(q, &mut None)
    }

    /// The same with a cache: `known` has an angle, rad, with sine and cosine of its half, and is updated to
    /// those of this hinge. The two hinges of a rolling joint turn by the same angle.
    fn pose_knowing(&self, q: f64, known: &mut Option<(f64, (f64, f64))>) -> Pose {
        let x = self.ratio * q + self.offset;
        let before = self.parent_from_hinge;
        match self.kind {
            HingeKind::Revolute => {
                let (s, c) = match *known {
                    Some((angle, half)) if angle == x => half,
                    _ => libm::sincos(0.5 * x),
                };
                *known = Some((x, (s, c)));
                let v = self.axis * s;
                let turn = Rotation::from_xyzw(v.x, v.y, v.z, c);
                // Many hinges are parallel to the one before.
                let parallel = before.rotation == Rotation::IDENTITY;
                Pose::from_parts(before.translation, if parallel { turn } else { before.rotation * turn })
            }
            HingeKind::Prismatic => before * Pose::from_translation(self.axis * x),
        }
    }
}

/// Pairs of links closer than this at rest touch, m.
const TOUCHING: f64 = 1e-3;

impl Hand {
    /// Pose of each link in the base frame at coordinates q (one per [`Hand::coordinates`]).
    pub fn base_from_links(&self, q: &[f64]) -> Vec<Pose> {
        let mut poses: Vec<Pose> = Vec::with_capacity(self.links.len());
        for link in &self.links {
            let mut pose = link.parent.map_or(Pose::IDENTITY, |p| poses[p]);
            if let Some(joint) = &link.joint {
                let mut known = None;
                for hinge in &joint.hinges {
                    pose *= hinge.pose_knowing(q[joint.coordinate], &mut known);
                }
            }
            poses.push(pose);
        }
        poses
    }

    /// Pose of each link in its parent's frame at coordinates q; for the base, in its own.
    pub fn parent_from_links(&self, q: &[f64]) -> impl Iterator<Item = Pose> {
        self.links.iter().map(|link| {
            let Some(joint) = &link.joint else { return Pose::IDENTITY };
            joint.hinges.iter().fold(Pose::IDENTITY, |pose, hinge| pose * hinge.pose(q[joint.coordinate]))
        })
    }

    /// Row of R(q) of every tendon, one entry per coordinate.
    pub fn moment_arms(&self, q: &[f64]) -> Vec<Vec<f64>> {
        let row = |tendon: &Tendon| {
            let mut row = vec![0.0; self.coordinates.len()];
            tendon.gradient(q, |c, r| row[c] += r);
            row
        };
        self.tendons.iter().map(row).collect()
    }

    /// Pairs of links, except parent and child, that are closer than a millimetre where the springs rest: they never collide.
    pub fn touching_at_rest(&self) -> Vec<[usize; 2]> {
        let mut rest: Vec<f64> = self.coordinates.iter().map(|c| c.rest).collect();
        self.close_chains(&mut rest);
        self.pairs_closer_than(TOUCHING, &rest)
    }

    /// Pairs of links, except parent and child, that are closer than `distance` at coordinates q.
    pub fn pairs_closer_than(&self, distance: f64, q: &[f64]) -> Vec<[usize; 2]> {
        let poses = self.base_from_links(q);
        // Built once: a hull is computed from its points every time.
        let placed = |(link, pose): (&Link, &Pose)| -> Vec<(SharedShape, Pose)> {
            let solid = link.geoms.iter().filter_map(|g| Some((g, g.shape.to_parry()?)));
            solid.map(|(g, (shape, upright))| (shape, *pose * g.link_from_geom * upright)).collect()
        };
        let shapes: Vec<Vec<(SharedShape, Pose)>> = self.links.iter().zip(&poses).map(placed).collect();
        let near = |a: usize, b: usize| {
            shapes[a].iter().any(|x| shapes[b].iter().any(|y| closer_than(distance, x, y)))
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

fn closer_than(distance: f64, a: &(SharedShape, Pose), b: &(SharedShape, Pose)) -> bool {
    let between = query::distance(&a.1, a.0.as_ref(), &b.1, b.0.as_ref());
    between.is_ok_and(|d| d.distance < distance)
}
