//! The multibody's degrees of freedom: which carries what of the model.

use rapier3d_f64::dynamics::Multibody;

/// One hinge as a joint of the multibody.
pub(super) struct HingeDof {
    /// Link of the multibody.
    pub link: usize,
    /// Free axis: 0 … 2 linear, 3 … 5 angular.
    pub axis: usize,
    /// The coordinate that it follows, `x = ratio · q + offset`.
    pub coordinate: usize,
    pub ratio: f64,
    pub offset: f64,
}

/// The hand's joints in the multibody.
pub(super) struct Joints {
    /// All hinges, in the order of the multibody's links.
    pub hinges: Vec<HingeDof>,
    /// The hinge that carries each coordinate; the others are coupled to it.
    pub masters: Vec<usize>,
    /// Degrees of freedom of the base: none if it is bolted.
    pub base_dofs: usize,
}

impl Joints {
    /// q of a coordinate, from the hinge that carries it.
    pub(super) fn coordinate(&self, multibody: &Multibody, c: usize) -> f64 {
        let hinge = &self.hinges[self.masters[c]];
        let x = multibody.link(hinge.link).map_or(f64::NAN, |link| link.joint.coords()[hinge.axis]);
        (x - hinge.offset) / hinge.ratio
    }
}

/// Place of a hinge in the generalized velocity.
pub(super) fn dof(multibody: &Multibody, hinge: &HingeDof) -> usize {
    multibody.link(hinge.link).map_or(0, |link| link.assembly_id())
}
