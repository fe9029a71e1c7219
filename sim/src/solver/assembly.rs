//! The Newton matrix of an island: `H = A + Σ Jᵀ G J`, as blocks of bodies.

use super::friction_cone::ConeHessian;
use super::problem::{PairBody, PairProblem, Point, Problem};
use super::workspace::Newton;
use crate::dynamics::spatial::{SpatialMatrix, cross_columns, outer};
use crate::dynamics::tree::Kinematics;
use crate::model::{Model, Owner};
use palmares_models::{Mat3, Vec3};

/// From this number of objects on only the pairs that act couple their bodies in the matrix. Most pairs that
/// could touch in a heap do not, and the matrix of those that do is sparser. With few objects the new
/// ordering would cost more than it saves.
const MANY_OBJECTS: usize = 20;

/// Adds `Wᵀ G W` of a point whose friction acts at another point than its normal force: the rows of W are
/// `[a, r × a]` for each axis a about its own point r.
fn add_patch_point(k: &mut SpatialMatrix, point: &Point, hessian: &ConeHessian) {
    let [a1, a2, a3] = point.axes;
    let m3 = point.r.cross(a3);
    let law = &point.law;
    let g = match hessian {
        ConeHessian::Open => return,
        // Equal along both tangents.
        ConeHessian::Stick => {
            let across = Mat3::from_diagonal(Vec3::splat(law.tangential)) - outer(a3, a3 * law.tangential);
            let moments = cross_columns(point.friction_r, &across);
            let (along, turning) = (a3 * law.normal, m3 * law.normal);
            k.ll += across + outer(a3, along);
            k.al += moments + outer(m3, along);
            k.aa += cross_columns(point.friction_r, &moments.transpose()) + outer(m3, turning);
            k.aa += outer(a3, a3 * (law.tangential * law.arm * law.arm));
            return;
        }
        ConeHessian::Slip(g, spin) => (*g, *spin),
    };
    let (g, [g1s, g2s, g3s, gss]) = g;
    // The row of W for spin is [0, a n].
    let spin = a3 * law.arm;
    k.aa += outer(spin, spin * gss);
    let [m1, m2] = [a1, a2].map(|axis| point.friction_r.cross(axis));
    let [g11, g12, g22, g13, g23, g33] = g;
    for (a, m, [x, y, z], s) in
        [(a1, m1, [g11, g12, g13], g1s), (a2, m2, [g12, g22, g23], g2s), (a3, m3, [g13, g23, g33], g3s)]
    {
        let (linear, angular) = (a1 * x + a2 * y + a3 * z, m1 * x + m2 * y + m3 * z);
        k.ll += outer(a, linear);
        k.al += outer(m, linear) + outer(spin, a * s);
        k.aa += outer(m, angular + spin * s) + outer(spin, m * s);
    }
}

/// Whether a pair contributes to the matrix.
fn acts(pair: &PairProblem, hessians: &[ConeHessian]) -> bool {
    let open = |hessian: &ConeHessian| matches!(hessian, ConeHessian::Open);
    pair.rolling.limit > 0.0 || !hessians[pair.first..pair.end].iter().all(open)
}

impl Newton {
    /// Blocks and their couplings: the hand's clusters, the objects, and the tendons last.
    pub(super) fn update_block_structure(&mut self, model: &Model, kin: &Kinematics, problem: &mut Problem) {
        if !std::mem::take(&mut problem.fresh) {
            return;
        }
        self.update_blocks(model, problem);
        let Problem { pairs, objects, .. } = problem;
        for pair in pairs {
            let body = |owner: Owner| match owner {
                Owner::Static => PairBody::Fixed,
                Owner::Link(i) => PairBody::Link(i, pair.origin - kin.origin),
                Owner::Object(k) => {
                    let slot = self.slot[k];
                    let lever = pair.origin - objects[slot].center;
                    if lever == Vec3::ZERO { PairBody::Centre(slot) } else { PairBody::Object(slot, lever) }
                }
            };
            pair.bodies = [body(pair.a), body(pair.b)];
        }
    }

