//! Several servers that share one competition: this server's lease, and what another host needs to continue a run.

pub(crate) mod continued_run;
pub(crate) mod hosts;
pub(crate) mod lease;
pub(crate) mod shipped_tick;
pub(crate) mod shipper;
