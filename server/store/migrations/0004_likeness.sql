-- Where the actions of an official run are compared with those of other teams' runs of the task: fingerprints of
-- stretches of changing actions, each hash once with its first place, counted in changes.
CREATE TABLE action_marks (
    run_id TEXT NOT NULL REFERENCES runs (run_id),
    hash   BIGINT NOT NULL,
    place  BIGINT NOT NULL,
    PRIMARY KEY (run_id, hash)
);
CREATE INDEX action_marks_hash ON action_marks (hash);

-- How often the action of the run changed.
ALTER TABLE runs ADD COLUMN action_changes BIGINT;

-- Runs of two teams with a long common stretch; stored for both. For the organizer to look at.
CREATE TABLE similar_runs (
    run_id       TEXT NOT NULL REFERENCES runs (run_id),
    other_run_id TEXT NOT NULL REFERENCES runs (run_id),
    -- At least so many changes of the action are the same, one after another.
    changes      BIGINT NOT NULL,
    PRIMARY KEY (run_id, other_run_id)
);
