-- The ranking, kept up to date in the transaction of every write to `runs`, so that reading it does not read all runs. Triggers keep
-- SQLite:
-- it: no write can miss it.
-- Postgres:
-- it: no write can miss it, whichever server makes it.
-- Both:

CREATE TABLE best (
    team     TEXT NOT NULL,
    task     TEXT NOT NULL,
    official BIGINT NOT NULL CHECK (official IN (0, 1)),
    -- Number of runs that count.
    runs     BIGINT NOT NULL,
    -- 1 if any run has the true state, whether it counts or not.
    truth    BIGINT NOT NULL CHECK (truth IN (0, 1)),
    -- The best run; NULL while none counts.
    score    DOUBLE PRECISION,
    run_id   TEXT,
    status   TEXT,
    ended_at BIGINT,
    -- Number of changes of this row. It only grows, so the sum over all rows changes with the ranking.
    revision BIGINT NOT NULL,
    -- The last change, by the database's clock, ms since 1970 UTC: a reader reads what has changed since.
    changed_at BIGINT NOT NULL,
    PRIMARY KEY (team, task, official)
-- SQLite:
);
-- Postgres:
) WITH (fillfactor = 70);
-- Both:

-- The runs that count, in the order of the ranking. They replace an index without the order of ties.
DROP INDEX runs_best;
CREATE INDEX runs_best_official ON runs (team, task, score DESC, ended_at, run_id)
    WHERE score IS NOT NULL AND status IN ('provisional', 'verified');
CREATE INDEX runs_best_practice ON runs (team, task, score DESC, ended_at, run_id)
    WHERE score IS NOT NULL AND status = 'practice';
-- Lists of sessions count the runs of each.
CREATE INDEX runs_session ON runs (session_id);

-- SQLite:
-- SQLite has no functions: an insert into this view counts `change` more runs and finds the best run again.
CREATE VIEW best_counted AS SELECT team, task, official, 0 AS change FROM best;

CREATE TRIGGER best_counted_official INSTEAD OF INSERT ON best_counted WHEN NEW.official = 1 BEGIN
    INSERT INTO best (team, task, official, runs, truth, revision, changed_at) VALUES (NEW.team, NEW.task, 1, 0, 0, 0, 0)
        ON CONFLICT (team, task, official) DO NOTHING;
    UPDATE best SET runs = runs + NEW.change, revision = revision + 1,
        changed_at = CAST((julianday('now') - 2440587.5) * 86400000 AS INTEGER), (score, run_id, status, ended_at) = (
        SELECT score, run_id, status, ended_at FROM runs
        WHERE team = NEW.team AND task = NEW.task AND score IS NOT NULL AND status IN ('provisional', 'verified')
        ORDER BY score DESC, ended_at, run_id LIMIT 1)
    WHERE team = NEW.team AND task = NEW.task AND official = 1;
END;

CREATE TRIGGER best_counted_practice INSTEAD OF INSERT ON best_counted WHEN NEW.official = 0 BEGIN
    INSERT INTO best (team, task, official, runs, truth, revision, changed_at) VALUES (NEW.team, NEW.task, 0, 0, 0, 0, 0)
        ON CONFLICT (team, task, official) DO NOTHING;
    UPDATE best SET runs = runs + NEW.change, revision = revision + 1,
        changed_at = CAST((julianday('now') - 2440587.5) * 86400000 AS INTEGER), (score, run_id, status, ended_at) = (
        SELECT score, run_id, status, ended_at FROM runs
        WHERE team = NEW.team AND task = NEW.task AND score IS NOT NULL AND status = 'practice'
        ORDER BY score DESC, ended_at, run_id LIMIT 1)
    WHERE team = NEW.team AND task = NEW.task AND official = 0;
END;

CREATE TRIGGER runs_truth AFTER INSERT ON runs WHEN NEW.sensing = 'truth' BEGIN
    INSERT INTO best (team, task, official, runs, truth, revision, changed_at)
        VALUES (NEW.team, NEW.task, NEW.k IS NOT NULL, 0, 1, 1, CAST((julianday('now') - 2440587.5) * 86400000 AS INTEGER))
        ON CONFLICT (team, task, official)
        DO UPDATE SET truth = 1, revision = revision + 1, changed_at = excluded.changed_at WHERE truth = 0;
END;

-- A run of a backup arrives finished.
CREATE TRIGGER runs_restored AFTER INSERT ON runs
WHEN NEW.score IS NOT NULL AND NEW.status IN ('practice', 'provisional', 'verified') BEGIN
    INSERT INTO best_counted VALUES (NEW.team, NEW.task, NEW.status <> 'practice', 1);
END;

CREATE TRIGGER runs_judged AFTER UPDATE OF status, score ON runs
WHEN OLD.status <> NEW.status OR OLD.score IS DISTINCT FROM NEW.score BEGIN
    INSERT INTO best_counted
        SELECT NEW.team, NEW.task, 1,
            (NEW.score IS NOT NULL AND NEW.status IN ('provisional', 'verified'))
            - (OLD.score IS NOT NULL AND OLD.status IN ('provisional', 'verified'))
        WHERE OLD.status IN ('provisional', 'verified') OR NEW.status IN ('provisional', 'verified');
    INSERT INTO best_counted
        SELECT NEW.team, NEW.task, 0,
            (NEW.score IS NOT NULL AND NEW.status = 'practice') - (OLD.score IS NOT NULL AND OLD.status = 'practice')
        WHERE OLD.status = 'practice' OR NEW.status = 'practice';
