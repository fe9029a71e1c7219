-- Movements of official runs, where each is compared with those of other teams' runs in its scene. In place of fingerprints of the actions.
DROP TABLE action_marks;
DROP TABLE common_marks;
DROP TABLE similar_runs;
-- `runs.action_changes` stays, unused: backups of earlier versions have it.

-- The path of a run's hand, base64: server/src/likeness/path.rs.
CREATE TABLE run_paths (
    run_id TEXT PRIMARY KEY NOT NULL REFERENCES runs (run_id),
    -- The run's seed. Equal seeds are equal scenes.
    scene  TEXT NOT NULL,
    path   TEXT NOT NULL
);
CREATE INDEX run_paths_scene ON run_paths (scene);

-- Runs of two teams with a long common stretch; stored for both. For the organizer to look at.
CREATE TABLE alike_runs (
    run_id       TEXT NOT NULL REFERENCES runs (run_id),
    other_run_id TEXT NOT NULL REFERENCES runs (run_id),
    -- Part of the shorter path that is alike.
    share        DOUBLE PRECISION NOT NULL,
    -- Root mean square of the distance on it, and constant distance, mm.
    distance_mm  DOUBLE PRECISION NOT NULL,
    offset_mm    DOUBLE PRECISION NOT NULL,
    -- How much later the other run is there, s.
    shift_s      DOUBLE PRECISION NOT NULL,
    PRIMARY KEY (run_id, other_run_id)
);
