#![allow(clippy::unwrap_used)]

mod errors;
mod inertia;
mod mesh;
mod reference;
mod softhand;