END;
-- Postgres:
-- Counts `change` more runs and finds the best run again. The first statement locks the row until the transaction ends; the next
-- statement then reads all that was committed before, by any server.
CREATE FUNCTION best_counted(in_team TEXT, in_task TEXT, in_official BIGINT, change BIGINT) RETURNS void
LANGUAGE plpgsql AS $$
BEGIN
    INSERT INTO best AS kept (team, task, official, runs, truth, revision, changed_at)
        VALUES (in_team, in_task, in_official, change, 0, 1, (EXTRACT(EPOCH FROM clock_timestamp()) * 1000)::BIGINT)
        ON CONFLICT (team, task, official) DO UPDATE
        SET runs = kept.runs + change, revision = kept.revision + 1, changed_at = excluded.changed_at;
    IF in_official = 1 THEN
        UPDATE best SET (score, run_id, status, ended_at) = (
            SELECT runs.score, runs.run_id, runs.status, runs.ended_at FROM runs
            WHERE runs.team = in_team AND runs.task = in_task
                AND runs.score IS NOT NULL AND runs.status IN ('provisional', 'verified')
            ORDER BY runs.score DESC, runs.ended_at, runs.run_id LIMIT 1)
        WHERE best.team = in_team AND best.task = in_task AND best.official = 1;
    ELSE
        UPDATE best SET (score, run_id, status, ended_at) = (
            SELECT runs.score, runs.run_id, runs.status, runs.ended_at FROM runs
            WHERE runs.team = in_team AND runs.task = in_task
                AND runs.score IS NOT NULL AND runs.status = 'practice'
            ORDER BY runs.score DESC, runs.ended_at, runs.run_id LIMIT 1)
        WHERE best.team = in_team AND best.task = in_task AND best.official = 0;
    END IF;
END $$;

CREATE FUNCTION runs_begun() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    IF NEW.sensing = 'truth' THEN
        INSERT INTO best AS kept (team, task, official, runs, truth, revision, changed_at)
            VALUES (NEW.team, NEW.task, (NEW.k IS NOT NULL)::INT, 0, 1, 1, (EXTRACT(EPOCH FROM clock_timestamp()) * 1000)::BIGINT)
            ON CONFLICT (team, task, official) DO UPDATE
            SET truth = 1, revision = kept.revision + 1, changed_at = excluded.changed_at WHERE kept.truth = 0;
    END IF;
    -- A run of a backup arrives finished.
    IF NEW.score IS NOT NULL AND NEW.status IN ('practice', 'provisional', 'verified') THEN
        PERFORM best_counted(NEW.team, NEW.task, (NEW.status <> 'practice')::INT, 1);
    END IF;
    RETURN NULL;
END $$;

CREATE FUNCTION runs_judged() RETURNS trigger LANGUAGE plpgsql AS $$
BEGIN
    IF OLD.status IN ('provisional', 'verified') OR NEW.status IN ('provisional', 'verified') THEN
        PERFORM best_counted(NEW.team, NEW.task, 1,
            (NEW.score IS NOT NULL AND NEW.status IN ('provisional', 'verified'))::INT
            - (OLD.score IS NOT NULL AND OLD.status IN ('provisional', 'verified'))::INT);
    END IF;
    IF OLD.status = 'practice' OR NEW.status = 'practice' THEN
        PERFORM best_counted(NEW.team, NEW.task, 0,
            (NEW.score IS NOT NULL AND NEW.status = 'practice')::INT
            - (OLD.score IS NOT NULL AND OLD.status = 'practice')::INT);
    END IF;
    RETURN NULL;
END $$;

CREATE TRIGGER runs_begun AFTER INSERT ON runs FOR EACH ROW
    WHEN (NEW.sensing = 'truth' OR NEW.status <> 'open') EXECUTE FUNCTION runs_begun();
CREATE TRIGGER runs_judged AFTER UPDATE OF status, score ON runs FOR EACH ROW
    WHEN (OLD.status <> NEW.status OR OLD.score IS DISTINCT FROM NEW.score) EXECUTE FUNCTION runs_judged();
-- Both:

INSERT INTO best (team, task, official, runs, truth, score, run_id, status, ended_at, revision, changed_at)
    SELECT team, task, official, SUM(counts), MAX(truth), MAX(CASE WHEN place = 1 THEN score END),
        MAX(CASE WHEN place = 1 THEN run_id END), MAX(CASE WHEN place = 1 THEN status END),
        MAX(CASE WHEN place = 1 THEN ended_at END), 1, 0
    FROM (
        SELECT *, CASE WHEN counts = 1 THEN ROW_NUMBER() OVER (
            PARTITION BY team, task, official, counts ORDER BY score DESC, ended_at, run_id) END AS place
        FROM (
            SELECT run_id, team, task, score, status, ended_at, 0 AS truth, 1 AS counts,
                CASE WHEN status = 'practice' THEN 0 ELSE 1 END AS official
            FROM runs WHERE score IS NOT NULL AND status IN ('practice', 'provisional', 'verified')
            UNION ALL
            SELECT NULL, team, task, NULL, NULL, NULL, 1, 0, CASE WHEN k IS NULL THEN 0 ELSE 1 END
            FROM runs WHERE sensing = 'truth'
        ) AS either
    ) AS ranked GROUP BY team, task, official;
