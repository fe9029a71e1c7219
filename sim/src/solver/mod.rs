//! The convex problem of one step: minimise over the new velocities v
//!
//! `½ (v − v*)ᵀ A (v − v*) + Σ ℓᵢ(Jᵢ v)`, `A = M + h D + h² E`,
//!
//! with springs and dampers linearly implicit in A and contacts, limits, tendons and servos as convex terms
//! ℓ (Castro, Permenter, Han, *An Unconstrained Convex Formulation of Compliant Contact*, 2022).

mod assembly;
pub mod cholesky;
mod dense;
pub mod driven;
pub mod friction_cone;
mod hand;
pub mod island;
pub(crate) mod linear;
pub mod newton;
mod ordering;
pub mod problem;
pub mod terms;
mod workspace;
