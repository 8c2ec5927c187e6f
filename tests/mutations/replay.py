#!/usr/bin/env python3
"""Replay of seeded bugs: those that the suite catches, and those that survive

usage: ./dev mutate [--check] [--resume] [FILTER]

Every bug of tests/mutations/bugs.txt is put into a copy of the sources under build/mutate, the tests
it names are rebuilt and run, and the copy is restored. Nothing outside build/mutate is touched.

  FILTER       only bugs whose name contains it
  --check      only look whether every pattern still applies
  --resume     take over results of an earlier run for bugs whose text is unchanged

Exit status: 0 if all could be tried, 1 if some no longer apply or do not build, 2 if the suite
fails without any bug. Bugs that survive are printed; they are findings, not failures.

Environment: MUTATE_PREFIX is put in front of every command that builds or tests (nice, a queue),
MUTATE_CMAKE are further arguments of CMake (a compiler cache).
"""

import argparse
import collections
import os
import pathlib
import shlex
import shutil
import subprocess
import sys
import time

ROOT = pathlib.Path(__file__).resolve().parents[2]
LIST = ROOT / "tests" / "mutations" / "bugs.txt"
WORK = ROOT / "build" / "mutate"
SOURCE = WORK / "source"
BUILD = SOURCE / "build" / "mutate"
RESULTS = WORK / "results.tsv"
FOLDERS = ("include", "src", "ports")  # where a bug may sit
TIMEOUT_S = 1800
DOES_NOT_BUILD = 99

CAUGHT, SURVIVED, STALE, BROKEN = "caught", "SURVIVED", "DOES NOT APPLY", "DOES NOT BUILD"

Bug = collections.namedtuple("Bug", "name file old new tests")


def read_list(path):
    """Blocks of `key: value` lines, separated by blank lines; see docs/testing.md."""
    bugs, entry = [], {}
    for number, line in enumerate(path.read_text().splitlines() + [""], start=1):
        if line.startswith("#"):
            continue
        if not line.strip():
            if entry:
                missing = {"bug", "file", "old", "new", "tests"} - entry.keys()
                if missing:
                    sys.exit(f"{path}:{number}: a bug lacks {', '.join(sorted(missing))}")
                tests = tuple(t.strip() for t in entry["tests"].split(","))
                bugs.append(Bug(entry["bug"], entry["file"], entry["old"],
                                entry["new"], tests))
            entry = {}
            continue
        key, colon, value = line.partition(":")
        if not colon or key in entry:
            sys.exit(f"{path}:{number}: expected one of bug, file, old, new, tests")
        # Exactly one blank separates a key from its value: code keeps its own.
        value = value[1:] if value.startswith(" ") else value
        entry[key] = value.replace("\\n", "\n") if key in ("old", "new") else value
    return bugs


def tracked_files():
    listed = subprocess.run(["git", "ls-files", "-co", "--exclude-standard", "-z"], cwd=ROOT,
                            check=True, stdout=subprocess.PIPE).stdout.decode()
    return [name for name in listed.split("\0") if name and (ROOT / name).is_file()]


def find_match(bug, files):
    """The one file of that name (folders move) that holds the old text once, or why there is none."""
    matches = []
    for name in files:
        if not name.startswith(FOLDERS) or not ("/" + name).endswith("/" + bug.file):
            continue
        matches += [name] * (ROOT / name).read_text().count(bug.old)
    if len(matches) == 1:
        return matches[0], ""
    return None, "not found" if not matches else f"found {len(matches)} times"


def copy_sources(files):
    """Brings the copy up to date; what is unchanged keeps its time, so that little is rebuilt."""
    wanted = set(files)
    for path in list(SOURCE.rglob("*")) if SOURCE.exists() else []:
        name = str(path.relative_to(SOURCE))
        if path.is_file() and name not in wanted and not name.startswith("build/"):
            path.unlink()
    for name in files:
        source, target = ROOT / name, SOURCE / name
        if target.exists() and target.read_bytes() == source.read_bytes():
            continue
        target.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy(source, target)


def run(command, log):
    """Exit status of a shell command, -1 if it takes too long; its output goes to a log file."""
    prefix = shlex.split(os.environ.get("MUTATE_PREFIX", ""))
    with open(log, "wb") as output:
        process = subprocess.Popen(prefix + ["bash", "-c", command], stdout=output,
                                   stderr=subprocess.STDOUT, start_new_session=True)
        try:
            return process.wait(TIMEOUT_S)
        except subprocess.TimeoutExpired:
            os.killpg(process.pid, 9)
            process.wait()
            return -1


