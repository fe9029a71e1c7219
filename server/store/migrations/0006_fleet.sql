-- Servers that share one database (a fleet, on Postgres), and the owner of each session. Only the owner writes a
-- session's runs, results and clock: each of its transactions begins with a lock of the row of the session, on the
-- condition that `epoch` is still the owner's. A new owner increments it.

CREATE TABLE hosts (
    host_id       TEXT PRIMARY KEY NOT NULL,
    -- Random for each process: a restarted server of the same name is another owner.
    incarnation   TEXT NOT NULL,
    engine        TEXT NOT NULL,
    config_sha256 TEXT NOT NULL,
    build_hash    TEXT NOT NULL,
    internal_url  TEXT,
    state         TEXT NOT NULL CHECK (state IN ('up', 'draining')),
    -- Worlds that it can have open, and that it has.
    places        BIGINT NOT NULL,
    taken         BIGINT NOT NULL,
    -- By the clock of the database, ms since 1970 UTC. Afterwards others may take its sessions.
    lease_until   BIGINT NOT NULL
);

ALTER TABLE sessions ADD COLUMN owner TEXT;
ALTER TABLE sessions ADD COLUMN owner_incarnation TEXT;
ALTER TABLE sessions ADD COLUMN epoch BIGINT NOT NULL DEFAULT 0;
-- The host to which the session's client has connected, and whether that client has shown the resume token.
ALTER TABLE sessions ADD COLUMN wanted_by TEXT;
ALTER TABLE sessions ADD COLUMN wanted_firmly BIGINT NOT NULL DEFAULT 0;
-- The clock within an open run, for a host that continues it: wall-clock time and time given back, s.
ALTER TABLE sessions ADD COLUMN run_wall_s DOUBLE PRECISION;
ALTER TABLE sessions ADD COLUMN run_refunded_s DOUBLE PRECISION;
CREATE INDEX sessions_owner ON sessions (status, owner);

-- Needed to continue an open run on another host: the engine that plays it, and the header of its replay as JSON.
ALTER TABLE runs ADD COLUMN engine TEXT;
ALTER TABLE runs ADD COLUMN header TEXT;
-- How often another host has continued the run.
ALTER TABLE runs ADD COLUMN moved BIGINT NOT NULL DEFAULT 0;

-- The ticks of open runs, and their last state. Deleted when the replay is stored.
CREATE TABLE run_actions (
    run_id    TEXT NOT NULL,
    from_tick BIGINT NOT NULL,
    ticks     BIGINT NOT NULL,
    epoch     BIGINT NOT NULL,
    body      BYTEA NOT NULL,
    PRIMARY KEY (run_id, from_tick)
);
CREATE TABLE run_snapshots (
    run_id TEXT PRIMARY KEY NOT NULL,
    tick   BIGINT NOT NULL,
    epoch  BIGINT NOT NULL,
    body   BYTEA NOT NULL
);
-- Postgres:
ALTER TABLE run_snapshots SET UNLOGGED;