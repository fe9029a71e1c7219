# A Postgres for tests: a cluster of its own in a temporary folder, reachable by a unix socket only. Prints the
# socket's folder when it answers, lives until standard input closes, leaves nothing behind. Run with `sh -c`, not
# as root. Exit code 3: there is no Postgres here.
set -eu
bin=
for folder in /usr/lib/postgresql/*/bin /usr/pgsql-*/bin /usr/local/bin /usr/bin; do
    if [ -x "$folder/initdb" ] && [ -x "$folder/postgres" ]; then bin=$folder; break; fi
done
if [ -z "$bin" ]; then echo "no initdb and postgres found" >&2; exit 3; fi
folder=$(mktemp -d)
server=
end() {
    if [ -n "$server" ]; then kill -INT "$server" 2>/dev/null || true; wait "$server" 2>/dev/null || true; fi
    rm -rf "$folder"
}
trap end EXIT
trap 'exit 1' INT TERM HUP
cd "$folder"
"$bin/initdb" --pgdata=data --username=palmares --auth=trust --no-sync --encoding=UTF8 --locale=C >log 2>&1 || {
    cat log >&2
    exit 1
}
"$bin/postgres" -D data -c listen_addresses= -c unix_socket_directories="$folder" -c fsync=off </dev/null >log 2>&1 &
server=$!
tries=0
while [ ! -S "$folder/.s.PGSQL.5432" ] || ! "$bin/pg_isready" --quiet --host="$folder" --dbname=postgres; do
    tries=$((tries + 1))
    if [ "$tries" -gt 600 ] || ! kill -0 "$server" 2>/dev/null; then cat log >&2; exit 1; fi
    sleep 0.1
done
echo "$folder"
cat >/dev/null
