//! Several servers that share one competition: this server's lease.

pub(crate) mod lease;
