#!/usr/bin/env bash
# Drives every route of a running daemon with curl and says what failed.
#
#   clients/curl/smoke.sh URL [--scene NAME]
#
# URL is http://HOST:PORT or unix:PATH. The scene is one of the daemon's own (the first that is
# ready, unless named). One line a check, "ok ..." or "FAILED ...: expected ..., got ..."; the last
# line counts them; exit 1 when any failed, 2 on wrong usage. Needs bash, curl and coreutils.
set -u
export LC_ALL=C

usage() {
    echo "usage: smoke.sh URL [--scene NAME]" >&2
    exit 2
}

url='' scene=''
while [ $# -gt 0 ]; do
    case $1 in
    --scene) [ $# -ge 2 ] || usage; scene=$2; shift 2 ;;
    --scene=*) scene=${1#--scene=}; shift ;;
    -*) usage ;;
    *) [ -z "$url" ] || usage; url=$1; shift ;;
    esac
done
[ -n "$url" ] || usage
command -v curl >/dev/null || { echo "smoke.sh: curl is missing: apt-get install curl" >&2; exit 2; }

curl_flags=(-sS --noproxy '*' --path-as-is --globoff --max-time 120 -H 'Expect:')
case $url in
unix:*) curl_flags+=(--unix-socket "${url#unix:}"); base=http://localhost ;;
http://* | https://*) base=${url%/} ;;
*) echo "smoke.sh: $url: give http://HOST:PORT or unix:PATH" >&2; exit 2 ;;
esac

work=$(mktemp -d) || exit 2
trap 'rm -rf "$work"' EXIT
passed=0 failed=0 without_id='' without_retry='' asked=0 last=''

ok() { passed=$((passed + 1)); echo "ok $1"; }
bad() { failed=$((failed + 1)); echo "FAILED $1: expected $2, got $3"; }

# ---- asking -------------------------------------------------------------------------------------

# ask METHOD PATH [curl arguments]: leaves status in $status, head and body in files.
ask() {
    local method=$1 path=$2
    shift 2
    local verb=(-X "$method")
    [ "$method" != HEAD ] || verb=(-I)
    : >"$work/head"
    : >"$work/body"
    asked=$((asked + 1))
    last="$method ${path:0:60}"
    status=$(curl "${curl_flags[@]}" "${verb[@]}" -D "$work/head" -o "$work/body" \
        -w '%{http_code}' "$@" "$base$path" 2>"$work/complaint") || status="none ($(head -c 120 "$work/complaint"))"
    case $status in
    414 | 431 | none*) ;; # the HTTP library's own, or no answer at all
    *) [ -n "$(header X-Request-Id)" ] || without_id+=" [$last: $status]" ;;
    esac
    case $status in
    429 | 503) [ -n "$(header Retry-After)" ] || without_retry+=" [$last: $status]" ;;
    esac
}

# post DOCUMENT [curl arguments]
post() {
    local document=$1
    shift
    printf '%s' "$document" >"$work/request"
    ask POST /v1/render --data-binary "@$work/request" "$@"
}

# header NAME: its value in the last answer (after a 100 Continue, the final one).
header() { grep -i "^$1:" "$work/head" | tail -n 1 | sed 's/^[^:]*:[[:space:]]*//; s/[[:space:]]*$//'; }

body() { tr -d '\n\0' <"$work/body"; }

# The beginning of the body, for people.
piece() { head -c 200 "$work/body" | tr -cd '[:print:]'; }

# text NAME / number NAME / list NAME: the first such field of the last body.
text() { body | grep -oE "\"$1\"[[:space:]]*:[[:space:]]*\"[^\"]*\"" | head -n 1 | sed 's/.*:[[:space:]]*"//; s/"$//'; }
number() { body | grep -oE "\"$1\"[[:space:]]*:[[:space:]]*-?[0-9][0-9.eE+-]*" | head -n 1 | sed 's/.*:[[:space:]]*//'; }
list() { body | grep -oE "\"$1\"[[:space:]]*:[[:space:]]*\[[^]]*\]" | head -n 1 | sed 's/^[^[]*//; s/[[:space:]]//g'; }

# ---- checking -----------------------------------------------------------------------------------

