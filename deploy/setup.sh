#!/usr/bin/env bash
# Installs the Debian packages that building, running and testing lightprobe needs; nothing else.
#
#   deploy/setup.sh            what `make`, `make demo` and `make serve` need  (about 240 MB)
#   deploy/setup.sh --test     that and what `make test` needs: clang, clang-format  (40 MB more)
#   deploy/setup.sh --check    installs nothing; exit 1 and the names of what is missing
#
# Safe to run any number of times: where nothing is missing it says so and asks for nothing.
set -euo pipefail

say() { printf 'setup: %s\n' "$*"; }
fail() { printf 'setup: %s\n' "$*" >&2; exit 1; }
usage() { sed -n '2,8s/^# \{0,1\}//p' "$0"; }

with_test=0
check_only=0
for argument in "$@"; do
    case $argument in
    --test) with_test=1 ;;
    --check) check_only=1 ;;
    -h | --help) usage; exit 0 ;;
    *) usage >&2; exit 2 ;;
    esac
done

# What is looked for, and the package that brings it: `program NAME PACKAGE`, `library NAME PACKAGE`.
wanted="
program gcc gcc
program g++ g++
program make make
program pkg-config pkg-config
program python3 python3
program curl curl
program unzip unzip
file /etc/ssl/certs/ca-certificates.crt ca-certificates
library libmicrohttpd libmicrohttpd-dev
library libcjson libcjson-dev
library libuv libuv1-dev
library nettle nettle-dev
library libxxhash libxxhash-dev
library libcurl libcurl4-gnutls-dev
library OpenImageIO libopenimageio-dev
"
if [ $with_test = 1 ]; then
    wanted="$wanted
program clang clang
program clang-format clang-format
"
fi

# Prints the packages of everything that is not there, one a line.
missing_packages() {
    local kind name package
    while read -r kind name package; do
        case $kind in
        program) command -v "$name" >/dev/null 2>&1 || echo "$package" ;;
        file) [ -e "$name" ] || echo "$package" ;;
        library) pkg-config --exists "$name" >/dev/null 2>&1 || echo "$package" ;;
        esac
    done <<<"$wanted"
}

mapfile -t missing < <(missing_packages)
if [ ${#missing[@]} = 0 ]; then
    say "nothing is missing"
    exit 0
fi
if [ $check_only = 1 ]; then
    say "missing: ${missing[*]}"
    exit 1
fi
command -v apt-get >/dev/null 2>&1 ||
    fail "missing: ${missing[*]} (Debian's names). This is not a Debian system: install what they hold with your own package manager, then run this again."

as_root=()
if [ "$(id -u)" != 0 ]; then
    command -v sudo >/dev/null 2>&1 ||
        fail "these packages are missing and installing them needs root, but there is no sudo: run as root
    apt-get update && apt-get install --no-install-recommends ${missing[*]}"
    as_root=(sudo)
    # Without a terminal sudo cannot ask; say so instead of hanging.
    if ! sudo -n true 2>/dev/null; then
        [ -t 0 ] ||
            fail "these packages are missing and sudo wants a password, but there is no terminal to ask on: run
    sudo apt-get update && sudo apt-get install --no-install-recommends ${missing[*]}"
        say "root is needed to install packages; sudo may ask for your password"
    fi
fi

apt() { "${as_root[@]}" env DEBIAN_FRONTEND=noninteractive apt-get "$@"; }
update() {
    say "apt-get update"
    apt update -qq || fail "apt-get update failed: is this machine online, and are its package sources right?"
}

# What the installation would fetch: `COUNT BYTES`; fails when a package is not known.
plan() {
    local uris
    uris=$(apt-get install -y --no-install-recommends --print-uris "${missing[@]}" 2>/dev/null) || return 1
    awk '/^\x27/ { count++; bytes += $3 } END { printf "%d %d\n", count, bytes }' <<<"$uris"
}

planned=$(plan) || { update; planned=$(plan) || planned="0 0"; }
read -r count bytes <<<"$planned"
say "missing: ${missing[*]}"
say "installing them and what they need: $count packages, $(((bytes + 999999) / 1000000)) MB to download"

log=$(mktemp)
trap 'rm -f "$log"' EXIT
install() { apt install -y -qq --no-install-recommends "${missing[@]}" >"$log" 2>&1 </dev/null; }
if ! install; then
    # Old lists name files that are gone from the mirrors: once more with fresh ones.
    update
    install || { tail -n 15 "$log" >&2; fail "apt-get install failed (its last lines are above)"; }
fi

mapfile -t missing < <(missing_packages)
[ ${#missing[@]} = 0 ] || fail "apt-get install went through, yet these are still not usable: ${missing[*]}"
say "done"
