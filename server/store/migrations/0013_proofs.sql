-- The last write by which each host has proved that it can write.
CREATE TABLE proofs (
    host_id   TEXT PRIMARY KEY NOT NULL,
    -- ms since 1970 UTC.
    proved_at BIGINT NOT NULL
);
