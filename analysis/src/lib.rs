//! Analysis of hands and grasps: what their designers compute on paper, in closed form where there is one.
//!
//! A [`contact::Contact`] is a point, a normal and a model. [`grasp::Grasp`] has the grasp matrix G and the hand
//! Jacobian J of several. [`hand::CompliantHand`] is a hand near an equilibrium, [`quasistatic::QuasiStatic`] both
//! together: stiffness, and what each σ does to joints, tendons, object and contact forces.
//!
//! Symbols are those of Prattichizzo and Trinkle ("Grasping", Springer Handbook of Robotics) for G and J, of Malvezzi et al.
//! (SynGrasp, 2015) for stiffness and synergies, and of Rocchi and Hauser (2016) for R, E and σ. `docs/analysis.md`
//! lists the equations. Units are SI. Nothing here has a clock or random numbers.

pub mod closing;
pub mod closure;
pub mod contact;
pub mod design;
pub mod ejection;
pub mod ellipsoid;
pub mod equilibrium;
pub mod grasp;
pub mod hand;
pub mod hull;
pub mod inverse;
pub mod linear;
pub mod mechanics;
pub mod quality;
pub mod quasistatic;
pub mod world;

#[cfg(test)]
mod tests;
