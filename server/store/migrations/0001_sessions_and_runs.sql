-- Times are whole milliseconds since 1970 UTC, lengths of time are seconds. The text columns with few values
-- list them in a CHECK, so that a wrong word fails when it is written, not when it is read.

CREATE TABLE sessions (
    session_id     TEXT PRIMARY KEY NOT NULL,
    team           TEXT NOT NULL,
    client_version TEXT,
    mode           TEXT NOT NULL CHECK (mode IN ('practice', 'official')),
    limit_s        DOUBLE PRECISION,
    created_at     BIGINT NOT NULL,
    ended_at       BIGINT
);

CREATE TABLE runs (
    run_id         TEXT PRIMARY KEY NOT NULL,
    session_id     TEXT NOT NULL REFERENCES sessions (session_id),
    team           TEXT NOT NULL,
    task           TEXT NOT NULL,
    hand           TEXT NOT NULL,
    mode           TEXT NOT NULL CHECK (mode IN ('lockstep', 'realtime')),
    sensing        TEXT NOT NULL CHECK (sensing IN ('sensors', 'truth')),
    seed_hex       TEXT NOT NULL,
    -- The number a practice client gives to reset; hidden seeds have none.
    seed           BIGINT,
    server_version TEXT NOT NULL,
    build_hash     TEXT NOT NULL,
    started_at     BIGINT NOT NULL,
    ended_at       BIGINT,
    -- 'aborted': the server was gone before the run ended. 'voided': a fault of the server; counts for nothing.
    status         TEXT NOT NULL CHECK (status IN
                       ('open', 'practice', 'provisional', 'verified', 'rejected', 'voided', 'aborted')),
    reason         TEXT,
    note           TEXT,
    ticks          BIGINT,
    sim_time_s     DOUBLE PRECISION,
    score          DOUBLE PRECISION,
    in_goal        BIGINT,
    outside        BIGINT,
    state_hash     TEXT,
    -- JSON, what the referee noted.
    events         TEXT
);

CREATE INDEX runs_best ON runs (team, task, score);
CREATE INDEX runs_status ON runs (status);
