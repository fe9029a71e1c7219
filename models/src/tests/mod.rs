#![allow(clippy::unwrap_used)]

mod catalogue;
mod errors;
mod hostile;
mod inertia;
mod mesh;
mod pinch;
mod reference;
mod reference_reflex;
mod reflex;
mod softhand;