same() { # NAME EXPECTED GOT
    if [ "$2" = "$3" ]; then ok "$1"; else bad "$1" "${2:-nothing}" "${3:-nothing}"; fi
}
differs() { # NAME UNWANTED GOT
    if [ "$2" != "$3" ]; then ok "$1"; else bad "$1" "anything but ${2:-nothing}" "that"; fi
}
says() { # NAME PIECE: the body holds it
    if body | grep -qF -- "$2"; then ok "$1"; else bad "$1" "a body with $2" "$(piece)"; fi
}
answers() { # NAME STATUS [STATUS ...]
    local name=$1 one
    shift
    for one in "$@"; do
        [ "$status" != "$one" ] || { ok "$name: $status"; return; }
    done
    bad "$name" "status $*" "$status $(piece)"
}
media() { # NAME TYPE: Content-Type without parameters
    same "$1 is $2" "$2" "$(header Content-Type | sed 's/[[:space:]]*;.*//')"
}
# A refusal: its status and a whole problem document.
refuses() { # NAME STATUS SLUG
    local name=$1 wanted=$2 slug=$3 wrong=''
    if [ "$status" != "$wanted" ]; then
        bad "$name" "status $wanted" "$status $(piece)"
        return
    fi
    [ "$(header Content-Type | sed 's/;.*//')" = application/problem+json ] || wrong+=" Content-Type $(header Content-Type)"
    [ "$(text type)" = "/problems/$slug" ] || wrong+=" type $(text type)"
    [ "$(number status)" = "$wanted" ] || wrong+=" status $(number status)"
    [ -n "$(text title)" ] || wrong+=" no title"
    [ -n "$(text detail)" ] || wrong+=" no detail"
    [ "$(text request_id)" = "$(header X-Request-Id)" ] || wrong+=" request_id $(text request_id)"
    if [ -z "$wrong" ]; then ok "$name: $status $slug"; else bad "$name" "a problem document $slug" "$wrong"; fi
}
points_at() { # POINTER
    says "the problem points at $1" "\"$1\""
}

bytes_at() { od -An -v -tx1 -j "$2" -N "$3" "$1" | tr -d ' \n'; }
be32_at() { printf '%d' "0x$(bytes_at "$1" "$2" 4)"; }
le32_at() {
    local hex
    hex=$(bytes_at "$1" "$2" 4)
    printf '%d' "0x${hex:6:2}${hex:4:2}${hex:2:2}${hex:0:2}"
}
is_png() { # NAME WIDTH HEIGHT
    same "$1 has the PNG magic" 89504e470d0a1a0a "$(bytes_at "$work/body" 0 8)"
    same "$1 is $2x$3 pixels" "$2x$3" "$(be32_at "$work/body" 16)x$(be32_at "$work/body" 20)"
}
is_exr() { # NAME WIDTH HEIGHT: the attribute is "dataWindow\0box2i\0", its size, four numbers
    local at
    same "$1 has the EXR magic" 762f3101 "$(bytes_at "$work/body" 0 4)"
    at=$(grep -aobF dataWindow "$work/body" | head -n 1 | cut -d: -f1)
    if [ -z "$at" ]; then
        bad "$1 is $2x$3 pixels" "an attribute dataWindow" "none"
        return
    fi
    at=$((at + 21))
    same "$1 is $2x$3 pixels" "$2x$3" \
        "$(($(le32_at "$work/body" $((at + 8))) - $(le32_at "$work/body" "$at") + 1))x$(($(le32_at "$work/body" $((at + 12))) - $(le32_at "$work/body" $((at + 4))) + 1))"
}

# ---- is anybody there? --------------------------------------------------------------------------

ask GET /v1/health/live
if [ "${status#none}" != "$status" ]; then
    echo "FAILED reaching $url: expected a daemon, got $status"
    echo "0 passed, 1 failed"
    exit 1
fi
answers "GET /v1/health/live" 200
ask GET /v1/health/ready
answers "GET /v1/health/ready" 200
ask GET /
answers "GET /" 200
media "the dashboard" text/html

