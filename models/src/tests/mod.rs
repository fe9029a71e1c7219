#![allow(clippy::unwrap_used)]

mod errors;
mod hostile;
mod inertia;
mod mesh;
mod pinch;
mod reference;
mod reflex;
mod softhand;
