//! Newton's method on one island, with exact line search.
//!
//! Contacts enter through the relative spatial velocity of their two bodies. A pair of bodies contributes one
//! 6x6 matrix `K = Σ Wᵀ G W` however many points it has, and K on a link adds up down the tree exactly as
//! inertia does in the composite-rigid-body algorithm: `H = Sᵀ K S` costs as much as a mass matrix, not as
//! much as all contact Jacobians.

use super::cholesky::BlockCholesky;
use super::cone::{ConeHessian, ConeLaw, RollingLaw};
use super::terms::{AxisTerm, RowTerm};
use crate::dynamics::spatial::{Force, Motion, SpatialMatrix, cross_columns, outer};
use crate::dynamics::tree::Kinematics;
use crate::model::{Model, Owner};
use palmares_models::{Mat3, Vec3};

/// Contact point in the iteration.
#[derive(Clone, Copy, Debug)]
pub struct Point {
    /// Place from the pair's origin, m.
    pub r: Vec3,
    /// Contact axes: two tangents, normal.
    pub axes: [Vec3; 3],
    /// The law.
    pub law: ConeLaw,
    /// Impulse on body B in contact axes.
    pub impulse: [f64; 3],
    /// Contact velocity.
    pub velocity: [f64; 3],
    direction: [f64; 3],
}

impl Point {
    /// A point before its first iteration.
    pub fn new(r: Vec3, axes: [Vec3; 3], law: ConeLaw) -> Self {
        Point { r, axes, law, impulse: [0.0; 3], velocity: [0.0; 3], direction: [0.0; 3] }
    }

    #[inline]
    fn project(&self, relative: Motion) -> [f64; 3] {
        let v = relative.at(self.r);
        [self.axes[0].dot(v), self.axes[1].dot(v), self.axes[2].dot(v)]
    }
}

/// Two bodies in contact.
#[derive(Clone, Debug)]
pub struct PairProblem {
    /// Body A.
    pub a: Owner,
    /// Body B.
    pub b: Owner,
    /// Origin of the pair's spatial quantities in the world, m.
    pub origin: Vec3,
    /// Rolling resistance.
    pub rolling: RollingLaw,
    /// First point in [`Problem::points`].
    pub first: usize,
    /// One past the last.
    pub end: usize,
    relative: Motion,
    direction: Motion,
}

impl PairProblem {
    /// A pair before its first iteration.
    pub fn new(a: Owner, b: Owner, origin: Vec3, rolling: RollingLaw, first: usize, end: usize) -> Self {
        PairProblem { a, b, origin, rolling, first, end, relative: Motion::ZERO, direction: Motion::ZERO }
    }
}

/// A free object in an island.
#[derive(Clone, Copy, Debug)]
pub struct ObjectProblem {
    /// Which object.
    pub object: usize,
    /// Centre of mass in the world, m.
    pub center: Vec3,
    /// kg
    pub mass: f64,
    /// Inertia about the centre of mass in world axes.
    pub inertia: Mat3,
}

/// An island's minimisation problem. Local velocities: the hand's, if it takes part, then six per object.
#[derive(Clone, Debug, Default)]
pub struct Problem {
    /// Length of the hand's part; 0 without the hand.
    pub hand_dofs: usize,
    /// A of the hand, row-major.
    pub hand_matrix: Vec<f64>,
    /// The objects, in ascending order.
    pub objects: Vec<ObjectProblem>,
    /// A v*.
    pub momentum: Vec<f64>,
    /// Pairs in contact.
    pub pairs: Vec<PairProblem>,
    /// Their points.
    pub points: Vec<Point>,
    /// Limits and servo of the hand.
    pub axis_terms: Vec<AxisTerm>,
    /// Tendons of the hand.
    pub row_terms: Vec<RowTerm>,
    /// Number of `row_terms` in use.
    pub rows: usize,
}

