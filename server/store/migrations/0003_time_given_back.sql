-- What a finished run has taken from its session's clock. It is given back when the run is voided, and then taken
-- away here, so that it is given back once, whoever dies in between.
ALTER TABLE runs ADD COLUMN taken_wall_s DOUBLE PRECISION;
ALTER TABLE runs ADD COLUMN taken_simulated_s DOUBLE PRECISION;
