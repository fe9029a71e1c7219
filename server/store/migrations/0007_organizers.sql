-- Actions are compared with those of runs of the same task and the same k, which have the same scene.
ALTER TABLE action_marks ADD COLUMN k BIGINT;
UPDATE action_marks SET k = (SELECT runs.k FROM runs WHERE runs.run_id = action_marks.run_id);
DROP INDEX action_marks_hash;
CREATE INDEX action_marks_scene ON action_marks (hash, k);

-- Hashes of stretches that many teams have in one scene, such as the movements of a published example. They are not compared.
CREATE TABLE common_marks (
    hash BIGINT PRIMARY KEY NOT NULL
);

-- Pairs of runs in different scenes are no longer reported.
DELETE FROM similar_runs WHERE NOT EXISTS (
    SELECT 1 FROM runs AS run JOIN runs AS other ON other.task = run.task AND other.k = run.k
    WHERE run.run_id = similar_runs.run_id AND other.run_id = similar_runs.other_run_id
);
CREATE INDEX similar_runs_changes ON similar_runs (changes);

-- Lists of runs begin with the newest.
CREATE INDEX runs_started ON runs (started_at, run_id);

-- Time that an organizer granted.
ALTER TABLE audit ADD COLUMN seconds DOUBLE PRECISION;
