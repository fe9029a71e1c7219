# Palmares in a container. It builds with and without BuildKit.
#
#   docker build -t palmares .
#   docker run -p 8080:8080 -v palmares:/data palmares
#
# Build arguments:
#   RUST_IMAGE, RUNTIME_IMAGE  base images; both must be on the same release of Debian
#   NODE_IMAGE                 image that builds the viewer
#   JOBS                       parallel compilers; default: one per core
#   PALMARES_BUILD_HASH        the commit, which clients see (the context has no .git)
#
# `--target runtime` builds the image without the program; copy yours to /usr/local/bin/palmares.

ARG RUST_IMAGE=rust:1-slim-bookworm
ARG RUNTIME_IMAGE=debian:bookworm-slim
ARG NODE_IMAGE=node:22-bookworm-slim

# This stage is first: without BuildKit, Docker builds every stage before the wanted one.
FROM ${RUNTIME_IMAGE} AS runtime
# The user is a number: orchestrators can check that it is not root.
RUN useradd --uid 10001 --user-group --no-create-home --home-dir /data --shell /usr/sbin/nologin palmares \
    && install --directory --owner palmares --group palmares --mode 0700 /data
USER 10001:10001
WORKDIR /data
VOLUME /data
EXPOSE 8080
ENV PALMARES_LISTEN=0.0.0.0:8080 PALMARES_DATA_DIR=/data
# On SIGTERM the server stops and scores open runs; give it 40 s (docker stop --time 40, stop_grace_period in compose).
HEALTHCHECK --interval=10s --timeout=5s --start-period=20s CMD ["palmares", "health"]
ENTRYPOINT ["palmares"]
CMD ["serve"]

FROM ${NODE_IMAGE} AS viewer
WORKDIR /viewer
COPY viewer/package.json viewer/package-lock.json ./
RUN npm ci --no-audit --no-fund
COPY viewer .
RUN npm run build

FROM ${RUST_IMAGE} AS build
ARG JOBS=
ARG PALMARES_BUILD_HASH=
WORKDIR /src
COPY . .
COPY --from=viewer /viewer/dist/bundle viewer/dist/bundle
RUN set -e; mkdir /out; \
    [ -n "$JOBS" ] && export CARGO_BUILD_JOBS="$JOBS"; \
    [ -n "$PALMARES_BUILD_HASH" ] || unset PALMARES_BUILD_HASH; \
    cargo build --release --locked --package palmares --bin palmares --target-dir /build; \
    install --mode 0755 /build/release/palmares /out/palmares; \
    rm -rf /build

FROM runtime
COPY --from=build /out/palmares /usr/local/bin/palmares
