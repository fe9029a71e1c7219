//! Scratch memory of the repeated solves of a step.

use crate::dynamics::spatial::SpatialVelocity;

/// Of [`super::blow_energy`].
#[derive(Default)]
pub(crate) struct Blend {
    /// Impulses and velocities of the points with rebounds.
    pub(super) rebounding: Vec<[[f64; 4]; 2]>,
    /// Generalized velocity with rebounds.
    pub(super) v: Vec<f64>,
    /// Time of the first rebound of every object of the island, s; infinite without one.
    pub(super) times: Vec<f64>,
}

/// Of [`super::passing`].
#[derive(Default)]
pub(crate) struct Passing {
    /// Indices of left out pairs in the island, with the targets of their points before.
    pub(super) left_out: Vec<usize>,
    pub(super) targets: Vec<[f64; 4]>,
    /// Pairs that have been left out and take part again.
    pub(super) rejoined: Vec<usize>,
    /// Velocities of the links in the solution, at the base's origin.
    pub(super) links: Vec<SpatialVelocity>,
}

/// Of [`super::joining`].
#[derive(Default)]
pub(crate) struct Joining {
    /// Generalized velocity at the end of the step.
    pub(super) v: Vec<f64>,
    /// Velocities of the links with it.
    pub(super) links: Vec<SpatialVelocity>,
    /// Per link: bound of the change of its speed.
    pub(super) changes: Vec<f64>,
    /// Per odometer: bound of the way that its shape may have come nearer in the step, m.
    pub(super) ways: Vec<f64>,
    /// Bounds of the speeds of the shapes with it.
    pub(super) speeds: Vec<f64>,
    /// Entries of the list that are hit.
    pub(super) hit: Vec<usize>,
}
