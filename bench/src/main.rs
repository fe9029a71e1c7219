//! Speed against error.
fn main() {}
