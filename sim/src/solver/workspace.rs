//! Data that the solver keeps for an island: the block structure of its matrix, and scratch memory.

use super::cholesky::BlockCholesky;
use super::friction_cone::ConeHessian;
use super::problem::Problem;
use crate::dynamics::spatial::{Force, SpatialMatrix, SpatialVelocity};
use crate::model::Owner;

/// Inputs that determine the blocks and their couplings.
#[derive(Clone, Debug, Default, PartialEq)]
pub(super) struct BlockStructure {
    hand_dofs: usize,
    rows: usize,
    objects: Vec<usize>,
    pairs: Vec<(Owner, Owner)>,
}

impl BlockStructure {
    pub(super) fn describes(&self, problem: &Problem) -> bool {
        // Lone objects all have the same structure: their contacts couple nothing.
        if problem.hand_dofs == 0 && problem.objects.len() == 1 {
            return self.hand_dofs == 0 && self.objects.len() == 1;
        }
        self.hand_dofs == problem.hand_dofs
            && self.rows == problem.rows
            && self.objects.iter().eq(problem.objects.iter().map(|object| &object.object))
            && self.pairs.len() == problem.pairs.len()
            && self.pairs.iter().zip(&problem.pairs).all(|(&(a, b), pair)| a == pair.a && b == pair.b)
    }

    pub(super) fn describe(&mut self, problem: &Problem) {
        self.hand_dofs = problem.hand_dofs;
        self.rows = problem.rows;
        self.objects.clear();
        self.objects.extend(problem.objects.iter().map(|object| object.object));
        self.pairs.clear();
        self.pairs.extend(problem.pairs.iter().map(|pair| (pair.a, pair.b)));
    }
}

/// Position of a link's joint in the matrix.
#[derive(Clone, Copy, Debug)]
pub(super) struct Joint {
    /// Its parent link.
    pub parent: usize,
    /// Block of its coordinate.
    pub block: usize,
    /// Index in the block.
    pub row: usize,
}

/// Workspace of the solver; one per island, so that orderings are reused from step to step.
#[derive(Clone, Debug, Default)]
pub struct Newton {
    pub(super) cholesky: BlockCholesky,
    pub(super) sizes: Vec<usize>,
    pub(super) pattern: Vec<(u32, u32)>,
    /// Structure for which the present ordering was made.
    pub(super) block_structure: BlockStructure,
    /// Per hand dof: (block, index in it).
    pub(super) dof_block: Vec<(usize, usize)>,
    /// Per object in the model: index in the island.
    pub(super) slot: Vec<usize>,
    /// Per link: position of its joint; `None` for the base.
    pub(super) joints: Vec<Option<Joint>>,
    pub(super) link_velocity: Vec<SpatialVelocity>,
    pub(super) link_force: Vec<Force>,
    pub(super) link_stiffness: Vec<SpatialMatrix>,
    /// Whether each is not zero.
    pub(super) link_touched: Vec<bool>,
    pub(super) av: Vec<f64>,
    pub(super) a_direction: Vec<f64>,
    pub(super) gradient: Vec<f64>,
    /// Impulse that holds a base with prescribed velocities.
    pub(super) mount: [f64; 6],
    pub(super) direction: Vec<f64>,
    pub(super) rhs: Vec<f64>,
    pub(super) scratch: Vec<f64>,
    pub(super) inverse_diagonal: Vec<f64>,
    /// Square of the momenta in the metric of diag(A)⁻¹.
    pub(super) momentum: f64,
    pub(super) hessians: Vec<ConeHessian>,
    pub(super) axis_curvature: Vec<f64>,
    pub(super) row_curvature: Vec<f64>,
    pub(super) row_velocity: Vec<f64>,
    pub(super) row_direction: Vec<f64>,
    pub(super) columns: [Vec<(usize, SpatialVelocity)>; 2],
}
