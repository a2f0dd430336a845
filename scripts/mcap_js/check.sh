#!/bin/sh
# Reads a log with @mcap/core and prints, as JSON, what it finds for each signal.
#
#     scripts/mcap_js/check.sh LOG
#
# The pinned packages are installed once, into $MCAP_JS_BUILD (default: a folder of the user's cache).
set -eu
here=$(cd "$(dirname "$0")" && pwd)
build=${MCAP_JS_BUILD:-${XDG_CACHE_HOME:-$HOME/.cache}/epa_rt/mcap_js}

mkdir -p "$build"
if ! cmp -s "$here/package-lock.json" "$build/installed.json"; then
    cp "$here/package.json" "$here/package-lock.json" "$build"
    npm ci --fetch-timeout=60000 --fetch-retries=1 --prefix "$build" --ignore-scripts --no-audit --no-fund --loglevel=error >&2
    cp "$here/package-lock.json" "$build/installed.json"
fi
cp "$here/check.mjs" "$build"
exec node "$build/check.mjs" "$@"
