-- Time slots: a team begins its session inside one of its own. Without any slot, every team may at any time.
CREATE TABLE slots (
    team      TEXT NOT NULL REFERENCES teams (team),
    begins_at BIGINT NOT NULL,
    ends_at   BIGINT NOT NULL,
    PRIMARY KEY (team, begins_at),
    CHECK (begins_at < ends_at)
);

-- The forecast of places reads the open sessions.
CREATE INDEX sessions_open ON sessions (mode) WHERE status = 'open';
