//! Worlds: runs that are being played, in lockstep or by the clock, and whoever looks on.

pub(crate) mod live;
pub(crate) mod pictures;
pub(crate) mod run;
#[cfg(test)]
pub(crate) mod stub;
pub(crate) mod witness;

pub(crate) use witness::Witness;
