"""House rules that a program can check: layers, headers, format, sizes. `make check-style`.

Prints one line per rule that is broken somewhere and ends with "N passed, N failed"; each rule is
one test. Reviewed exceptions stand in tests/style/reviewed.txt, with their reasons.
"""

import concurrent.futures
import fnmatch
import os
import pathlib
import re
import subprocess
import sys

ROOT = pathlib.Path(__file__).resolve().parents[2]
LINES_MAX = 600
COLUMNS_MAX = 100
FOLDERS = ("engine", "protocol", "server", "clients", "tests", "deploy", ".ci")

# Who may include whom: the layers of the project, by the first folder of an include.
LAYERS = {
    "engine": {"engine"},
    "protocol": {"protocol"},
    "server": {"server", "engine", "protocol"},
    "clients": {"clients", "protocol"},
    "tests": {"tests", "engine", "protocol", "server", "clients"},
}
# The command line also works on files, so it links the engine and the one file where the engine's
# and the protocol's words meet.
CLI_EXTRA = ("engine/*", "server/bake.h")

# Where a library may be seen: (headers, files that may include them).
LIBRARIES = (
    (("OpenImageIO/*",), ("engine/image_oiio.cpp",)),
    (("cjson/*", "cJSON.h"), ("protocol/*", "tests/protocol/*")),
    (("microhttpd.h", "uv.h"), ("server/*",)),
    # the client library may not see the engine, and checks what it downloads itself
    (("nettle/*",), ("engine/sha256.c", "clients/c/*")),
    (("xxhash.h",), ("engine/*", "tests/engine/*")),
    (("curl/*",), ("clients/c/*",)),
    (("sqlite3.h",), ("server/store*.c", "server/store*.h")),
)

INCLUDE = re.compile(r'^[ \t]*#[ \t]*include[ \t]*([<"])([^>"]+)[>"]', re.M)


def files(*patterns):
    """Files of the tree below its folders, as paths relative to the root."""
    found = []
    for folder in FOLDERS:
        for path in sorted((ROOT / folder).rglob("*")):
            name = path.relative_to(ROOT).as_posix()
            if path.is_file() and any(fnmatch.fnmatch(path.name, p) for p in patterns):
                found.append(name)
    return found


def text(name):
    return (ROOT / name).read_text(encoding="utf-8")


def reviewed(rule):
    """Names that reviewed.txt lets off a rule."""
    names = set()
    for line in text("tests/style/reviewed.txt").splitlines():
        words = line.split("#")[0].split()
        if words and words[0] == rule:
            names.add(words[1])
    return names


def c_files():
    return files("*.c", "*.h", "*.cpp")


# ---- rules: each yields sentences about what breaks it -------------------------------------------

def rule_layers():
    """engine and protocol know nobody; server and clients know them; the CLI sees one header."""
    for name in c_files():
        folder = name.split("/")[0]
        for kind, include in INCLUDE.findall(text(name)):
            first = include.split("/")[0]
            if kind == '"' and "/" not in include:
                yield "%s includes \"%s\": write the path from the root" % (name, include)
            if first not in LAYERS or first in LAYERS.get(folder, ()):
                continue
            if name.startswith("clients/cli/") and any(
                    fnmatch.fnmatch(include, p) for p in CLI_EXTRA):
                continue
            yield "%s includes %s: %s may see only %s" % (name, include, folder,
                                                        ", ".join(sorted(LAYERS[folder])))


def rule_libraries():
    """Each third-party library stays behind its one face."""
    for name in c_files():
        for _, include in INCLUDE.findall(text(name)):
            for headers, homes in LIBRARIES:
                if any(fnmatch.fnmatch(include, h) for h in headers) and not any(
                        fnmatch.fnmatch(name, h) for h in homes):
                    yield "%s includes <%s>, which belongs in %s" % (name, include, " ".join(homes))


def rule_no_sql():
    """SQL nowhere but in the store's files."""
    sql = re.compile(r'"[^"\n]*\b(SELECT .* FROM|INSERT INTO|UPDATE \w+ SET|DELETE FROM|CREATE TABLE'
                     r'|PRAGMA \w+)\b')
    for name in c_files():
        if not fnmatch.fnmatch(name, "server/store*") and sql.search(text(name)):
            yield "%s holds SQL" % name


def rule_engine_is_quiet():
    """The engine starts no thread, opens no socket, writes no log line."""
    words = re.compile(r"\b(pthread_create|thrd_create|socket|fprintf|printf|puts|perror|syslog)\s*\(")
    for name in c_files():
        if name.startswith("engine/"):
            for number, line in enumerate(without_comments(text(name)).splitlines(), 1):
                found = words.search(line)
                if found:
                    yield "%s:%d calls %s" % (name, number, found.group(1))


def without_comments(source):
    """The source with comments and strings blanked, lines kept."""
    blank = lambda m: re.sub(r"[^\n]", " ", m.group(0))
    return re.sub(r'/\*.*?\*/|//[^\n]*|"(?:\\.|[^"\\\n])*"', blank, source, flags=re.S)


def rule_forbidden_calls():
    """Calls that the house style replaces. Tests are let off: they copy their own short constants,
    and run under AddressSanitizer."""
    words = re.compile(r"\b(strcpy|strcat|sprintf|vsprintf|gets|atoi|atol|atof|alloca|strtok|system"
                       r"|popen|tmpnam|mktemp)\s*\(")
    for name in c_files():
        if name.startswith("tests/"):
            continue
        for number, line in enumerate(without_comments(text(name)).splitlines(), 1):
            found = words.search(line)
            if found:
                yield "%s:%d calls %s" % (name, number, found.group(1))


