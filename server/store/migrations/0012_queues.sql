-- What a host shows to the others: its idle worlds, and the sessions that wait for a world there, by spaces, in the order of its queue.
ALTER TABLE hosts ADD COLUMN idle BIGINT NOT NULL DEFAULT 0;
ALTER TABLE hosts ADD COLUMN waiting TEXT NOT NULL DEFAULT '';