/// How a solve went.
#[derive(Clone, Copy, Debug, Default)]
pub struct SolveReport {
    /// Newton iterations.
    pub iterations: usize,
    /// Line search evaluations.
    pub evaluations: usize,
    /// Relative norm of the gradient at the end.
    pub residual: f64,
    /// Whether the tolerance was reached.
    pub converged: bool,
}

/// What determines the blocks and their couplings.
#[derive(Clone, Debug, Default, PartialEq)]
struct LayOut {
    hand_dofs: usize,
    rows: usize,
    objects: Vec<usize>,
    pairs: Vec<(Owner, Owner)>,
}

impl LayOut {
    fn describes(&self, problem: &Problem) -> bool {
        self.hand_dofs == problem.hand_dofs
            && self.rows == problem.rows
            && self.objects.iter().eq(problem.objects.iter().map(|object| &object.object))
            && self.pairs.len() == problem.pairs.len()
            && self.pairs.iter().zip(&problem.pairs).all(|(&(a, b), pair)| a == pair.a && b == pair.b)
    }

    fn describe(&mut self, problem: &Problem) {
        self.hand_dofs = problem.hand_dofs;
        self.rows = problem.rows;
        self.objects.clear();
        self.objects.extend(problem.objects.iter().map(|object| object.object));
        self.pairs.clear();
        self.pairs.extend(problem.pairs.iter().map(|pair| (pair.a, pair.b)));
    }
}

/// Workspace of the solver; one per island, so that orderings are re-used from step to step.
#[derive(Clone, Debug, Default)]
pub struct Newton {
    cholesky: BlockCholesky,
    sizes: Vec<usize>,
    pattern: Vec<(u32, u32)>,
    /// What the present ordering was made for.
    laid_out: LayOut,
    /// Of every hand dof: (block, place in it).
    dof_block: Vec<(usize, usize)>,
    /// Of every object in the model: place in the island.
    slot: Vec<usize>,
    link_velocity: Vec<Motion>,
    link_force: Vec<Force>,
    link_stiffness: Vec<SpatialMatrix>,
    av: Vec<f64>,
    a_direction: Vec<f64>,
    gradient: Vec<f64>,
    direction: Vec<f64>,
    rhs: Vec<f64>,
    scratch: Vec<f64>,
    inverse_diagonal: Vec<f64>,
    hessians: Vec<ConeHessian>,
    axis_curvature: Vec<f64>,
    row_curvature: Vec<f64>,
    row_velocity: Vec<f64>,
    row_direction: Vec<f64>,
    columns: [Vec<(usize, Motion)>; 2],
}

