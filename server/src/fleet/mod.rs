//! Several servers that share one competition: this server's lease, and what another host needs to continue a run.

#[cfg_attr(not(test), expect(dead_code, reason = "no session is in a fleet yet"))]
pub(crate) mod continued_run;
pub(crate) mod lease;
pub(crate) mod shipped_tick;
#[cfg_attr(not(test), expect(dead_code, reason = "no session is in a fleet yet"))]
pub(crate) mod shipper;
