-- Finished files in the storage that several servers share: since when, ms since 1970 UTC. NULL: only in a data directory.
ALTER TABLE runs ADD COLUMN replay_stored_at BIGINT;
ALTER TABLE hands ADD COLUMN stored_at BIGINT;
CREATE INDEX runs_unstored ON runs (replay_host) WHERE replay_stored_at IS NULL AND replay_path IS NOT NULL;