impl Newton {
    /// Minimises over `v`, which holds the start and then the solution. Impulses stay in the problem's
    /// points and are returned for tendons by [`Newton::row_impulse`].
    pub fn solve(
        &mut self,
        model: &Model,
        kin: &Kinematics,
        problem: &mut Problem,
        v: &mut [f64],
        tolerance: f64,
        max_iterations: usize,
    ) -> SolveReport {
        self.lay_out(model, problem);
        let n = v.len();
        for buffer in
            [&mut self.av, &mut self.a_direction, &mut self.gradient, &mut self.direction, &mut self.rhs]
        {
            buffer.resize(n, 0.0);
        }
        self.hessians.clear();
        self.hessians.resize(problem.points.len(), ConeHessian::Open);
        self.axis_curvature.resize(problem.axis_terms.len(), 0.0);
        for buffer in [&mut self.row_curvature, &mut self.row_velocity, &mut self.row_direction] {
            buffer.resize(problem.rows, 0.0);
        }
        multiply(problem, v, &mut self.av);
        self.project(model, kin, problem, v, false);
        let mut report = SolveReport::default();
        loop {
            self.gradient_at(model, kin, problem, v);
            report.residual = self.residual(problem);
            if report.residual < tolerance {
                report.converged = true;
                return report;
            }
            if report.iterations == max_iterations {
                return report;
            }
            report.iterations += 1;
            self.assemble(model, kin, problem);
            if !self.cholesky.factor() {
                report.residual = f64::NAN;
                return report;
            }
            self.rhs.resize(n, 0.0);
            for i in 0..n {
                self.rhs[i] = -self.gradient[i];
            }
            if problem.rows > 0 && problem.hand_dofs > 0 {
                self.rhs.resize(n + problem.rows, 0.0);
            }
            self.cholesky.solve(&mut self.rhs, &mut self.scratch);
            self.direction.copy_from_slice(&self.rhs[..n]);
            let direction = std::mem::take(&mut self.direction);
            self.project(model, kin, problem, &direction, true);
            multiply(problem, &direction, &mut self.a_direction);
            let step = self.line_search(problem, v, &direction, &mut report);
            for i in 0..n {
                v[i] += step * direction[i];
                self.av[i] += step * self.a_direction[i];
            }
            self.direction = direction;
            for pair in &mut problem.pairs {
                pair.relative = pair.relative + pair.direction * step;
            }
            for point in &mut problem.points {
                for k in 0..3 {
                    point.velocity[k] += step * point.direction[k];
                }
            }
            for k in 0..problem.rows {
                self.row_velocity[k] += step * self.row_direction[k];
            }
        }
    }

    /// Impulse of a tendon at the solution.
    pub fn row_impulse(&self, problem: &Problem, row: usize) -> f64 {
        problem.row_terms[row].law.impulse(self.row_velocity[row]).0
    }