    fn update_blocks(&mut self, model: &Model, problem: &Problem) {
        self.inverse_diagonal.clear();
        let h = problem.hand_dofs;
        self.inverse_diagonal.extend((0..h).map(|i| 1.0 / problem.hand_matrix[i * h + i]));
        for object in &problem.objects {
            let i = object.inertia;
            self.inverse_diagonal.extend([1.0 / object.mass; 3]);
            self.inverse_diagonal.extend([1.0 / i.x_axis.x, 1.0 / i.y_axis.y, 1.0 / i.z_axis.z]);
        }
        self.slot.resize(model.objects().len(), usize::MAX);
        for (k, object) in problem.objects.iter().enumerate() {
            self.slot[object.object] = k;
        }
        if self.block_structure.describes(problem) {
            return;
        }
        self.block_structure.describe(problem);
        self.sizes.clear();
        self.dof_block.clear();
        let hand_blocks = if problem.hand_dofs > 0 { model.hand_clusters() } else { 0 };
        for (block, cluster) in model.clusters()[..hand_blocks].iter().enumerate() {
            self.sizes.push(cluster.dofs.len());
            for (k, _) in cluster.dofs.clone().enumerate() {
                self.dof_block.push((block, k));
            }
        }
        self.list_joints(model, problem);
        self.sizes.extend(problem.objects.iter().map(|_| 6));
        if problem.rows > 0 && hand_blocks > 0 {
            self.sizes.push(problem.rows);
        }
        if problem.objects.len() < MANY_OBJECTS {
            self.couple_blocks(model, problem, false);
        }
    }

    /// Couplings of the blocks, by all pairs or only by those that act at the last gradient.
    fn couple_blocks(&mut self, model: &Model, problem: &Problem, acting: bool) {
        let hand_blocks = if problem.hand_dofs > 0 { model.hand_clusters() } else { 0 };
        let tendons = problem.rows > 0 && hand_blocks > 0;
        self.pattern.clear();
        let mut couple = |a: usize, b: usize| self.pattern.push((a.min(b) as u32, a.max(b) as u32));
        for block in 1..hand_blocks {
            couple(0, block);
        }
        let hand = model.hand();
        let link_block = |link: usize| -> usize {
            match hand.and_then(|hand| hand.links[link].joint.as_ref()) {
                Some(joint) => self.dof_block[6 + joint.coordinate].0,
                None => 0,
            }
        };
        for pair in &problem.pairs {
            if acting && !acts(pair, &self.hessians) {
                continue;
            }
            let block = |owner: Owner| match owner {
                Owner::Static => None,
                Owner::Link(link) => Some(link_block(link)),
                Owner::Object(k) => Some(hand_blocks + self.slot[k]),
            };
            if let (Some(a), Some(b)) = (block(pair.a), block(pair.b)) {
                if a != b {
                    couple(a, b);
                }
                for (x, y) in [(a, b), (b, a)] {
                    if x < hand_blocks && y >= hand_blocks {
                        couple(0, y);
                    }
                }
            }
        }
        if tendons {
            let block = self.sizes.len() - 1;
            for term in &problem.row_terms[..problem.rows] {
                for &(dof, _) in &term.row {
                    couple(self.dof_block[dof].0, block);
                }
            }
        }
        self.pattern.sort_unstable();
        self.pattern.dedup();
        self.cholesky.analyse(&self.sizes, &self.pattern, tendons);
    }

    /// Assembles the matrix with the curvatures of the last gradient.
    pub(super) fn assemble(&mut self, model: &Model, kin: &Kinematics, problem: &Problem) {
        if problem.objects.len() >= MANY_OBJECTS {
            self.couple_blocks(model, problem, true);
        }
        self.cholesky.clear();
        let h = problem.hand_dofs;
        let hand_blocks = if h > 0 { model.hand_clusters() } else { 0 };
        let links = self.link_force.len();
        self.link_stiffness.resize(links, SpatialMatrix::ZERO);
        self.link_touched.resize(links, false);
        for (stiffness, touched) in self.link_stiffness.iter_mut().zip(&mut self.link_touched) {
            if std::mem::take(touched) {
                *stiffness = SpatialMatrix::ZERO;
            }
        }
        for (slot, object) in problem.objects.iter().enumerate() {
            let Some(block) = self.cholesky.square(hand_blocks + slot) else { continue };
            for i in 0..3 {
                block[i][i] = object.mass;
                for j in 0..=i {
                    block[3 + i][3 + j] = object.inertia.col(j)[i];
                }
            }
        }
        self.put_hand(model, problem);
        for pair in &problem.pairs {
            if !acts(pair, &self.hessians) {
                continue;
            }
            let k = self.pair_stiffness(pair, problem);
            self.add_pair(kin, pair, &k, hand_blocks);
        }
        if h > 0 {
            self.add_links(kin);
            self.add_terms(problem);
        }
    }

