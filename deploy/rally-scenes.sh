#!/usr/bin/env bash
# Makes scenes of levels of the Debian package trigger-rally-data (GPL-2+; none is committed here).
#
#   deploy/rally-scenes.sh [--data DIR] [--depth D] [--lightprobe PROGRAM] LEVEL...
#   deploy/rally-scenes.sh --list        the levels there are
#
#   --data DIR            the daemon's folder; scenes go to DIR/scenes/LEVEL.lps (default: data)
#   --depth D             2^D voxels along an edge (default: 10)
#   --lightprobe PROGRAM  the program that builds (default: build/lightprobe)
#
# Asks for root at no point: where the package is not installed, it is downloaded to DIR/cache
# (119 MB, once). A scene that is up to date is left alone.
set -euo pipefail

PACKAGE=trigger-rally-data
INSTALLED=/usr/share/games/trigger-rally/data.zip

say() { printf 'rally-scenes: %s\n' "$*"; }
fail() { printf 'rally-scenes: %s\n' "$*" >&2; exit 1; }
usage() { sed -n '2,12s/^# \{0,1\}//p' "$0"; }
misused() { printf 'rally-scenes: %s\n\n' "$*" >&2; usage >&2; exit 2; }

data=data
depth=10
lightprobe=$(dirname "$0")/../build/lightprobe
list_only=0
levels=()
while [ $# -gt 0 ]; do
    case $1 in
    --data | --depth | --lightprobe)
        [ $# -ge 2 ] || misused "$1 needs a value"
        case $1 in
        --data) data=$2 ;;
        --depth) depth=$2 ;;
        --lightprobe) lightprobe=$2 ;;
        esac
        shift 2
        ;;
    --list) list_only=1; shift ;;
    -h | --help) usage; exit 0 ;;
    -*) misused "$1 is no flag" ;;
    *) levels+=("$1"); shift ;;
    esac
