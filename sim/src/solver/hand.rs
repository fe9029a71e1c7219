//! The hand's part of the Newton matrix: its own inertia, contacts of its links, limits and tendons.

use super::problem::Problem;
use super::workspace::{Joint, Newton};
use crate::dynamics::spatial::{Force, SpatialMatrix, SpatialVelocity};
use crate::dynamics::tree::Kinematics;
use crate::model::Model;

/// `to[first + k · step] += x_k`, force before moment; the common steps are unrolled.
#[inline]
fn add_strided(to: &mut [f64], first: usize, step: usize, x: Force, sign: f64) {
    #[inline(always)]
    fn fixed<const STEP: usize, const LENGTH: usize>(to: &mut [f64], x: [f64; 6], sign: f64) {
        let Some(to) = to.first_chunk_mut::<LENGTH>() else { return };
        for k in 0..6 {
            to[STEP * k] += sign * x[k];
        }
    }
    let (to, x) = (&mut to[first..], x.components());
    match step {
        1 => fixed::<1, 6>(to, x, sign),
        3 => fixed::<3, 16>(to, x, sign),
        4 => fixed::<4, 21>(to, x, sign),
        _ => {
            for (to, x) in to.iter_mut().step_by(step).zip(x) {
                *to += sign * x;
            }
        }
    }
}

/// A penalty on the diagonal freezes the rows of a bolted base.
const BOLTED: f64 = 1e30;

impl Newton {
    /// Lists the joint of every link.
    pub(super) fn list_joints(&mut self, model: &Model, problem: &Problem) {
        self.joints.clear();
        let (Some(hand), true) = (model.hand(), problem.hand_dofs > 0) else { return };
        self.joints.extend(hand.links.iter().map(|link| {
            let (block, row) = self.dof_block[6 + link.joint.as_ref()?.coordinate];
            Some(Joint { parent: link.parent?, block, row })
        }));
    }

    /// Writes A of the hand.
    pub(super) fn put_hand(&mut self, model: &Model, problem: &Problem) {
        let h = problem.hand_dofs;
        if h == 0 {
            return;
        }
        for block in 0..model.hand_clusters() {
            let rows = model.clusters()[block].dofs.clone();
            for other in (block > 0).then_some(0).into_iter().chain([block]) {
                let columns = model.clusters()[other].dofs.clone();
                let at = self.cholesky.at(block, other);
                let data = &mut self.cholesky.data()[at.offset..];
                for (i, row) in rows.clone().enumerate() {
                    let line = &problem.hand_matrix[row * h..][columns.clone()];
                    if at.column == 1 {
                        for (to, x) in data[i * at.row..].iter_mut().zip(line) {
                            *to = *x;
                        }
                    } else {
                        for (to, x) in data[i..].chunks_mut(at.column).zip(line) {
                            to[0] = *x;
                        }
                    }
                }
            }
        }
    }

    /// Adds the coupling −Sᵀ K of a link with an object; `k` has the link's rows about the base origin.
    pub(super) fn add_link_object(
        &mut self,
        kin: &Kinematics,
        link: usize,
        object_block: usize,
        k: &SpatialMatrix,
    ) {
        let columns = k.transpose();
        let mut i = link;
        while let Some(Joint { parent, block, row }) = self.joints[i] {
            let f = columns.mul(kin.screw[i]);
            let at = self.cholesky.at(block, object_block);
            add_strided(self.cholesky.data(), at.offset + row * at.row, at.column, f, -1.0);
            i = parent;
        }
        self.subtract_spatial(0, object_block, k);
    }

    /// The joints between a link and the base: their index in the block and screws; and the block, which is
    /// the same for all.
    fn chain(&self, kin: &Kinematics, mut link: usize, out: &mut Vec<(usize, SpatialVelocity)>) -> usize {
        out.clear();
        let mut of = 0;
        while let Some(Joint { parent, block, row }) = self.joints[link] {
            of = block;
            out.push((row, kin.screw[link]));
            link = parent;
        }
        of
    }

