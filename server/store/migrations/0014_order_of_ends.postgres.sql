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
