#![allow(clippy::unwrap_used)]

mod blame;
mod catalogue;
mod chains;
mod coupled;
mod errors;
mod exported;
mod exported_hand;
mod figures;
mod hollow;
mod hostile;
mod hostile_hands;
mod inertia;
mod mesh;
mod meshes;
mod pads;
mod pieces;
mod pinch;
mod published;
mod reference;
mod reference_reflex;
mod reflex;
mod servo;
mod softhand;
mod uncertain;
mod visual;
mod zoo;
