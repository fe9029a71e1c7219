//! The control socket: its handshake, and the connection that serves one client's session.

mod connection;
mod end;
mod handshake;
mod rate;

pub(crate) use handshake::control;
