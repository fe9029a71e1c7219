//! Several servers that share one competition: what makes a run of one continue on another.

#![cfg_attr(not(test), expect(dead_code, reason = "no session is in a fleet yet"))]

pub(crate) mod continued_run;
pub(crate) mod shipped_tick;
pub(crate) mod shipper;
