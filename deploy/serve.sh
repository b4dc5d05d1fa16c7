#!/usr/bin/env bash
# Sets up, builds, fetches a terrain where there is none, and runs the daemon in the foreground.
#
#   deploy/serve.sh     the same as `make serve`
#
# PORT (default: 8080) and DATA (default: data) choose address and folder. Ctrl-C ends it.
set -euo pipefail
cd "$(dirname "$0")/.."
unset MAKEFLAGS MAKELEVEL MFLAGS
PORT=${PORT:-8080}
DATA=${DATA:-data}
SCENE=duned

say() { printf 'serve: %s\n' "$*"; }
fail() { printf 'serve: %s\n' "$*" >&2; exit 1; }

deploy/setup.sh
say "building"
build_log=$(mktemp)
make -j"$(nproc)" CONFIG=release COMPILER=gcc all >"$build_log" 2>&1 || {
    tail -n 30 "$build_log" >&2
    rm -f "$build_log"
    fail "the build failed (its last lines are above); try \`make\` by itself"
}
rm -f "$build_log"

if [ ! -e "$DATA/scenes/$SCENE.lps" ]; then
    say "fetching the terrain $SCENE and making a scene of it"
    deploy/rally-scenes.sh --data "$DATA" --lightprobe build/lightprobe "$SCENE" ||
        fail "the terrain could not be fetched or built (the reason is above)"
fi
info=$(build/lightprobe info "$DATA/scenes/$SCENE.lps" --json) ||
    fail "$DATA/scenes/$SCENE.lps is unusable (the reason is above): remove it and start again"
probe=$(python3 -c 'import json, sys; print(json.load(sys.stdin)["suggested_probe"])' <<<"$info")

url=http://127.0.0.1:$PORT
cat <<TEXT
serve: once it says ready, in another terminal:

    curl -s $url/v1/scenes
    curl -s -X POST $url/v1/render -d '{"scene":"$SCENE","mode":"reference","face_px":64,"probes":[$probe]}'
    curl -s -X POST $url/v1/render -H 'Accept: image/png' -o probe.png -d '{"scene":"$SCENE","mode":"reference","face_px":256,"probes":[$probe]}'

    status page: $url/        end: Ctrl-C

TEXT
exec build/lightprobed --listen "127.0.0.1:$PORT" --data "$DATA"