    /// Adds the coupling −(Sᵢᵀ K Sⱼ + transpose) of two links of the hand; K is about the base origin on both
    /// sides. The base's columns of S are unit motions, and each link's chain is within one block.
    pub(super) fn add_link_link(&mut self, kin: &Kinematics, a: usize, b: usize, k: &SpatialMatrix) {
        let [mut rows, mut columns] = std::mem::take(&mut self.columns);
        let (block_a, block_b) = (self.chain(kin, a, &mut rows), self.chain(kin, b, &mut columns));
        // Fingers with each other, and the finger of B with the base.
        if !columns.is_empty() {
            let base = self.cholesky.at(0, block_b);
            let across = (!rows.is_empty()).then(|| self.cholesky.at(block_a, block_b));
            let data = self.cholesky.data();
            for &(j, screw_b) in &columns {
                let f = k.mul(screw_b);
                if let Some(at) = across {
                    for &(i, screw_a) in &rows {
                        let x = screw_a.dot(f);
                        data[at.offset + i * at.row + j * at.column] -= x;
                        if block_a == block_b {
                            data[at.offset + j * at.row + i * at.column] -= x;
                        }
                    }
                }
                add_strided(data, base.offset + j * base.column, base.row, f, -1.0);
            }
        }
        // The base with the finger of A: Sᵀ K by the columns of K.
        let transpose = k.transpose();
        if !rows.is_empty() {
            let at = self.cholesky.at(block_a, 0);
            for &(i, screw) in &rows {
                let f = transpose.mul(screw);
                add_strided(self.cholesky.data(), at.offset + i * at.row, at.column, f, -1.0);
            }
        }
        self.add_square(0, k, -1.0);
        self.add_square(0, &transpose, -1.0);
        self.columns = [rows, columns];
    }

    /// Adds `Sᵀ K S` of all links: composite stiffness, as in the composite-rigid-body algorithm.
    pub(super) fn add_links(&mut self, kin: &Kinematics) {
        for i in (1..self.joints.len()).rev() {
            let (Some(Joint { parent, block, row }), true) = (self.joints[i], self.link_touched[i]) else {
                continue;
            };
            // A parent comes before its children.
            let (before, own) = self.link_stiffness.split_at_mut(i);
            before[parent] += &own[0];
            self.link_touched[parent] = true;
            let f = own[0].mul(kin.screw[i]);
            let (square, at) = (self.cholesky.at(block, block), self.cholesky.at(block, 0));
            let data = self.cholesky.data();
            let mut j = i;
            // Only the lower half of diagonal blocks is used.
            while let Some(Joint { parent, row: column, .. }) = self.joints[j] {
                // A joint that follows another moves with its coordinate: both halves of their coupling are
                // on the diagonal.
                let halves = if j != i && column == row { 2.0 } else { 1.0 };
                let x = halves * kin.screw[j].dot(f);
                data[square.offset + row.max(column) * square.row + row.min(column)] += x;
                j = parent;
            }
            add_strided(data, at.offset + row * at.row, at.column, f, 1.0);
        }
        if self.link_touched[0] {
            let base = self.link_stiffness[0];
            self.add_square(0, &base, 1.0);
        }
    }

    /// Adds limits, servo, mount and tendons.
    pub(super) fn add_terms(&mut self, problem: &Problem) {
        for (term, &k) in problem.axis_terms.iter().zip(&self.axis_curvature) {
            let (block, i) = self.dof_block[term.dof];
            let at = self.cholesky.at(block, block);
            self.cholesky.data()[at.offset + i * (at.row + at.column)] += k;
        }
        self.add_rows(problem);
        if problem.bolted {
            // Practically infinite mass: the joints' motion does not depend on it, and the base's own motion
            // is not solved.
            if let Some(base) = self.cholesky.square(0) {
                for (i, row) in base.iter_mut().enumerate() {
                    row[i] *= BOLTED;
                }
            }
        }
    }

    /// Tendons as the last, negative block: rows R, diagonal −1/curvature. A slack or saturated tendon has no
    /// curvature and is decoupled.
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
}