    /// `Σ Wᵀ G W` over the points of a pair, about its origin.
    fn pair_stiffness(&self, pair: &PairProblem, problem: &Problem) -> SpatialMatrix {
        let mut k = SpatialMatrix::ZERO;
        for (point, hessian) in
            problem.points[pair.first..pair.end].iter().zip(&self.hessians[pair.first..pair.end])
        {
            if pair.patch {
                add_patch_point(&mut k, point, hessian);
                continue;
            }
            let [t1, t2, n] = point.axes;
            let q = match hessian {
                ConeHessian::Open => continue,
                ConeHessian::Stick => {
                    let law = &point.law;
                    Mat3::from_diagonal(Vec3::splat(law.tangential))
                        + outer(n, n * (law.normal - law.tangential))
                }
                ConeHessian::Slip(g, _) => {
                    outer(t1, t1 * g[0] + t2 * g[1] + n * g[3])
                        + outer(t2, t1 * g[1] + t2 * g[2] + n * g[4])
                        + outer(n, t1 * g[3] + t2 * g[4] + n * g[5])
                }
            };
            let al = cross_columns(point.r, &q);
            k.ll += q;
            k.al += al;
            k.aa += cross_columns(point.r, &al.transpose());
        }
        if pair.rolling.limit > 0.0 {
            let (omega, normal) = (pair.rolling.rolling(pair.relative.angular), pair.rolling.normal);
            let (_, isotropic, radial) = pair.rolling.impulse(omega);
            let across = Mat3::from_diagonal(Vec3::splat(isotropic)) - outer(normal, normal * isotropic);
            k.aa += across - outer(omega, omega * radial);
        }
        k.la = k.al.transpose();
        k
    }

    fn add_pair(&mut self, kin: &Kinematics, pair: &PairProblem, k: &SpatialMatrix, hand_blocks: usize) {
        for body in pair.bodies {
            let lever = body.lever();
            let moved;
            let about = if lever == Vec3::ZERO {
                k
            } else {
                moved = k.rows_moved(lever).columns_moved(lever);
                &moved
            };
            match body {
                PairBody::Fixed => {}
                PairBody::Link(i, _) => {
                    self.link_stiffness[i] += about;
                    self.link_touched[i] = true;
                }
                PairBody::Centre(slot) | PairBody::Object(slot, _) => {
                    self.add_square(hand_blocks + slot, about, 1.0)
                }
            }
        }
        let [a, b] = pair.bodies;
        if matches!(a, PairBody::Fixed) || matches!(b, PairBody::Fixed) {
            return;
        }
        let (rows_moved, moved);
        let across = if a.lever() == Vec3::ZERO {
            k
        } else {
            rows_moved = k.rows_moved(a.lever());
            &rows_moved
        };
        let across = if b.lever() == Vec3::ZERO {
            across
        } else {
            moved = across.columns_moved(b.lever());
            &moved
        };
        match (a, b) {
            (PairBody::Fixed, _) | (_, PairBody::Fixed) => {}
            (PairBody::Link(i, _), PairBody::Link(j, _)) => self.add_link_link(kin, i, j, across),
            (PairBody::Link(i, _), PairBody::Centre(slot) | PairBody::Object(slot, _)) => {
                self.add_link_object(kin, i, hand_blocks + slot, across);
            }
            (PairBody::Centre(slot) | PairBody::Object(slot, _), PairBody::Link(i, _)) => {
                self.add_link_object(kin, i, hand_blocks + slot, &across.transpose());
            }
            (PairBody::Centre(a) | PairBody::Object(a, _), PairBody::Centre(b) | PairBody::Object(b, _)) => {
                self.subtract_spatial(hand_blocks + a, hand_blocks + b, across);
            }
        }
    }

    /// Adds a spatial matrix to the diagonal block of the base or an object, whose order is (linear,
    /// angular). Only the lower half is used.
    #[inline]
    pub(super) fn add_square(&mut self, block: usize, k: &SpatialMatrix, sign: f64) {
        let Some(block) = self.cholesky.square(block) else { return };
        for i in 0..3 {
            for j in 0..=i {
                block[i][j] += sign * k.ll.col(j)[i];
                block[3 + i][3 + j] += sign * k.aa.col(j)[i];
            }
            for j in 0..3 {
                block[3 + i][j] += sign * k.al.col(j)[i];
            }
        }
    }

