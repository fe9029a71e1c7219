-- What organizers told everybody. The newest one stands on the pages; an empty text takes it off them.
CREATE TABLE announcements (
    id   BIGINT PRIMARY KEY NOT NULL,
    at   BIGINT NOT NULL,
    text TEXT NOT NULL
);