    /// Blocks and their couplings: the hand's clusters, the objects, and the tendons last.
    fn lay_out(&mut self, model: &Model, problem: &Problem) {
        self.inverse_diagonal.clear();
        let h = problem.hand_dofs;
        self.inverse_diagonal.extend((0..h).map(|i| 1.0 / problem.hand_matrix[i * h + i]));
        for object in &problem.objects {
            let i = object.inertia;
            self.inverse_diagonal.extend([1.0 / object.mass; 3]);
            self.inverse_diagonal.extend([1.0 / i.x_axis.x, 1.0 / i.y_axis.y, 1.0 / i.z_axis.z]);
        }
        if self.laid_out.describes(problem) {
            return;
        }
        self.laid_out.describe(problem);
        self.sizes.clear();
        self.dof_block.clear();
        self.slot.resize(model.objects().len(), usize::MAX);
        let hand_blocks = if problem.hand_dofs > 0 { model.hand_clusters() } else { 0 };
        for (block, cluster) in model.clusters()[..hand_blocks].iter().enumerate() {
            self.sizes.push(cluster.dofs.len());
            for (k, _) in cluster.dofs.clone().enumerate() {
                self.dof_block.push((block, k));
            }
        }
        for (k, object) in problem.objects.iter().enumerate() {
            self.slot[object.object] = k;
            self.sizes.push(6);
        }
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
            let block = self.sizes.len();
            self.sizes.push(problem.rows);
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

    /// Body velocities at `x`, then velocities of pairs, points and rows; of the search direction if asked.
    fn project(
        &mut self,
        model: &Model,
        kin: &Kinematics,
        problem: &mut Problem,
        x: &[f64],
        direction: bool,
    ) {
        if let (Some(hand), true) = (model.hand(), problem.hand_dofs > 0) {
            kin.velocities(hand, x, &mut self.link_velocity);
            for (k, term) in problem.row_terms[..problem.rows].iter().enumerate() {
                let u = term.apply(x);
                if direction {
                    self.row_direction[k] = u;
                } else {
                    self.row_velocity[k] = u;
                }
            }
        }
        let Problem { hand_dofs, objects, pairs, points, .. } = problem;
        for pair in pairs {
            let velocity = |owner: Owner| match owner {
                Owner::Static => Motion::ZERO,
                Owner::Link(i) => self.link_velocity[i].moved(pair.origin - kin.origin),
                Owner::Object(k) => {
                    let slot = self.slot[k];
                    let v = &x[*hand_dofs + 6 * slot..*hand_dofs + 6 * slot + 6];
                    let motion =
                        Motion { linear: Vec3::new(v[0], v[1], v[2]), angular: Vec3::new(v[3], v[4], v[5]) };
                    motion.moved(pair.origin - objects[slot].center)
                }
            };
            let relative = velocity(pair.b) - velocity(pair.a);
            if direction {
                pair.direction = relative;
            } else {
                pair.relative = relative;
            }
            for point in &mut points[pair.first..pair.end] {
                let u = point.project(relative);
                if direction {
                    point.direction = u;
                } else {
                    point.velocity = u;
                }
            }
        }
    }

    /// Gradient `A v − A v* − Σ Jᵀ γ(J v)`, and the impulses and curvatures on the way.
    fn gradient_at(&mut self, model: &Model, kin: &Kinematics, problem: &mut Problem, v: &[f64]) {
        let h = problem.hand_dofs;
        for i in 0..v.len() {
            self.gradient[i] = self.av[i] - problem.momentum[i];
        }
        let links = if h > 0 { model.hand().map_or(0, |hand| hand.links.len()) } else { 0 };
        self.link_force.clear();
        self.link_force.resize(links, Force::ZERO);
        for pair in &problem.pairs {
            let mut wrench = Force::ZERO;
            for k in pair.first..pair.end {
                let point = &mut problem.points[k];
                let (gamma, hessian) = point.law.impulse(point.velocity);
                point.impulse = gamma;
                self.hessians[k] = hessian;
                if !matches!(hessian, ConeHessian::Open) {
                    let f = point.axes[0] * gamma[0] + point.axes[1] * gamma[1] + point.axes[2] * gamma[2];
                    wrench += Force { moment: point.r.cross(f), force: f };
                }
            }
            if pair.rolling.limit > 0.0 {
                wrench.moment += pair.rolling.impulse(pair.relative.angular).0;
            }
            for (owner, sign) in [(pair.a, -1.0), (pair.b, 1.0)] {
                match owner {
                    Owner::Static => {}
                    Owner::Link(i) => {
                        let f = wrench.moved(kin.origin - pair.origin);
                        self.link_force[i] += Force { moment: f.moment * sign, force: f.force * sign };
                    }
                    Owner::Object(k) => {
                        let slot = self.slot[k];
                        let f = wrench.moved(problem.objects[slot].center - pair.origin);
                        let at = h + 6 * slot;
                        for (k, x) in f.force.to_array().into_iter().chain(f.moment.to_array()).enumerate() {
                            self.gradient[at + k] -= sign * x;
                        }
                    }
                }
            }
        }
        let (Some(hand), true) = (model.hand(), h > 0) else { return };
        for i in (1..links).rev() {
            if let (Some(parent), Some(joint)) = (hand.links[i].parent, &hand.links[i].joint) {
                let f = self.link_force[i];
                self.gradient[6 + joint.coordinate] -= kin.screw[i].dot(f);
                self.link_force[parent] += f;
            }
        }
        let f = self.link_force[0];
        for (k, x) in f.force.to_array().into_iter().chain(f.moment.to_array()).enumerate() {
            self.gradient[k] -= x;
        }
        for (k, term) in problem.axis_terms.iter().enumerate() {
            let (impulse, curvature) = term.law.impulse(term.sign * v[term.dof]);
            self.gradient[term.dof] -= term.sign * impulse;
            self.axis_curvature[k] = curvature;
        }
        for (k, term) in problem.row_terms[..problem.rows].iter().enumerate() {
            let (impulse, curvature) = term.law.impulse(self.row_velocity[k]);
            self.row_curvature[k] = curvature;
            for &(dof, r) in &term.row {
                self.gradient[dof] -= r * impulse;
            }
        }
    }

    /// Norm of the gradient relative to the momenta, in the metric of diag(A)⁻¹.
    fn residual(&self, problem: &Problem) -> f64 {
        let (mut gradient, mut momentum, mut impulse) = (0.0, 0.0, 0.0);
        for i in 0..self.gradient.len() {
            let w = self.inverse_diagonal[i];
            let (g, p) = (self.gradient[i], problem.momentum[i]);
            let j = self.av[i] - p - g;
            gradient += w * g * g;
            momentum += w * p * p;
            impulse += w * j * j;
        }
        // Below 1e-14 √J all velocities are rounding noise.
        if gradient < 1e-28 { 0.0 } else { (gradient / f64::max(momentum, impulse)).sqrt() }
    }

    fn assemble(&mut self, model: &Model, kin: &Kinematics, problem: &Problem) {
        self.cholesky.clear();
        let h = problem.hand_dofs;
        let hand_blocks = if h > 0 { model.hand_clusters() } else { 0 };
        let links = self.link_force.len();
        self.link_stiffness.clear();
        self.link_stiffness.resize(links, SpatialMatrix::ZERO);
        for (slot, object) in problem.objects.iter().enumerate() {
            let at = self.cholesky.at(hand_blocks + slot, hand_blocks + slot);
            let data = self.cholesky.data();
            for i in 0..3 {
                data[at.offset + 7 * i] += object.mass;
                for j in 0..=i {
                    data[at.offset + 6 * (3 + i) + 3 + j] += object.inertia.col(j)[i];
                }
            }
        }
        for block in 0..hand_blocks {
            let rows = model.clusters()[block].dofs.clone();
            for other in if block == 0 { [block, block] } else { [0, block] } {
                let columns = model.clusters()[other].dofs.clone();
                let at = self.cholesky.at(block, other);
                let data = self.cholesky.data();
                for (i, row) in rows.clone().enumerate() {
                    for (j, column) in columns.clone().enumerate() {
                        data[at.offset + i * at.row + j * at.column] = problem.hand_matrix[row * h + column];
                    }
                }
            }
        }
        for pair in &problem.pairs {
            let k = self.pair_stiffness(pair, problem);
            self.add_pair(model, kin, problem, pair, &k, hand_blocks);
        }
        if h > 0 {
            self.add_links(model, kin);
            for (term, &k) in problem.axis_terms.iter().zip(&self.axis_curvature) {
                let (block, i) = self.dof_block[term.dof];
                let at = self.cholesky.at(block, block);
                self.cholesky.data()[at.offset + i * at.row + i * at.column] += k;
            }
            self.add_rows(problem);
        }
    }

    /// `Σ Wᵀ G W` over the points of a pair, about its origin.
    fn pair_stiffness(&self, pair: &PairProblem, problem: &Problem) -> SpatialMatrix {
        let mut k = SpatialMatrix::ZERO;
        for (point, hessian) in
            problem.points[pair.first..pair.end].iter().zip(&self.hessians[pair.first..pair.end])
        {
            let [t1, t2, n] = point.axes;
            let q = match hessian {
                ConeHessian::Open => continue,
                ConeHessian::Stick => {
                    let law = &point.law;
                    Mat3::from_diagonal(Vec3::splat(law.tangential))
                        + outer(n, n * (law.normal - law.tangential))
                }
                ConeHessian::Slip(g) => {
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
            let omega = pair.relative.angular;
            let (_, isotropic, radial) = pair.rolling.impulse(omega);
            k.aa += Mat3::from_diagonal(Vec3::splat(isotropic)) - outer(omega, omega * radial);
        }
        k.la = k.al.transpose();
        k
    }

    fn add_pair(
        &mut self,
        model: &Model,
        kin: &Kinematics,
        problem: &Problem,
        pair: &PairProblem,
        k: &SpatialMatrix,
        hand_blocks: usize,
    ) {
        // Where body `owner` keeps its own origin, seen from there to the pair's.
        let lever = |owner: Owner| match owner {
            Owner::Static => Vec3::ZERO,
            Owner::Link(_) => pair.origin - kin.origin,
            Owner::Object(o) => pair.origin - problem.objects[self.slot[o]].center,
        };
        let (from_a, from_b) = (lever(pair.a), lever(pair.b));
        for (owner, d) in [(pair.a, from_a), (pair.b, from_b)] {
            match owner {
                Owner::Static => {}
                Owner::Link(i) => self.link_stiffness[i] += k.rows_moved(d).columns_moved(d),
                Owner::Object(o) => {
                    let block = hand_blocks + self.slot[o];
                    let own = k.rows_moved(d).columns_moved(d);
                    self.add_spatial(block, block, &own, 1.0);
                }
            }
        }
        let across = k.rows_moved(from_a).columns_moved(from_b);
        match (pair.a, pair.b) {
            (Owner::Object(a), Owner::Object(b)) => {
                let (a, b) = (hand_blocks + self.slot[a], hand_blocks + self.slot[b]);
                self.add_spatial(a, b, &across, -1.0);
            }
            (Owner::Link(i), Owner::Object(o)) => {
                self.add_link_object(model, kin, i, hand_blocks + self.slot[o], &across);
            }
            (Owner::Object(o), Owner::Link(i)) => {
                self.add_link_object(model, kin, i, hand_blocks + self.slot[o], &across.transpose());
            }
            (Owner::Link(i), Owner::Link(j)) => self.add_link_link(model, kin, i, j, &across),
            (Owner::Static, _) | (_, Owner::Static) => {}
        }
    }

    /// Adds a spatial matrix to a block of two objects, or of the base and an object, whose order is
    /// (linear, angular).
    fn add_spatial(&mut self, a: usize, b: usize, k: &SpatialMatrix, sign: f64) {
        let at = self.cholesky.at(a, b);
        let data = self.cholesky.data();
        for (j, columns) in [(&k.ll, &k.al), (&k.la, &k.aa)].into_iter().enumerate() {
            for c in 0..3 {
                let column = at.offset + (3 * j + c) * at.column;
                let (top, bottom) = (columns.0.col(c), columns.1.col(c));
                for r in 0..3 {
                    data[column + r * at.row] += sign * top[r];
                    data[column + (3 + r) * at.row] += sign * bottom[r];
                }
            }
        }
    }

    /// Coupling −Sᵀ K of a link with an object; `k` has the link's rows about the base origin.
    fn add_link_object(
        &mut self,
        model: &Model,
        kin: &Kinematics,
        link: usize,
        object_block: usize,
        k: &SpatialMatrix,
    ) {
        let Some(hand) = model.hand() else { return };
        let columns = k.transpose();
        let mut i = link;
        while let (Some(parent), Some(joint)) = (hand.links[i].parent, &hand.links[i].joint) {
            let f = columns.mul(kin.screw[i]);
            let (block, row) = self.dof_block[6 + joint.coordinate];
            let at = self.cholesky.at(block, object_block);
            let data = self.cholesky.data();
            for (c, x) in f.force.to_array().into_iter().chain(f.moment.to_array()).enumerate() {
                data[at.offset + row * at.row + c * at.column] -= x;
            }
            i = parent;
        }
        self.add_spatial(0, object_block, k, -1.0);
    }

    /// Coupling −(Sᵢᵀ K Sⱼ + transpose) of two links of the hand; K is about the base origin on both sides.
    fn add_link_link(&mut self, model: &Model, kin: &Kinematics, a: usize, b: usize, k: &SpatialMatrix) {
        let Some(hand) = model.hand() else { return };
        // As columns of both chains; the base's six columns are unit motions.
        let chain = |mut i: usize, out: &mut Vec<(usize, Motion)>| {
            out.clear();
            while let (Some(parent), Some(joint)) = (hand.links[i].parent, &hand.links[i].joint) {
                out.push((6 + joint.coordinate, kin.screw[i]));
                i = parent;
            }
            for axis in 0..3 {
                let mut e = [0.0; 3];
                e[axis] = 1.0;
                out.push((axis, Motion { angular: Vec3::ZERO, linear: Vec3::from_array(e) }));
                out.push((3 + axis, Motion { angular: Vec3::from_array(e), linear: Vec3::ZERO }));
            }
        };
        let [mut rows, mut columns] = std::mem::take(&mut self.columns);
        chain(a, &mut rows);
        chain(b, &mut columns);
        for &(dof_b, screw_b) in &columns {
            let f = k.mul(screw_b);
            let (block_b, j) = self.dof_block[dof_b];
            for &(dof_a, screw_a) in &rows {
                let x = screw_a.dot(f);
                let (block_a, i) = self.dof_block[dof_a];
                let at = self.cholesky.at(block_a, block_b);
                let data = self.cholesky.data();
                data[at.offset + i * at.row + j * at.column] -= x;
                if block_a == block_b {
                    data[at.offset + j * at.row + i * at.column] -= x;
                }
            }
        }
        self.columns = [rows, columns];
    }

    /// `Sᵀ K S` of all links: composite stiffness, as in the composite-rigid-body algorithm.
    fn add_links(&mut self, model: &Model, kin: &Kinematics) {
        let Some(hand) = model.hand() else { return };
        for i in (1..hand.links.len()).rev() {
            let (Some(parent), Some(joint)) = (hand.links[i].parent, &hand.links[i].joint) else { continue };
            let own = self.link_stiffness[i];
            if own.ll == Mat3::ZERO && own.aa == Mat3::ZERO {
                continue;
            }
            self.link_stiffness[parent] += own;
            let f = own.mul(kin.screw[i]);
            let (block, row) = self.dof_block[6 + joint.coordinate];
            let mut j = i;
            while let (Some(up), Some(joint)) = (hand.links[j].parent, &hand.links[j].joint) {
                let x = kin.screw[j].dot(f);
                let (_, column) = self.dof_block[6 + joint.coordinate];
                let at = self.cholesky.at(block, block);
                let data = self.cholesky.data();
                data[at.offset + row * at.row + column * at.column] += x;
                if j != i {
                    data[at.offset + column * at.row + row * at.column] += x;
                }
                j = up;
            }
            let at = self.cholesky.at(block, 0);
            let data = self.cholesky.data();
            for (c, x) in f.force.to_array().into_iter().chain(f.moment.to_array()).enumerate() {
                data[at.offset + row * at.row + c * at.column] += x;
            }
        }
        let base = self.link_stiffness[0];
        self.add_spatial(0, 0, &base, 1.0);
    }

    /// Tendons as the last, negative block: rows R, diagonal −1/curvature. A slack or saturated tendon has
    /// no curvature and stands apart.
    fn add_rows(&mut self, problem: &Problem) {
        if problem.rows == 0 {
            return;
        }
        let last = self.sizes.len() - 1;
        for (k, term) in problem.row_terms[..problem.rows].iter().enumerate() {
            let curvature = self.row_curvature[k];
            let at = self.cholesky.at(last, last);
            let diagonal = if curvature > 0.0 { -1.0 / curvature } else { -1.0 };
            self.cholesky.data()[at.offset + k * at.row + k * at.column] = diagonal;
            if curvature > 0.0 {
                for &(dof, r) in &term.row {
                    let (block, i) = self.dof_block[dof];
                    let at = self.cholesky.at(last, block);
                    self.cholesky.data()[at.offset + k * at.row + i * at.column] = r;
                }
            }
        }
    }

    /// Root of ℓ'(α) along the direction by safeguarded Newton; the whole step is tried first.
    fn line_search(&self, problem: &Problem, v: &[f64], direction: &[f64], report: &mut SolveReport) -> f64 {
        let (mut slope0, mut quadratic, mut linear) = (0.0, 0.0, 0.0);
        for i in 0..v.len() {
            slope0 += direction[i] * self.gradient[i];
            quadratic += direction[i] * self.a_direction[i];
            linear += direction[i] * (self.av[i] - problem.momentum[i]);
        }
        let derivatives = |alpha: f64| {
            let (mut first, mut second) = (linear + alpha * quadratic, quadratic);
            for pair in &problem.pairs {
                for point in &problem.points[pair.first..pair.end] {
                    let w = point.direction;
                    let u = [
                        point.velocity[0] + alpha * w[0],
                        point.velocity[1] + alpha * w[1],
                        point.velocity[2] + alpha * w[2],
                    ];
                    let (gamma, hessian) = point.law.impulse(u);
                    first -= w[0] * gamma[0] + w[1] * gamma[1] + w[2] * gamma[2];
                    second += point.law.curvature(&hessian, w);
                }
                if pair.rolling.limit > 0.0 {
                    let w = pair.direction.angular;
                    let omega = pair.relative.angular + w * alpha;
                    let (torque, isotropic, radial) = pair.rolling.impulse(omega);
                    first -= w.dot(torque);
                    second += isotropic * w.dot(w) - radial * omega.dot(w).powi(2);
                }
            }
            for term in &problem.axis_terms {
                let du = term.sign * direction[term.dof];
                let (impulse, curvature) = term.law.impulse(term.sign * v[term.dof] + alpha * du);
                first -= du * impulse;
                second += curvature * du * du;
            }
            for (k, term) in problem.row_terms[..problem.rows].iter().enumerate() {
                let du = self.row_direction[k];
                let (impulse, curvature) = term.law.impulse(self.row_velocity[k] + alpha * du);
                first -= du * impulse;
                second += curvature * du * du;
            }
            (first, second)
        };
        let (mut alpha, mut low, mut high) = (1.0, 0.0, f64::INFINITY);
        for _ in 0..40 {
            report.evaluations += 1;
            let (first, second) = derivatives(alpha);
            if first.abs() <= 1e-3 * slope0.abs() {
                break;
            }
            if first < 0.0 {
                low = alpha;
            } else {
                high = alpha;
            }
            let mut next = alpha - first / second;
            if !(next > low && next < high) {
                next = if high.is_finite() { 0.5 * (low + high) } else { 2.0 * alpha };
            }
            if (next - alpha).abs() < 1e-12 {
                break;
            }
            alpha = next;
        }
        alpha
    }
}

/// `out = A x`
fn multiply(problem: &Problem, x: &[f64], out: &mut [f64]) {
    let h = problem.hand_dofs;
    for i in 0..h {
        let row = &problem.hand_matrix[i * h..(i + 1) * h];
        // Four partial sums: a fixed order that the processor can still overlap.
        let mut s = [0.0; 4];
        let (chunks, tail) = row.as_chunks::<4>();
        let (xs, x_tail) = x[..h].as_chunks::<4>();
        for (a, b) in chunks.iter().zip(xs) {
            for k in 0..4 {
                s[k] += a[k] * b[k];
            }
        }
        for (a, b) in tail.iter().zip(x_tail) {
            s[0] += a * b;
        }
        out[i] = (s[0] + s[1]) + (s[2] + s[3]);
    }
    for (slot, object) in problem.objects.iter().enumerate() {
        let at = h + 6 * slot;
        for k in 0..3 {
            out[at + k] = object.mass * x[at + k];
        }
        let w = object.inertia * Vec3::new(x[at + 3], x[at + 4], x[at + 5]);
        out[at + 3..at + 6].copy_from_slice(&w.to_array());
    }
}
