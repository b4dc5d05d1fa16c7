#!/usr/bin/env bash
# Bakes a light probe of a real terrain through the daemon, shows the counters and the pictures, ends.
#
#   deploy/demo.sh      the same as `make demo`
#
# DATA (default: data) is the daemon's folder, PICTURES (default: build/demo) takes the pictures.
set -euo pipefail
cd "$(dirname "$0")/.."
unset MAKEFLAGS MAKELEVEL MFLAGS
DATA=${DATA:-data}
PICTURES=${PICTURES:-build/demo}
SCENE=duned
FACE_PX=256
READY_TIMEOUT_S=120

say() { printf 'demo: %s\n' "$*"; }
fail() { printf 'demo: %s\n' "$*" >&2; exit 1; }
began_s=$SECONDS

deploy/setup.sh
say "building (a minute or two the first time)"
build_log=$(mktemp)
daemon_pid=
clean_up() {
    if [ -n "$daemon_pid" ] && kill -0 "$daemon_pid" 2>/dev/null; then
        kill -TERM "$daemon_pid" 2>/dev/null || true
        kill -TERM "$daemon_pid" 2>/dev/null || true # the second one cancels what still runs
        wait "$daemon_pid" 2>/dev/null || true
    fi
    rm -f "$build_log"
}
trap clean_up EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP
make -j"$(nproc)" CONFIG=release COMPILER=gcc all >"$build_log" 2>&1 || {
    tail -n 30 "$build_log" >&2
    fail "the build failed (its last lines are above); try \`make\` by itself"
}

if [ ! -e "$DATA/scenes/$SCENE.lps" ]; then
    say "fetching the terrain $SCENE and making a scene of it"
    deploy/rally-scenes.sh --data "$DATA" --lightprobe build/lightprobe "$SCENE" ||
        fail "the terrain could not be fetched or built (the reason is above)"
fi
[ -e "$DATA/scenes/$SCENE.lps" ] || fail "deploy/rally-scenes.sh left no $DATA/scenes/$SCENE.lps"

# The daemon writes one line when it is ready; end of file instead means that it gave up.
mkdir -p "$PICTURES"
daemon_log=$PICTURES/lightprobed.log
exec {from_daemon}< <(exec build/lightprobed --listen 127.0.0.1:0 --data "$DATA" 2>"$daemon_log")
daemon_pid=$!
read -r -t "$READY_TIMEOUT_S" line <&"$from_daemon" || {
    tail -n 5 "$daemon_log" >&2
    fail "the daemon did not get ready (its last lines are above). Where another one uses $DATA, end it or take another folder: make demo DATA=other"
}
case $line in
"ready http://"*) url=${line#ready } ;;
*) fail "the daemon said \"$line\" where \"ready http://HOST:PORT\" was due" ;;
esac
say "lightprobed is ready at $url"

# Prints a member of the JSON object on standard input.
member() { python3 -c 'import json, sys; print(json.load(sys.stdin).get(sys.argv[1]))' "$1"; }

# A file that is new to this folder is verified first; that takes moments.
scene_state=loading
deadline_s=$((SECONDS + READY_TIMEOUT_S))
while [ "$scene_state" = loading ] || [ "$scene_state" = importing ]; do
    [ $SECONDS -lt $deadline_s ] || fail "scene $SCENE was still $scene_state after $READY_TIMEOUT_S s"
    scene=$(curl -sS -f "$url/v1/scenes/$SCENE") || fail "GET $url/v1/scenes/$SCENE failed"
    scene_state=$(member state <<<"$scene")
    [ "$scene_state" = ready ] || sleep 0.1
done
[ "$scene_state" = ready ] || fail "scene $SCENE is $scene_state: $(member reason <<<"$scene")"
probe=$(member suggested_probe <<<"$scene")
say "scene $SCENE: $(member voxels <<<"$scene") voxels of $(member voxel_size_m <<<"$scene") m; probe at $probe"

bake() { # MODE
    local mode=$1 answer=$PICTURES/$SCENE-$1.json body status
    body="{\"scene\":\"$SCENE\",\"mode\":\"$mode\",\"face_px\":$FACE_PX,\"probes\":[$probe],\"images\":[\"png\",\"exr\"],\"environment\":{\"constant\":[0.35,0.55,0.9]}}"
    status=$(curl -sS -o "$answer" -w '%{http_code}' -X POST "$url/v1/render" -d "$body") ||
        fail "POST /v1/render ($mode) got no answer"
    [ "$status" = 200 ] || { cat "$answer" >&2; fail "POST /v1/render ($mode) answered $status"; }
    say "$mode: $(python3 -c '
import json, sys
d = json.load(sys.stdin)
c = d["probes"][0]["counters"]
print("%d rays, %d hit, %.3f rays a pixel, %d traversal steps, %d of %d pixels background, %.3f s" % (
    c["rays"], c["rays_hit"], c["rays_per_pixel"], c["traversal_steps"], c["pixels_background"],
    c["pixels"], d["seconds"]["render"]))' <"$answer")"
    local href picture
    while read -r href; do
        picture=$PICTURES/$SCENE-$mode.${href##*.}
        curl -sS -f -o "$picture" "$url$href" || fail "GET $url$href failed"
        pictures+=("$picture")
    done < <(python3 -c '
import json, sys
for image in json.load(sys.stdin)["probes"][0]["images"]:
    print(image["href"].split("?")[0])' <"$answer")
}
pictures=()
bake reference
bake lod

kill -TERM "$daemon_pid"
daemon_status=0
wait "$daemon_pid" || daemon_status=$?
daemon_pid=
[ $daemon_status = 0 ] || { tail -n 5 "$daemon_log" >&2; fail "the daemon ended with status $daemon_status (its last lines are above)"; }

say "the six faces +X -X +Y -Y +Z -Z side by side, ${FACE_PX} pixels each:"
printf '    %s\n' "${pictures[@]}"
say "done in $((SECONDS - began_s)) s. \`make serve\` keeps a daemon running, with its status page at http://127.0.0.1:8080/"