ask GET /v1/health/live -H 'X-Request-Id: smoke.test_1-A'
same "X-Request-Id is echoed" smoke.test_1-A "$(header X-Request-Id)"
ask GET /v1/health/live
made=$(header X-Request-Id)
ask GET /v1/health/live
differs "X-Request-Id is made anew" "$made" "$(header X-Request-Id)"
too_long=$(printf 'a%.0s' {1..65})
ask GET /v1/health/live -H "X-Request-Id: $too_long"
differs "an X-Request-Id of 65 characters is not echoed" "$too_long" "$(header X-Request-Id)"
ask GET /v1/health/live -H 'X-Request-Id: <script>'
differs "an X-Request-Id with other characters is not echoed" '<script>' "$(header X-Request-Id)"

ask GET /v1/stats
answers "GET /v1/stats" 200
media "the statistics" application/json

# ---- scenes -------------------------------------------------------------------------------------

ask GET /v1/scenes
answers "GET /v1/scenes" 200
media "the list of scenes" application/json
says "the list of scenes is a list" '"scenes"'
if [ -z "$scene" ]; then
    for name in $(body | grep -oE '"name"[[:space:]]*:[[:space:]]*"[^"]*"' | sed 's/.*:[[:space:]]*"//; s/"$//'); do
        ask GET "/v1/scenes/$name"
        if [ "$status" = 200 ] && [ "$(text state)" = ready ]; then
            scene=$name
            break
        fi
    done
fi
if [ -z "$scene" ]; then
    bad "a scene to render" "one that is ready in GET /v1/scenes" "none"
    echo "$passed passed, $failed failed"
    exit 1
fi
ask GET "/v1/scenes/$scene"
answers "GET /v1/scenes/$scene" 200
same "the scene is ready" ready "$(text state)"
for field in name state voxels nodes bytes depth voxel_size_m bounds_m lightings channels sha256 refs suggested_probe; do
    says "the scene tells $field" "\"$field\""
done
scene_sha256=$(text sha256)
probe=$(list suggested_probe)
ask HEAD "/v1/scenes/$scene"
answers "HEAD /v1/scenes/$scene" 200
ask GET /v1/scenes/no-such-scene
refuses "an unknown scene" 404 unknown-scene

# ---- rendering ----------------------------------------------------------------------------------

job="{\"scene\":\"$scene\",\"mode\":\"lod\",\"face_px\":16,\"probes\":[$probe],\"images\":[\"png\",\"exr\"]}"
post "$job"
answers "POST /v1/render" 200
media "its answer" application/json
id=$(text id)
film=$(text film_sha256)
same "the result is done" done "$(text state)"
same "film_sha256 has 64 digits" 64 "${#film}"
same "6 faces of 16x16 are 1536 pixels" 1536 "$(number pixels)"
says "the result names the scene's hash" "$scene_sha256"
for field in request counters rays rays_hit rays_discarded rays_per_pixel traversal_steps \
    pixels_background pixels_by_rays pixels_by_level totals seconds reproduce; do
    says "the result has $field" "\"$field\""
done
differs "Server-Timing is told" '' "$(header Server-Timing)"
hrefs=$(body | grep -oE '"href"[[:space:]]*:[[:space:]]*"[^"]*"' | sed 's/.*:[[:space:]]*"//; s/"$//')
same "two pictures are linked" 2 "$(printf '%s\n' "$hrefs" | grep -c /)"
sums=$(body | grep -oE '"sha256"[[:space:]]*:[[:space:]]*"[0-9a-f]{64}"' | sed 's/.*:[[:space:]]*"//; s/"$//')

post "$job" -H 'Accept: */*'
answers "POST /v1/render with Accept */*" 200
media "its answer" application/json
same "the same request gives the same film" "$film" "$(text film_sha256)"
post "$job" -H 'Content-Type: text/plain'
answers "Content-Type is ignored" 200
post "${job/\"mode\":\"lod\"/\"mode\":\"reference\"}"
answers "mode reference" 200
same "4x4 rays a pixel are 24576 rays" 24576 "$(number rays)"
post "$job" -H 'Accept: image/png'
answers "POST /v1/render with Accept image/png" 200
media "its answer" image/png
is_png "the strip" 96 16
post "$job" -H 'Accept: image/x-exr'
answers "POST /v1/render with Accept image/x-exr" 200
media "its answer" image/x-exr
is_exr "the strip" 96 16
post "$job" -H 'Accept: application/json;q=0.1, image/png;q=0.5'
media "the best liked type" image/png
post "${job%\}},\"faces\":[\"+X\",\"-Z\"]}" -H 'Accept: image/png'
answers "two faces" 200
is_png "a strip of two faces" 32 16

