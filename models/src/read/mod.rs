//! Hands and objects from files that may come from a stranger.
//!
//! 1. `files.rs` finds the files in a folder or an archive; `limits.rs` bounds what they may ask for.
//! 2. `urdf/` makes the URDF a checked tree, folds mimic joints and merges what does not move; `mesh.rs` and `stl.rs`
//!    make meshes rounded hulls, `hollow.rs` says what a hull fills. `settings.rs` reads and checks `hand.toml`.
//! 3. `coordinates.rs`, `actuation.rs` and `tactile.rs` build from both what the hand has beside its links.
//!    `visual.rs` tells how links look, for those who draw them.
//! 4. `hand.rs` goes through these in order.
//! 5. `objects.rs` reads the catalogue's objects, `own_object.rs` those of a task's own, both out of `parts.rs`.
//! 6. `named.rs` finds what names a mesh, for those who take it apart.
//!
//! What is odd is a warning, what cannot be meant an error (`report.rs`).

mod actuation;
mod coordinates;
mod files;
mod hand;
pub(crate) mod hollow;
mod limits;
mod mesh;
mod named;
mod objects;
mod options;
mod own_object;
mod parts;
pub(crate) mod report;
mod sensors;
mod settings;
pub(crate) mod stl;
mod tactile;
pub(crate) mod urdf;
mod visual;

pub use self::files::Files;
pub use self::hand::{Loaded, from_files, from_text, hand, visuals};
pub use self::hollow::{cubic_cm, tells_of_filled_hollows};
pub use self::limits::Limits;
pub use self::mesh::{played_points, triangle_mesh};
pub use self::named::{MeshUse, UseKind, mesh_uses};
pub use self::options::{InertiaPolicy, LoadOptions};
pub use self::own_object::OwnObject;
pub use self::visual::{Look, Visual};
