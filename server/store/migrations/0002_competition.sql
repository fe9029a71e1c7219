-- What an official competition needs: teams and their tokens, hands of their own, seeds by count, clocks that
-- survive a crash, replays and their verdicts, and a record of who decided what.

CREATE TABLE teams (
    team       TEXT PRIMARY KEY NOT NULL,
    created_at BIGINT NOT NULL
);

-- Only the SHA-256 of a token's secret half is kept; the other half is the public token_id.
CREATE TABLE tokens (
    token_id    TEXT PRIMARY KEY NOT NULL,
    role        TEXT NOT NULL CHECK (role IN ('team', 'organizer', 'viewer')),
    team        TEXT REFERENCES teams (team),
    label       TEXT NOT NULL,
    secret_hash TEXT NOT NULL,
    created_at  BIGINT NOT NULL,
    revoked_at  BIGINT,
    CHECK ((role = 'team') = (team IS NOT NULL))
);

CREATE TABLE hands (
    hand_id      TEXT PRIMARY KEY NOT NULL,
    team         TEXT NOT NULL,
    name         TEXT NOT NULL,
    -- SHA-256 of the archive, which lies in the data directory under this name.
    sha256       TEXT NOT NULL,
    bytes        BIGINT NOT NULL,
    status       TEXT NOT NULL CHECK (status IN ('pending', 'approved', 'rejected')),
    note         TEXT,
    -- JSON, what the check found odd.
    warnings     TEXT NOT NULL,
    created_at   BIGINT NOT NULL,
    decided_at   BIGINT
);
CREATE INDEX hands_team ON hands (team, name);

CREATE TABLE audit (
    seq     BIGINT PRIMARY KEY NOT NULL,
    at      BIGINT NOT NULL,
    actor   TEXT NOT NULL,
    action  TEXT NOT NULL,
    subject TEXT NOT NULL,
    reason  TEXT
);

CREATE TABLE settings (
    key   TEXT PRIMARY KEY NOT NULL,
    value TEXT NOT NULL
);

-- The last run number given to a team in a task. It only grows.
CREATE TABLE run_counters (
    team TEXT NOT NULL,
    task TEXT NOT NULL,
    k    BIGINT NOT NULL,
    PRIMARY KEY (team, task)
);

ALTER TABLE sessions ADD COLUMN status TEXT NOT NULL DEFAULT 'open'
    CHECK (status IN ('open', 'ended', 'voided'));
-- SHA-256 of the resume token.
ALTER TABLE sessions ADD COLUMN token_hash TEXT;
-- The clock as last saved: wall-clock and simulated seconds, what was given back, and where the open run began.
ALTER TABLE sessions ADD COLUMN clock_started BIGINT NOT NULL DEFAULT 0;
ALTER TABLE sessions ADD COLUMN clock_wall_s DOUBLE PRECISION NOT NULL DEFAULT 0;
ALTER TABLE sessions ADD COLUMN clock_simulated_s DOUBLE PRECISION NOT NULL DEFAULT 0;
ALTER TABLE sessions ADD COLUMN refunded_s DOUBLE PRECISION NOT NULL DEFAULT 0;
ALTER TABLE sessions ADD COLUMN run_from_s DOUBLE PRECISION;
ALTER TABLE sessions ADD COLUMN paused_at BIGINT;
UPDATE sessions SET status = 'ended' WHERE ended_at IS NOT NULL;
CREATE INDEX sessions_team ON sessions (team, status);

-- The number of this run among the team's runs of the task, from 1; official runs only.
ALTER TABLE runs ADD COLUMN k BIGINT;
-- Inside the data directory.
ALTER TABLE runs ADD COLUMN replay_path TEXT;
ALTER TABLE runs ADD COLUMN replay_sha256 TEXT;
ALTER TABLE runs ADD COLUMN missed_ticks BIGINT NOT NULL DEFAULT 0;
ALTER TABLE runs ADD COLUMN verify_note TEXT;
ALTER TABLE runs ADD COLUMN verified_at BIGINT;
-- An archive in `hands`, when the hand is a team's own.
ALTER TABLE runs ADD COLUMN hand_sha256 TEXT;
CREATE UNIQUE INDEX runs_k ON runs (team, task, k);
