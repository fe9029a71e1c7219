#!/bin/sh
# Makes the image NAME upon the image BASE, for RUST_IMAGE and NODE_IMAGE at once: compilers.sh NAME BASE NODE
# Rust is this machine's own, NODE a package of Python's index. The certificates that this machine trusts come along.
set -e
rust=$(rustc --print sysroot)
[ "$rust" != /usr ] || { echo "this machine's Rust is not of rustup, and cannot be taken along" >&2; exit 1; }
folder=$(mktemp --directory)
trap 'rm -rf "$folder"' EXIT
mkdir --parents "$folder/rust/bin"
cp "$rust/bin/cargo" "$rust/bin/rustc" "$folder/rust/bin"
cp --recursive "$rust/lib" "$folder/rust"
cat /etc/ssl/certs/ca-certificates.crt > "$folder/trusted.crt" || true
cat > "$folder/Dockerfile" <<'END'
ARG BASE
FROM ${BASE}
RUN apt-get update && DEBIAN_FRONTEND=noninteractive apt-get install --yes --no-install-recommends \
        ca-certificates gcc libc6-dev python3-pip \
    && rm -rf /var/lib/apt/lists/*
COPY trusted.crt /tmp
RUN cat /tmp/trusted.crt >> /etc/ssl/certs/ca-certificates.crt
# Node has a list of its own.
ENV NODE_EXTRA_CA_CERTS=/etc/ssl/certs/ca-certificates.crt
ARG NODE
RUN pip install --no-cache-dir --break-system-packages "$NODE"
COPY rust /usr/local
END
docker build --quiet --tag "$1" --build-arg BASE="$2" --build-arg NODE="$3" "$folder"
