#!/bin/sh
# Makes the image NAME of Debian bookworm's packages: debian.sh NAME
set -e
export DEBIAN_FRONTEND=noninteractive
get() { apt-get install --yes --no-install-recommends debootstrap; }
command -v debootstrap || get || { apt-get update && get; } || { echo "no debootstrap" >&2; exit 1; }
folder=$(mktemp --directory)
trap 'rm -rf "$folder"' EXIT
debootstrap --variant=minbase bookworm "$folder/root"
tar --directory "$folder/root" --create --file "$folder/root.tar" .
docker import "$folder/root.tar" "$1"