# ---- the result of a synchronous call -----------------------------------------------------------

ask GET "/v1/jobs/$id"
answers "GET /v1/jobs/{id}" 200
same "the job is done" done "$(text state)"
ask GET "/v1/jobs/$id/result"
answers "GET /v1/jobs/{id}/result" 200
same "the stored result is of the same film" "$film" "$(text film_sha256)"
for href in $hrefs; do
    ask GET "$href"
    answers "GET $href" 200
    case $href in
    *.png*) media "it" image/png; is_png "it" 96 16 ;;
    *.exr*) media "it" image/x-exr; is_exr "it" 96 16 ;;
    *) bad "the picture's name" ".png or .exr" "$href" ;;
    esac
    sum=$(sha256sum <"$work/body" | cut -d' ' -f1)
    if printf '%s\n' "$sums" | grep -qx "$sum"; then ok "its sha256 is the document's"; else bad "its sha256" "one of the document's" "$sum"; fi
    size=$(stat -c %s "$work/body")
    etag=$(header ETag)
    case $etag in
    \"*\") ok "it has a strong ETag" ;;
    *) bad "its ETag" "a strong one, in quotes" "${etag:-nothing}" ;;
    esac
    ask GET "$href" -H "If-None-Match: $etag"
    answers "If-None-Match with its ETag" 304
    same "a 304 has no body" 0 "$(stat -c %s "$work/body")"
    ask GET "$href" -H 'If-None-Match: "another"'
    answers "If-None-Match with another" 200
    ask HEAD "$href"
    answers "HEAD of it" 200
    same "HEAD tells its size" "$size" "$(header Content-Length)"
    ranges=$(header Accept-Ranges)
    ask GET "$href" -H 'Range: bytes=0-3'
    if [ "$ranges" = none ]; then # said openly: then the whole file is the right answer
        answers "Range where Accept-Ranges is none" 200
        same "it is the whole file" "$size" "$(stat -c %s "$work/body")"
    else
        answers "Range of 4 bytes" 206
        same "Content-Range tells which" "bytes 0-3/$size" "$(header Content-Range)"
        same "a range of 4 bytes has 4" 4 "$(stat -c %s "$work/body")"
    fi
done
post "${job/\"png\",\"exr\"/\"png\"}"
answers "a job with png only" 200
ask GET "/v1/jobs/$(text id)/probes/0.exr"
refuses "a picture nobody asked for" 404 unknown-image
ask GET "/v1/jobs/$id/probes/1.png"
answers "a probe that is not there" 404
ask GET /v1/jobs/no-such-job
refuses "an unknown job" 404 unknown-job
ask GET /v1/jobs/no-such-job/result
refuses "the result of an unknown job" 404 unknown-job

# ---- what is refused ----------------------------------------------------------------------------

