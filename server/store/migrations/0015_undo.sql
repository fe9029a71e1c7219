-- The time that was given back for a void run, s: whoever undoes the void takes it again.
ALTER TABLE runs ADD COLUMN refunded_wall_s DOUBLE PRECISION;
ALTER TABLE runs ADD COLUMN refunded_simulated_s DOUBLE PRECISION;
