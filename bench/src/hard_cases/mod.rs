//! Hard cases: each at ten steps, from many starts, beside its bound and what other engines have done. The page is
//! docs/report/hard.md.

mod command;
mod list;
mod page;
mod peers;

pub use command::HardCasesOptions;
