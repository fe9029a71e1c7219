//! Files: those of the data directory, and those that servers share.

pub mod blocking;
pub mod disk_space;
pub mod objects;
pub mod private_files;
pub mod stored_path;