def rule_first_line():
    """Line 1 of a file is its responsibility in one sentence."""
    starts = {".c": "/* ", ".h": "/* ", ".cpp": ("/* ", "// "), ".py": '"""', ".sh": "#!"}
    for name in c_files() + files("*.py", "*.sh") + ["Makefile"]:
        lines = text(name).splitlines()
        suffix = pathlib.Path(name).suffix
        start = starts.get(suffix, "# ")
        if lines and lines[0].startswith("#!") and suffix in (".py", ".sh"):
            lines = lines[1:]
            start = "# " if suffix == ".sh" else start
        if not lines or not lines[0].startswith(start) or len(lines[0].split()) < 4:
            yield "%s does not begin with a sentence in a comment" % name


def rule_sizes():
    """No file over %d lines without a reviewed reason.""" % LINES_MAX
    allowed = reviewed("size")
    for name in c_files() + files("*.py", "*.sh"):
        count = len(text(name).splitlines())
        if count > LINES_MAX and name not in allowed:
            yield "%s has %d lines: split it, or give the reason in tests/style/reviewed.txt" % (
                name, count)
    for name in allowed:
        if not (ROOT / name).exists() or len(text(name).splitlines()) <= LINES_MAX:
            yield "tests/style/reviewed.txt lets off %s, which needs it no more" % name


def rule_columns():
    """Lines of at most 100 columns, no tabs, no spaces at the end, a newline at the end."""
    allowed = reviewed("columns")
    for name in c_files() + files("*.py", "*.sh"):
        source = text(name)
        if name in allowed:
            continue
        if source and not source.endswith("\n"):
            yield "%s does not end with a newline" % name
        for number, line in enumerate(source.splitlines(), 1):
            if len(line) > COLUMNS_MAX and not name.endswith((".sh", ".py")):
                yield "%s:%d has %d columns" % (name, number, len(line))
            if line != line.rstrip():
                yield "%s:%d ends with spaces" % (name, number)
            if "\t" in line:
                yield "%s:%d holds a tab" % (name, number)


def rule_places():
    """No path of a developer's machine in any file."""
    pattern = re.compile(r"/(?:home|root|work|Users)/[A-Za-z0-9]")
    for name in c_files() + files("*.py", "*.sh", "*.md", "run") + ["Makefile", "README.md"]:
        if (ROOT / name).exists() and name != "tests/style/check.py":
            for number, line in enumerate(text(name).splitlines(), 1):
                if pattern.search(line):
                    yield "%s:%d names a place of one machine: %s" % (name, number, line.strip())


def run(command):
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True)
    return done.returncode, (done.stdout + done.stderr).strip()


def in_parallel(names, command_of):
    """Runs a command per name; yields (name, output) of those that fail."""
    with concurrent.futures.ThreadPoolExecutor(os.cpu_count() or 2) as pool:
        for name, (code, output) in zip(names, pool.map(lambda n: run(command_of(n)), names)):
            if code:
                yield name, output


def library_flags():
    code, output = run(["pkg-config", "--cflags", "libmicrohttpd", "libuv", "libcjson", "libcurl",
                        "nettle", "libxxhash"])
    return output.split() if code == 0 else []


def rule_headers_compile_alone():
    """Every header can be the only one."""
    flags = library_flags()
    headers = files("*.h")
    command = lambda name: ["gcc", "-std=c17", "-D_GNU_SOURCE", "-I.", *flags, "-Wall", "-Wextra",
                            "-Werror", "-fsyntax-only", "-x", "c", "-include", name, "/dev/null"]
    for name, output in in_parallel(headers, command):
        yield "%s does not compile alone: %s" % (name, output.splitlines()[0] if output else "")


def rule_format():
    """clang-format has nothing to change."""
    for name, output in in_parallel(c_files(), lambda n: ["clang-format", "--dry-run", "-Werror", n]):
        yield "%s: run clang-format -i on it (%s)" % (name, output.splitlines()[0] if output else "")


def rule_shell():
    """Shell scripts parse, stop at errors and can be started."""
    for name in files("*.sh") + [".ci/run"]:
        code, output = run(["bash", "-n", name])
        if code:
            yield "%s: %s" % (name, output)
        if not re.search(r"^set -(e|u|eu|euo|uo)", text(name), re.M):
            yield "%s has no set -euo pipefail" % name
        if not os.access(ROOT / name, os.X_OK):
            yield "%s is not executable" % name


def rule_python():
    """Python files parse."""
    for name in files("*.py") + ["tests/run"]:
        try:
            compile(text(name), name, "exec")
        except SyntaxError as error:
            yield "%s:%s: %s" % (name, error.lineno, error.msg)


def main():
    failed = passed = 0
    for name, rule in sorted(globals().items()):
        if not name.startswith("rule_"):
            continue
        broken = list(rule())
        for sentence in broken[:20]:
            print("  %s: %s" % (name[5:], sentence))
        if len(broken) > 20:
            print("  %s: ... and %d more" % (name[5:], len(broken) - 20))
        failed += bool(broken)
        passed += not broken
    print("%d passed, %d failed" % (passed, failed))
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