    /// Subtracts a spatial matrix from the block of two objects, or of the base and an object.
    #[inline]
    pub(super) fn subtract_spatial(&mut self, a: usize, b: usize, k: &SpatialMatrix) {
        let at = self.cholesky.at(a, b);
        let Some(block) = self.cholesky.data()[at.offset..].first_chunk_mut::<36>() else { return };
        let (block, _) = block.as_chunks_mut::<6>();
        // Stored by rows, or by columns if the elimination order is the other one.
        if at.column == 1 {
            for i in 0..3 {
                for j in 0..3 {
                    block[i][j] -= k.ll.col(j)[i];
                    block[i][3 + j] -= k.la.col(j)[i];
                    block[3 + i][j] -= k.al.col(j)[i];
                    block[3 + i][3 + j] -= k.aa.col(j)[i];
                }
            }
        } else {
            for j in 0..3 {
                for i in 0..3 {
                    block[j][i] -= k.ll.col(j)[i];
                    block[j][3 + i] -= k.al.col(j)[i];
                    block[3 + j][i] -= k.la.col(j)[i];
                    block[3 + j][3 + i] -= k.aa.col(j)[i];
                }
            }
        }
    }
}

#[cfg(test)]
mod tests {
    use super::super::friction_cone::{ConeLaw, RollingLaw};
    use super::super::newton::Stop;
    use super::super::problem::ObjectProblem;
    use super::*;
    use crate::config::Config;
    use palmares_models::Pose;
    use palmares_models::object::Object;
    use palmares_models::shape::Shape;
    use std::sync::Arc;

    const STIFF: f64 = 1e3;

    /// A pair of bodies with three sticking points about an origin; their friction acts at the part `lever`
    /// of their distance from it, and against spin at the arm `arm`, m.
    fn held(problem: &mut Problem, a: Owner, b: Owner, origin: Vec3, lever: f64, arm: f64) {
        let first = problem.points.len();
        for r in [Vec3::new(0.1, 0.0, 0.0), Vec3::new(-0.05, 0.1, 0.0), Vec3::new(0.0, -0.1, 0.02)] {
            let law = ConeLaw::new(1e3, 0.5 * STIFF, STIFF, [0.0, 0.0, 10.0]).with_spin(arm, 0.0);
            problem.points.push(Point::new(r, r * lever, [Vec3::X, Vec3::Y, Vec3::Z], law));
        }
        let rolling = RollingLaw::default();
        let mut pair = PairProblem::new(a, b, origin, rolling, first, first + 3);
        pair.patch = lever != 1.0 || arm > 0.0;
        problem.pairs.push(pair);
    }

    /// Two balls, one on furniture, one on the other; neither pair has its origin in a centre.
    fn two_on_each_other(lever: f64, arm: f64) -> (Model, Problem, Vec<f64>) {
        let mut model = Model::new(Config::default(), None).expect("no hand");
        let mut problem = Problem { fresh: true, ..Problem::default() };
        let mut start = Vec::new();
        for (k, z) in [(0, 0.1), (1, 0.3)] {
            let parts = vec![(Pose::IDENTITY, Shape::Sphere { radius: 0.1 })];
            let ball = Object::new("ball", parts, 2.0, 0.5, 0.0).expect("sound");
            model.add_object(Arc::new(ball)).expect("it fits");
            let (center, inertia) = (Vec3::new(0.01, 0.0, z), Mat3::from_diagonal(Vec3::new(0.3, 0.2, 0.1)));
            problem.objects.push(ObjectProblem { object: k, center, mass: 2.0, inertia, turn: None });
            let velocity = [0.3, -0.2, -1.0, 0.5, 0.1, -0.4];
            problem.momentum.extend([0.6, -0.4, -2.0, 0.15, 0.02, -0.04]);
            start.extend(velocity);
        }
        held(&mut problem, Owner::Static, Owner::Object(0), Vec3::ZERO, lever, arm);
        held(&mut problem, Owner::Object(0), Owner::Object(1), Vec3::new(0.0, 0.02, 0.2), lever, arm);
        (model, problem, start)
    }

    /// While every point sticks, the function is a quadratic form: one Newton step with its exact matrix
    /// reaches the minimum, with any other it does not.
    #[test]
    fn the_matrix_is_that_of_the_quadratic_form() {
        // With friction at the points, nearer to the middle, and against spin.
        for (lever, arm) in [(1.0, 0.0), (0.6, 0.0), (1.0, 0.05)] {
            let (model, mut problem, mut v) = two_on_each_other(lever, arm);
            let stop = Stop { tolerance: 1e-9, max_iterations: 20, max_work: u64::MAX };
            let report = Newton::default().solve(&model, &Kinematics::default(), &mut problem, &mut v, &stop);
            assert!(report.converged && report.iterations == 1, "{report:?}");
            assert!(problem.points.iter().all(|point| point.impulse[2] > 0.0), "a point has let go");
        }
    }
}