post '{"scene":'
refuses "half a document" 400 invalid-json
post ''
refuses "an empty body" 400 invalid-json
post "${job%\}},}"
refuses "a comma too many" 400 invalid-json
post "${job/\"face_px\":16/\"face_px\":016}"
refuses "a number with a leading zero" 400 invalid-json
post "${job/\"face_px\":16/\"face_px\":NaN}"
refuses "NaN" 400 invalid-json
post "${job/\"face_px\":16/\"face_px\":Infinity}"
refuses "Infinity" 400 invalid-json
post "$job x"
refuses "text after the document" 400 invalid-json
post "$(printf '[%.0s' {1..5000})"
refuses "5000 brackets" 400 invalid-json
post "$(printf '{"scene":"\xff\xfe"}')"
refuses "bytes that are no UTF-8" 400 invalid-json
post "${job%\}},\"colour\":1}"
refuses "an unknown field" 422 invalid-field
points_at /colour
post "${job/\"face_px\":16/\"face_px\":1e999}"
refuses "1e999" 422 invalid-field
points_at /face_px
post "${job/\"face_px\":16/\"face_px\":4097}"
refuses "a value out of range" 422 invalid-field
points_at /face_px
post "${job/\"face_px\":16/\"face_px\":\"16\"}"
refuses "a wrong type" 422 invalid-field
points_at /face_px
post '[]'
refuses "a document that is no object" 422 invalid-field
post '{}'
refuses "a document without its fields" 422 invalid-field
post "${job/\"mode\":\"lod\"/\"mode\":\"adaptive\"}"
refuses "a mode of later versions" 422 invalid-field
says "it is said to be later" "not in this version"
post "${job%\}},\"lighting\":\"no-such-lighting\"}"
refuses "an unknown lighting" 422 invalid-field
points_at /lighting
post "${job/\"$scene\"/\"no-such-scene\"}"
refuses "a job for an unknown scene" 404 unknown-scene
for name in ../etc/passwd .hidden a/b 'a b' ''; do
    post "${job/\"$scene\"/\"$name\"}"
    refuses "a job for scene \"$name\"" 422 invalid-field
    points_at /scene
done
for path in /v1/scenes/../../etc/passwd /v1/scenes/.. /v1/scenes/..%2f..%2fetc%2fpasswd \
    /v1/scenes/%2e%2e /v1/scenes/.hidden /v1/scenes/a%2Fb //v1/scenes "/v1/scenes/$scene/.." \
    "/v1/scenes/$scene/" /v1/jobs/../scenes "/v1/jobs/$id/probes/..%2f0.png"; do
    ask GET "$path"
    answers "GET $path" 404
done
ask GET "/v1/scenes/$scene%00"
answers "a name with a NUL" 400 404
ask GET /v1/nothing
refuses "an address with nothing" 404 unknown-route

head -c 2097152 /dev/zero | tr '\0' ' ' >"$work/large"
ask POST /v1/render --data-binary "@$work/large"
refuses "a body of 2 MiB" 413 too-large
ask POST /v1/render --data-binary "@$work/large" -H 'Transfer-Encoding: chunked'
refuses "a chunked body of 2 MiB" 413 too-large
ask GET "/v1/scenes/$(head -c 20000 "$work/large" | tr ' ' a)"
answers "a target of 20,000 bytes" 400 404 414 431

# allowed METHOD PATH ALLOW: refused, and Allow names what the address knows.
allowed() {
    ask "$1" "$2"
    refuses "$1 $2" 405 method-not-allowed
    if header Allow | grep -qw "$3"; then ok "Allow of $2 names $3"; else bad "Allow of $2" "$3" "$(header Allow)"; fi
}
allowed GET /v1/render POST
allowed DELETE /v1/render POST
allowed DELETE /v1/stats GET
allowed POST /v1/health/live GET
allowed PATCH "/v1/scenes/$scene" GET
allowed PUT "/v1/jobs/$id/result" GET
allowed POST / GET

post "$job" -H 'Accept: text/plain'
refuses "Accept text/plain" 406 not-acceptable
post "$job" -H 'Accept: image/ktx2'
refuses "Accept of later versions" 406 not-acceptable
post "$job" -H 'Accept: application/json;q=0'
refuses "Accept with q=0 only" 406 not-acceptable

ask GET /v1/scenes -H 'Host: evil.example'
refuses "a foreign Host" 403 foreign-origin
ask GET /v1/scenes -H 'Origin: http://evil.example'
refuses "a foreign Origin" 403 foreign-origin
post "$job" -H 'Origin: null'
refuses "the Origin null" 403 foreign-origin
ask GET /v1/scenes -H "Origin: $base"
answers "the daemon's own Origin" 200

# ---- afterwards ---------------------------------------------------------------------------------

same "every answer has an X-Request-Id" '' "$without_id"
same "every 429 and 503 has Retry-After" '' "$without_retry"
ask GET /v1/health/ready
answers "the daemon is still ready" 200
post "$job"
same "and renders the same film" "$film" "$(text film_sha256)"

echo "$passed passed, $failed failed"
[ "$failed" -eq 0 ]
