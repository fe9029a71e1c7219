-- Verification that several servers share. A run waits for its verification while it is provisional, or since an
-- organizer ordered it again; its status changes with a verdict only.
ALTER TABLE runs ADD COLUMN verify_since BIGINT;
-- The process that verifies the run now, random for each process. Without it, `verify_until` is the time of the next try.
ALTER TABLE runs ADD COLUMN verify_owner TEXT;
-- By the clock of the database, ms since 1970 UTC. Afterwards another server may verify the run.
ALTER TABLE runs ADD COLUMN verify_until BIGINT;
-- Tries without a verdict, the one in progress included.
ALTER TABLE runs ADD COLUMN verify_tries BIGINT NOT NULL DEFAULT 0;
-- Why the last try gave no verdict.
ALTER TABLE runs ADD COLUMN verify_problem TEXT;
-- The host whose data directory has the replay; NULL where all runs of the database are of one host.
ALTER TABLE runs ADD COLUMN replay_host TEXT;
CREATE INDEX runs_verify ON runs (verify_since) WHERE verify_since IS NOT NULL;