done
[[ $depth =~ ^[1-9][0-9]?$ ]] && [ "$depth" -le 14 ] || misused "--depth $depth is not from 1 to 14"
[ ${#levels[@]} -gt 0 ] || [ $list_only = 1 ] || misused "name a level, duned for example"
[ $list_only = 1 ] || [ -x "$lightprobe" ] ||
    fail "$lightprobe is not there; run \`make\` first, or name it with --lightprobe"
command -v python3 >/dev/null || fail "python3 is missing; deploy/setup.sh installs it"

cache=$data/cache/rally
mkdir -p "$data/scenes" "$cache" || fail "$data cannot be written to; name another --data"
work=$(mktemp -d "$cache/work-XXXXXX")
trap 'rm -rf "$work"' EXIT
trap 'exit 130' INT
trap 'exit 143' TERM HUP

# Leaves the path of the levels' archive in `archive`; downloads it where it is not installed.
find_archive() {
    archive=$INSTALLED
    [ ! -r "$archive" ] || return 0
    archive=$cache/data.zip
    [ ! -r "$archive" ] || return 0
    command -v apt-get >/dev/null && command -v dpkg-deb >/dev/null ||
        fail "no apt-get and dpkg-deb here to fetch $PACKAGE with; put its data.zip at $archive"
    say "downloading the package $PACKAGE (119 MB) to $cache"
    # As root, apt would drop to a user who may not write here.
    (cd "$work" && apt-get -qq -o APT::Sandbox::User=root download "$PACKAGE") ||
        fail "$PACKAGE could not be downloaded (the reason is above); \`apt-get update\` may help"
    dpkg-deb --fsys-tarfile "$work/$PACKAGE"_*.deb | tar -xO ".$INSTALLED" >"$work/data.zip" ||
        fail "$PACKAGE holds no .$INSTALLED"
    mv "$work/data.zip" "$archive"
    rm -f "$work/$PACKAGE"_*.deb
}

# read_levels list: every level's name, one a line.
# read_levels take LEVEL FOLDER: unpacks its maps; prints height map, colour map, edge and relief in
# metres, and a remark, separated by tabs.
read_levels() {
    python3 - "$archive" "$@" <<'PYTHON'
import os.path
import struct
import sys
import xml.etree.ElementTree as ElementTree
import zipfile


def fail(text):
    sys.exit("rally-scenes: " + text)


def size_of(name, data):
    """Width, height and channels of a PNG or JPEG file."""
    if data[:8] == b"\x89PNG\r\n\x1a\n":
        width, height, _, kind = struct.unpack(">IIBB", data[16:26])
        return width, height, {0: 1, 2: 3, 3: 3, 4: 2, 6: 4}[kind]
    at = 2
    while data[:2] == b"\xff\xd8" and at + 10 <= len(data) and data[at] == 0xFF:
        if 0xC0 <= data[at + 1] <= 0xCF and data[at + 1] not in (0xC4, 0xC8, 0xCC):
            height, width, channels = struct.unpack(">HHB", data[at + 5:at + 10])
            return width, height, channels
        at += 2 + struct.unpack(">H", data[at + 2:at + 4])[0]
    fail(name + " is neither PNG nor JPEG")


def take(archive, member, level, folder):
    """Unpacks the two maps. The height of a pixel is its 8-bit value * verticalscale * the sum of
    the blur filter's weights (the game does not normalise them), in metres; a pixel is
    horizontalscale metres wide."""
    terrain = ElementTree.fromstring(archive.read(member)).find("terrain")
    if terrain is None:
        fail(level + " has no terrain")
    place = os.path.dirname(member) + "/"
    paths = []
    for what in ("heightmap", "colormap"):
        data = archive.read(place + terrain.get(what))
        paths.append(os.path.join(folder, what + os.path.splitext(terrain.get(what))[1].lower()))
        with open(paths[-1], "wb") as stream:
            stream.write(data)
        if what == "heightmap":
            width, height, channels = size_of(level, data)
    rows = [row.get("data").split() for row in terrain.findall("blurfilter/row")]
    weight = sum(float(value) for row in rows for value in row) if rows else 1.0
    remarks = []
    if channels > 1:
        remarks.append("the height map has %d channels: the first one counts, as in the game"
                       % channels)
    if rows:
        remarks.append("the %d x %d blur scales heights by %.6g; its smoothing is not applied yet"
                       % (len(rows[0]), len(rows), weight))
    if width != height:
        fail("%s has a height map of %d x %d pixels; only square ones are taken"
             % (level, width, height))
    print("\t".join(paths + ["%.9g" % (width * float(terrain.get("horizontalscale"))),
                             "%.9g" % (255 * float(terrain.get("verticalscale")) * weight),
                             "; ".join(remarks) or "-"]))


def main():
    try:
        archive = zipfile.ZipFile(sys.argv[1])
        members = {os.path.basename(name)[:-len(".level")]: name for name in archive.namelist()
                   if name.startswith("maps/") and name.endswith(".level")}
        if sys.argv[2] == "list":
            print("\n".join(sorted(members)))
        else:
            take(archive, members[sys.argv[3]], sys.argv[3], sys.argv[4])
    except (OSError, KeyError, ValueError, TypeError, zipfile.BadZipFile,
            ElementTree.ParseError) as error:
        fail("%s: %s: %s" % (" ".join(sys.argv[1:4]), type(error).__name__, error))


main()
PYTHON
}

# What a scene on disk was made from; empty where there is none.
state_of() {
    [ ! -e "$1" ] || stat -c '%s bytes, changed %y' "$1"
}

build_level() {
    local level=$1 number=$2
    local scene=$data/scenes/$level.lps stamp=$cache/$level.built made
    made="depth $depth, $version, maps $(state_of "$archive")"
    if [ -e "$scene" ] && [ -e "$stamp" ] &&
        [ "$(cat "$stamp")" = "$made, scene $(state_of "$scene")" ]; then
        say "[$number/${#levels[@]}] $level: $scene is up to date"
        return 0
    fi
    local height color size_m height_m remark fields
    fields=$(read_levels take "$level" "$work")
    IFS=$'\t' read -r height color size_m height_m remark <<<"$fields"
    say "[$number/${#levels[@]}] $level: $size_m m wide, relief up to $height_m m, depth $depth"
    [ "$remark" = - ] || say "[$number/${#levels[@]}] $level: $remark"
    "$lightprobe" build "$height" --color "$color" --size-m "$size_m" --height-m "$height_m" \
        --depth "$depth" -o "$work/$level.lps" ||
        fail "$level was not built (the reason is above)"
    mv -f "$work/$level.lps" "$scene"
    printf '%s\n' "$made, scene $(state_of "$scene")" >"$work/stamp"
    mv -f "$work/stamp" "$stamp"
    say "[$number/${#levels[@]}] $level: wrote $scene ($(stat -c %s "$scene") bytes)"
}

find_archive
known=$(read_levels list)
if [ $list_only = 1 ]; then
    printf '%s\n' "$known"
    exit 0
fi
for level in "${levels[@]}"; do
    grep -qxF -- "$level" <<<"$known" ||
        fail "there is no level \"$level\"; there are: $(tr '\n' ' ' <<<"$known")"
done
version=$("$lightprobe" --version) || fail "$lightprobe does not run"
number=0
for level in "${levels[@]}"; do
    number=$((number + 1))
    build_level "$level" "$number"
done
