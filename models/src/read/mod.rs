//! Reads hands and objects from files that may come from a stranger.
//!
//! 1. `files.rs` finds the files in a folder or an archive; `limits.rs` has their limits. `foreign.rs` recognises other formats.
//! 2. `urdf/` turns the URDF into a checked tree, folds mimic joints and merges fixed links; `mesh.rs` and
//!    `stl.rs` turn meshes into rounded hulls, `hollow.rs` reports the hollows that a hull fills.
//!    `settings.rs` reads and checks `hand.toml`.
//! 3. `coordinates.rs`, `actuation.rs`, `routing.rs`, `servo.rs`, `start.rs` and `tactile.rs` build the other parts of the hand from both.
//!    `uncertain.rs` reads the ranges of its numbers, `visual.rs` the appearance of links, for rendering.
//! 4. `hand.rs` goes through these in order.
//! 5. `objects.rs` reads the catalogue's objects, `own_object.rs` a task's own objects, both from `parts.rs`.
//! 6. `arm.rs` reads the arm of a task.
//! 7. `named.rs` finds the files that name a mesh, for its decomposition.
//!
//! Oddities are warnings, invalid elements errors (`report.rs`).

mod actuation;
mod arm;
mod coordinates;
mod files;
mod foreign;
mod hand;
pub(crate) mod hollow;
mod limits;
mod mesh;
mod named;
mod no_collision;
mod objects;
mod options;
mod own_object;
mod parts;
pub(crate) mod report;
mod routing;
mod sensors;
mod servo;
mod servo_settings;
mod settings;
mod springs;
mod start;
mod start_settings;
pub(crate) mod stl;
mod tactile;
mod uncertain;
pub(crate) mod urdf;
mod visual;

pub use self::arm::arm;
pub use self::files::{Files, read_limited};
pub use self::hand::{Loaded, examine, from_files, from_text, hand, visuals};
pub use self::hollow::{cubic_cm, tells_of_filled_hollows};
pub use self::limits::Limits;
pub use self::mesh::{played_points, triangle_mesh};
pub use self::named::{MeshUse, UseKind, mesh_uses};
pub use self::options::{InertiaPolicy, LoadOptions};
pub use self::own_object::OwnObject;
pub use self::urdf::xml::xml;
pub use self::visual::{Look, Visual};
