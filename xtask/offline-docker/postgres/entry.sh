#!/bin/sh
# Stands in for the official Postgres image in the tests: the same variables, the same volume.
set -e
PATH=$(echo /usr/lib/postgresql/*/bin):$PATH
data=/var/lib/postgresql/data
mkdir -p "$data"; chown -R postgres "$data"; chmod 700 "$data"
if [ ! -s "$data/PG_VERSION" ]; then
  echo "$POSTGRES_PASSWORD" > /tmp/pw; chown postgres /tmp/pw
  su postgres -c "$(command -v initdb) -D $data -U $POSTGRES_USER --pwfile=/tmp/pw -A scram-sha-256" >/dev/null
  rm /tmp/pw
  echo "host all all all scram-sha-256" >> "$data/pg_hba.conf"
  su postgres -c "echo 'CREATE DATABASE \"$POSTGRES_DB\"' | $(command -v postgres) --single -D $data postgres" >/dev/null
fi
exec setpriv --reuid postgres --regid postgres --init-groups $(command -v postgres) -D "$data" -c listen_addresses='*' -c unix_socket_directories=/tmp
