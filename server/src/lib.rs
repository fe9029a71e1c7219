//! The server: sessions, spectators, fleet, HTTP. Its options are in [`ServeOptions`].
//!
//! A folder uses only folders below it in this table. `server/net`, `server/worlds`, `server/documents`, `server/store` and
//! `server/metrics` are crates of their own: cargo refuses an import that runs back.
//!
//! | folder | content |
//! |---|---|
//! | `server/src/app/` | builds every part, starts and stops the server |
//! | `server/src/http/` | HTTP: leaderboard, runs, hands, organizers; each endpoint with its description; `pages/`: HTML of the pages |
//! | `server/documents/src/` | the documents as HTML, and their search (`server/documents/src/search/`); `server/documents/build.rs` embeds them |
//! | `server/src/control/` | control connections of teams, and their requests per second |
//! | `server/src/session/` | which requests a session allows (`machine.rs`), its runs, and how they finish |
//! | `server/src/fleet/` | several servers for one competition: this server's lease; the ticks of official runs in the database, and the runs that another host continues from them |
//! | `server/src/archive/` | the replays on disk: recording, verification, retention |
//! | `server/src/watch/` | spectators: rights, and a hub that never waits |
//! | `server/src/competition/` | the tasks, hands and rules of the competition |
//! | `server/net/src/transport/` | the accepted connections, open sockets, bodies of HTTP requests; `low_latency/`: shorter round trips |
//! | `server/worlds/src/world/` | open runs, in lockstep or by the clock, and their observers |
//! | `server/worlds/src/compute/` | permits for ticks, realtime ticks, jobs in the background, capacity for worlds |
//! | `server/src/backup/` | a backup, and its restoration |
//! | `server/net/src/auth/`, `server/net/src/config/`, `server/src/schedule/` | tokens; options and `competition.toml`; time slots of teams |
//! | `server/store/src/`, `server/store/migrations/` | one set of queries for SQLite and Postgres; the tables of the database, version by version |
//! | `server/worlds/src/clock/`, `server/store/src/files/`, `server/store/src/names/` | the clock of a session; files on disk and in a bucket; valid names |
//! | `server/metrics/src/`, `server/net/src/process/` | every metric with its declaration; start, stop, log and version of the process |
//!
//! # Decisions
//!
//! - **One owner for each world.** A lockstep world belongs to its connection's thread, a realtime world to the pacer's threads. Network,
//!   database and signals have their own threads, on which no world computes.
//! - **Permits, as many as cores, each for one tick.** Official realtime ticks come first, then the longest wait. A tick that overruns loses
//!   its permit after 250 ms, so that other worlds continue. The server refuses another world if realtime ticks would come late; it refuses
//!   practice first.
//! - **Realtime ticks are counted from one start**, so that no delay adds up. The pacers have realtime priority if the system grants it.
//! - **A session's clock counts the greater of wall-clock and simulated time.** Neither disconnecting nor fast simulation gains time. The
//!   server gives back time that its own fault cost, once, in a transaction.
//! - **Only the owner of a session writes it.** Each of its transactions begins with a lock of the session's row on the condition that
//!   `epoch` is still the owner's; a new owner increments it. A condition without the lock can be checked before another owner comes, and
//!   the write done after it. A host's lease is only a hint that others may take its sessions: a wrong one costs a pause, never a result.
//! - **A fleet has no parts of its own but Postgres.** Hosts renew their leases, take over sessions and read changes twice a second. No
//!   consensus, no message bus, no sharding; a proxy spreads clients by their token.
//! - **A run of a fleet can continue elsewhere**, from its ticks in the database: the same states, the same hash chain, the same
//!   verification. A client sees at most 25 ticks that are not stored: otherwise a lockstep answer waits, and a realtime world stands. The
//!   clock gives that time back. `server/tests/model/` is a model of this, which a checker explores.

mod app;
mod archive;
mod backup;
mod competition;
mod control;
mod fleet;
mod http;
mod schedule;
pub mod schema;
mod session;
pub mod untrusted;
mod watch;

pub use app::serve;
pub use backup::restore::restore;
pub use competition::new_keys::{NewKeys, new_keys};
pub use palmares_net::config::{ServeOptions, hand_limits};
pub use palmares_store::runs_in;