def command_for(tests):
    """`merge [acceptance]`: the executable test_merge, and which of its cases.
    `ctest lcm_link_program late_listener`: a target, and tests that ctest runs with it."""
    targets = sorted({test.split()[1] if test.startswith("ctest ") else "test_" + test.split()[0]
                      for test in tests})
    build = f"cmake --build {shlex.quote(str(BUILD))} --target {' '.join(targets)}"
    steps = [f"({build}) || exit {DOES_NOT_BUILD}", f"cd {shlex.quote(str(BUILD))}"]
    for test in tests:
        if test.startswith("ctest "):
            regex = shlex.quote(test.split(maxsplit=2)[2])
            steps.append(f"ctest -R {regex} --no-tests=error --timeout 300 || exit 1")
            continue
        room, _, cases = test.partition(" ")
        filters = shlex.quote(cases or "~[slow]~[.]")  # what ./dev test runs
        # Not itself: a bug may make a test wait for ever.
        steps.append(f"timeout 300 bin/test_{room} --abort {filters} || exit 1")
    return "; ".join(steps)


def configure():
    command = ["cmake", "-S", SOURCE, "-B", BUILD, "-G", "Ninja", "-Wno-dev",
               "-DCMAKE_BUILD_TYPE=RelWithDebInfo", "-DCMAKE_CXX_FLAGS_RELWITHDEBINFO=-O1 -DNDEBUG",
               "-DUNIMAPPER_CALL_GRAPH=OFF", "-DCMAKE_UNITY_BUILD=ON",
               "-DCMAKE_UNITY_BUILD_BATCH_SIZE=8"] + shlex.split(os.environ.get("MUTATE_CMAKE", ""))
    done = subprocess.run(command, stdout=subprocess.PIPE, stderr=subprocess.STDOUT)
    if done.returncode != 0:
        sys.exit(done.stdout.decode())


def try_bug(bug, files):
    name, why = find_match(bug, files)
    if name is None:
        return STALE, why
    target = SOURCE / name
    original = target.read_text()
    if original.count(bug.old) != 1:
        return STALE, "the sources changed while bugs were replayed"
    target.write_text(original.replace(bug.old, bug.new))
    try:
        status = run(command_for(bug.tests), WORK / "last.log")
    finally:
        target.write_text(original)
    if status == DOES_NOT_BUILD:
        shutil.copy(WORK / "last.log", WORK / "does-not-build.log")
        return BROKEN, "see build/mutate/does-not-build.log"
    return (SURVIVED if status == 0 else CAUGHT), ""


def read_results(bugs):
    known = {key(bug): None for bug in bugs}
    if RESULTS.exists():
        for line in RESULTS.read_text().splitlines():
            text, _, result = line.rpartition("\t")
            if text in known and result in (CAUGHT, SURVIVED):
                known[text] = result
    return known


def key(bug):
    return "\t".join((bug.name, bug.file, bug.old, bug.new)).replace("\n", "\\n")


def summary(results):
    """Caught of all, and the survivors."""
    survivors = [bug.name for bug, result in results.items() if result == SURVIVED]
    caught = sum(result == CAUGHT for result in results.values())
    return f"{caught} of {len(results)} caught; survivors: {', '.join(survivors) or 'none'}"


def main():
    parser = argparse.ArgumentParser(prog="./dev mutate", usage=__doc__.split("usage: ")[1])
    parser.add_argument("filter", nargs="?", default="")
    parser.add_argument("--check", action="store_true")
    parser.add_argument("--resume", action="store_true")
    options = parser.parse_args()

    every = read_list(LIST)
    names = collections.Counter(bug.name for bug in every)
    twice = [name for name, count in names.items() if count > 1]
    if twice:
        sys.exit(f"bugs of the same name: {', '.join(twice)}")
    bugs = [bug for bug in every if options.filter in bug.name]
    if not bugs:
        sys.exit("no bug of that name")

    files = tracked_files()
    stale = [(bug, find_match(bug, files)[1]) for bug in bugs if not find_match(bug, files)[0]]
    if options.check:
        for bug, why in stale:
            print(f"{bug.name}: {why} in {bug.file}: {bug.old}")
        print(f"{len(bugs) - len(stale)} of {len(bugs)} bugs apply")
        return 1 if stale else 0

    WORK.mkdir(parents=True, exist_ok=True)
    copy_sources(files)
    configure()
    known = read_results(every)
    results = {}
    todo = []
    for bug in bugs:
        if options.resume and known[key(bug)]:
            results[bug] = known[key(bug)]
        else:
            todo.append(bug)
    needed = sorted({test for bug in todo for test in bug.tests})
    if needed:
        print(f"without a bug: {', '.join(needed)}", flush=True)
        for test in needed:
            if run(command_for([test]), WORK / "last.log") != 0:
                print(f"the suite fails without any bug: {test}, see build/mutate/last.log")
                return 2
    for bug in todo:
        began = time.monotonic()
        results[bug], why = try_bug(bug, files)
        known[key(bug)] = results[bug]
        RESULTS.write_text("".join(f"{text}\t{result}\n" for text, result in known.items()
                                   if result))
        print(f"{results[bug]:14} {bug.name} ({time.monotonic() - began:.0f} s) {why}".rstrip(),
              flush=True)

    print(summary(results))
    failed = [bug for bug, result in results.items() if result in (STALE, BROKEN)]
    for bug in failed:
        print(f"{results[bug]}: {bug.name}: {bug.file}: {bug.old}")
    return 1 if failed else 0


if __name__ == "__main__":
    sys.exit(main())
