//! Files: those of the data directory, and those that servers share.

pub(crate) mod blocking;
pub(crate) mod disk_space;
pub(crate) mod objects;
pub(crate) mod private_files;
pub(crate) mod stored_path;
