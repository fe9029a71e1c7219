-- The order in which ended runs were stored, from 1: it decides ties. A clock that is set back does not change it.
ALTER TABLE runs ADD COLUMN ended_seq BIGINT;
UPDATE runs SET ended_seq = numbered.seq FROM (
    SELECT run_id, ROW_NUMBER() OVER (ORDER BY ended_at, run_id) AS seq FROM runs WHERE score IS NOT NULL
) AS numbered WHERE numbered.run_id = runs.run_id;
CREATE UNIQUE INDEX runs_ended ON runs (ended_seq) WHERE ended_seq IS NOT NULL;
ALTER TABLE best ADD COLUMN ended_seq BIGINT;
UPDATE best SET ended_seq = (SELECT runs.ended_seq FROM runs WHERE runs.run_id = best.run_id);
DROP INDEX runs_best_official;
DROP INDEX runs_best_practice;
CREATE INDEX runs_best_official ON runs (team, task, score DESC, ended_seq, run_id)
    WHERE score IS NOT NULL AND status IN ('provisional', 'verified');
CREATE INDEX runs_best_practice ON runs (team, task, score DESC, ended_seq, run_id)
    WHERE score IS NOT NULL AND status = 'practice';

-- SQLite:
DROP VIEW best_counted;
-- SQLite has no functions: an insert into this view counts `change` more runs and finds the best run again.
CREATE VIEW best_counted AS SELECT team, task, official, 0 AS change FROM best;

CREATE TRIGGER best_counted_official INSTEAD OF INSERT ON best_counted WHEN NEW.official = 1 BEGIN
    INSERT INTO best (team, task, official, runs, truth, revision, changed_at) VALUES (NEW.team, NEW.task, 1, 0, 0, 0, 0)
        ON CONFLICT (team, task, official) DO NOTHING;
    UPDATE best SET runs = runs + NEW.change, revision = revision + 1,
        changed_at = CAST((julianday('now') - 2440587.5) * 86400000 AS INTEGER), (score, run_id, status, ended_at, ended_seq) = (
        SELECT score, run_id, status, ended_at, ended_seq FROM runs
        WHERE team = NEW.team AND task = NEW.task AND score IS NOT NULL AND status IN ('provisional', 'verified')
        ORDER BY score DESC, ended_seq, run_id LIMIT 1)
    WHERE team = NEW.team AND task = NEW.task AND official = 1;
END;

CREATE TRIGGER best_counted_practice INSTEAD OF INSERT ON best_counted WHEN NEW.official = 0 BEGIN
    INSERT INTO best (team, task, official, runs, truth, revision, changed_at) VALUES (NEW.team, NEW.task, 0, 0, 0, 0, 0)
        ON CONFLICT (team, task, official) DO NOTHING;
    UPDATE best SET runs = runs + NEW.change, revision = revision + 1,
        changed_at = CAST((julianday('now') - 2440587.5) * 86400000 AS INTEGER), (score, run_id, status, ended_at, ended_seq) = (
        SELECT score, run_id, status, ended_at, ended_seq FROM runs
        WHERE team = NEW.team AND task = NEW.task AND score IS NOT NULL AND status = 'practice'
        ORDER BY score DESC, ended_seq, run_id LIMIT 1)
    WHERE team = NEW.team AND task = NEW.task AND official = 0;
END;
-- Postgres:
-- Counts `change` more runs and finds the best run again. The first statement locks the row until the transaction ends; the next
-- statement then reads all that was committed before, by any server.
CREATE OR REPLACE FUNCTION best_counted(in_team TEXT, in_task TEXT, in_official BIGINT, change BIGINT) RETURNS void
LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO best AS kept (team, task, official, runs, truth, revision, changed_at)
        VALUES (in_team, in_task, in_official, change, 0, 1, (EXTRACT(EPOCH FROM clock_timestamp()) * 1000)::BIGINT)
        ON CONFLICT (team, task, official) DO UPDATE
        SET runs = kept.runs + change, revision = kept.revision + 1, changed_at = excluded.changed_at;
    IF in_official = 1 THEN
        UPDATE best SET (score, run_id, status, ended_at, ended_seq) = (
            SELECT runs.score, runs.run_id, runs.status, runs.ended_at, runs.ended_seq FROM runs
            WHERE runs.team = in_team AND runs.task = in_task
                AND runs.score IS NOT NULL AND runs.status IN ('provisional', 'verified')
            ORDER BY runs.score DESC, runs.ended_seq, runs.run_id LIMIT 1)
        WHERE best.team = in_team AND best.task = in_task AND best.official = 1;
    ELSE
        UPDATE best SET (score, run_id, status, ended_at, ended_seq) = (
            SELECT runs.score, runs.run_id, runs.status, runs.ended_at, runs.ended_seq FROM runs
            WHERE runs.team = in_team AND runs.task = in_task
                AND runs.score IS NOT NULL AND runs.status = 'practice'
            ORDER BY runs.score DESC, runs.ended_seq, runs.run_id LIMIT 1)
        WHERE best.team = in_team AND best.task = in_task AND best.official = 0;
    END IF;
END $$;
