//! The state of the model: the database, two hosts, the client of one session, an organizer.

/// Ticks that the client may see and that are not stored: `MAX_UNSTORED`, which is 25 in the code.
pub(crate) const GATE: u8 = 1;
/// The tick of the snapshot: `SNAPSHOT_TICKS`, which is 100 in the code.
pub(crate) const SNAPSHOT_AT: u8 = 2;

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct State {
    pub(crate) db: Database,
    pub(crate) hosts: [Host; 2],
    pub(crate) client: Client,
    pub(crate) organizer: Organizer,
    /// Faults that may still happen.
    pub(crate) faults: u8,
}

/// The tables, as far as one session with one run has rows in them.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Database {
    /// `hosts`.
    pub(crate) hosts: [HostRow; 2],
    /// `sessions`: `epoch`, `owner`, `owner_incarnation`, `wanted_by`, `paused_at`, and whether `status` is `open`.
    pub(crate) epoch: u8,
    pub(crate) owner: Option<usize>,
    pub(crate) incarnation: Option<(usize, u8)>,
    pub(crate) wanted_by: Option<usize>,
    pub(crate) paused: bool,
    pub(crate) open: bool,
    /// `runs`.
    pub(crate) run: RunRow,
    /// How often a result was counted.
    pub(crate) counted: u8,
    /// `run_actions`: the tick before each row, and its last tick; in order.
    pub(crate) rows: Vec<(u8, u8)>,
    /// `run_snapshots`: its tick; 0 without one.
    pub(crate) snapshot: u8,
    /// The host whose transaction has the lock of the session's row.
    pub(crate) locked_by: Option<usize>,
    /// A statement with ticks that its host has given up: epoch and row.
    pub(crate) late: Option<(u8, u8, u8)>,
    /// Whether a write was accepted in another epoch than that of its owner.
    pub(crate) stale_accepted: bool,
    /// The first end of the run.
    pub(crate) first_end: Option<RunRow>,
}

impl Database {
    /// The last tick up to which all are stored.
    pub(crate) fn stored(&self) -> u8 {
        self.rows.iter().fold(0, |end, &(from, through)| if from == end { through } else { end })
    }
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct HostRow {
    pub(crate) incarnation: u8,
    /// Whether `lease_until` is in the future.
    pub(crate) leased: bool,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum RunRow {
    Open,
    /// Its result counts: its ticks, and whether the replay has all of them.
    Provisional {
        ticks: u8,
        whole: bool,
    },
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Process {
    Up,
    /// By SIGSTOP.
    Stopped,
    Dead,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Host {
    pub(crate) process: Process,
    /// Whether it reaches the database.
    pub(crate) linked: bool,
    /// `HostKey::incarnation`.
    pub(crate) incarnation: u8,
    /// The entry in the registry.
    pub(crate) session: Option<Session>,
    pub(crate) adopting: Option<Adopting>,
}

impl Host {
    /// Whether it runs and reaches the database.
    pub(crate) fn works(&self) -> bool {
        self.process == Process::Up && self.linked
    }
}

/// A take-over in progress.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Adopting {
    /// The row has the new owner.
    Taken(u8),
    /// The rows were read: what the session will be, and whether it was open.
    Built(Session, bool),
    /// The session is in the registry; nobody holds it yet.
    Listed(bool),
}

/// A session in the memory of a host.
#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Session {
    /// `Held`.
    pub(crate) epoch: u8,
    pub(crate) lost: bool,
    /// Whether a connection or a task holds it.
    pub(crate) held: bool,
    pub(crate) paused: bool,
    /// A continued run stands until its client is back.
    pub(crate) standing: bool,
    /// It is being given away.
    pub(crate) leaving: bool,
    pub(crate) command: Option<Command>,
    pub(crate) run: Run,
}

#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Command {
    Pause(bool),
    Release,
    End,
    /// Does what the session's row says.
    Follow,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Run {
    None,
    Playing(World),
    /// Its world is closed, its result is not stored.
    Ended {
        world: World,
        /// A transaction with the result has begun.
        writing: bool,
        /// The session ends after it.
        last: bool,
    },
    /// The result is stored and waits for `stop`.
    Stored {
        ticks: u8,
        last: bool,
    },
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct World {
    pub(crate) tick: u8,
    /// The last tick that the observers have.
    pub(crate) reported: u8,
    /// `Gate::stored`.
    pub(crate) confirmed: u8,
    /// The row of the last statement, until it has succeeded: its last tick.
    pub(crate) sent: Option<u8>,
    /// The tick of a snapshot that is not sent yet; 0 without one.
    pub(crate) snapshot: u8,
    /// Whether the recorder has all ticks.
    pub(crate) whole: bool,
    /// Whether a reply with the last tick waits at the gate.
    pub(crate) replying: bool,
}

#[derive(Clone, Debug, PartialEq, Eq, Hash)]
pub(crate) struct Client {
    /// The host of its connection.
    pub(crate) at: Option<usize>,
    /// Whether it will not come back.
    pub(crate) gone: bool,
    /// The last tick that it has seen.
    pub(crate) seen: u8,
    /// Its result, by ticks.
    pub(crate) result: Option<u8>,
}

/// The organizer's plan, and what is done of it.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Organizer {
    Idle,
    /// Will give this command.
    Plans(Command),
    /// This host has stored the command.
    Stored(Command, usize),
    /// The session at this host has the command.
    Sent(Command, usize),
    /// The command was answered, or its host is gone.
    Done(Command),
}

impl State {
    /// The same after the loss of host 0.
    pub(crate) fn without_its_host(mut self) -> Self {
        let host = &mut self.hosts[0];
        (host.process, host.session, self.client.at) = (Process::Dead, None, None);
        self
    }

    /// Host 0 has the session and its open run; the client is connected.
    pub(crate) fn first(faults: u8, organizer: Organizer) -> Self {
        let world = World {
            tick: 0,
            reported: 0,
            confirmed: 0,
            sent: None,
            snapshot: 0,
            whole: true,
            replying: false,
        };
        let session = Session {
            epoch: 1,
            lost: false,
            held: true,
            paused: false,
            standing: false,
            leaving: false,
            command: None,
            run: Run::Playing(world),
        };
        let host =
            |session| Host { process: Process::Up, linked: true, incarnation: 1, session, adopting: None };
        let row = HostRow { incarnation: 1, leased: true };
        State {
            db: Database {
                hosts: [row.clone(), row],
                epoch: 1,
                owner: Some(0),
                incarnation: Some((0, 1)),
                wanted_by: None,
                paused: false,
                open: true,
                run: RunRow::Open,
                counted: 0,
                rows: vec![],
                snapshot: 0,
                locked_by: None,
                late: None,
                stale_accepted: false,
                first_end: None,
            },
            hosts: [host(Some(session)), host(None)],
            client: Client { at: Some(0), gone: false, seen: 0, result: None },
            organizer,
            faults,
        }
    }
}
