//! Whole-system tests: the real program, real sockets, a real database. They assert what happens, never how
//! fast.

mod harness;

mod actions;
mod admin;
mod admission;
mod backup;
mod crash;
mod hand;
mod hands_upload;
mod handshake;
mod heartbeat;
mod impossible;
mod leaderboard;
mod lifecycle;
mod limits;
mod machines;
mod messages;
mod msgpack;
mod names;
mod observed;
mod official;
mod order;
mod pages;
mod realtime;
mod refunds;
mod replays;
mod resets;
mod resume;
mod roles;
mod session_time;
mod store_trouble;
mod watch;
mod watch_binary;
mod watch_official;
mod web;
