#!/usr/bin/env python3
"""Processes of show.sh, and what became of them as tables.

  show.py BIN OUT SCANS SERVERS
"""
import json
import re
import shutil
import subprocess
import sys
import time
import urllib.request

from processes import Fleet, contents, lcm_url

BIN, OUT = sys.argv[1:3]
SCANS, SERVERS = map(int, sys.argv[3:])
SITES, WORKERS = 3, 2
SENSORS, ROUTES = ("vlp-16", "livox-avia", "vlp-16"), "ABC"
BEGIN = time.monotonic()


def say(text):
    print(f"==> [{time.monotonic() - BEGIN:3.0f} s] {text}", flush=True)


def table(rows):
    widths = [max(len(str(cell)) for cell in column) for column in zip(*rows)]
    for number, row in enumerate(rows):
        print("  " + "  ".join(str(cell).rjust(width) if number and index else str(cell).ljust(width)
                               for index, (cell, width) in enumerate(zip(row, widths))))
    print(flush=True)


def tool(fleet, *words):
    done = subprocess.run([fleet.tool, *words], capture_output=True, text=True)
    if done.returncode != 0:
        raise RuntimeError(f"unimapper {' '.join(words)}: {done.stderr.strip()}")
    return done.stdout


def simulate(fleet):
    makers = [subprocess.Popen([fleet.tool, "simulate", "--scene", "town", "--sensor", SENSORS[site],
                                "--route", ROUTES[site], "--scans", str(SCANS), "--seed", "7", "--out",
                                f"{OUT}/data/robot-{site}"], stdout=subprocess.DEVNULL,
                               stderr=subprocess.DEVNULL) for site in range(SITES)]
    if any([maker.wait() for maker in makers]):
        raise RuntimeError("a recording could not be simulated")


def metrics(fleet, name):
    """Counters of a base or a worker by their names, labels left out."""
    line = fleet.await_text(name, "http://")
    url = re.search(r"http://[0-9.:]+/", line).group(0) + "metrics"
    with urllib.request.urlopen(url, timeout=10) as answer:
        text = answer.read().decode()
    return dict(re.findall(r"^unimapper_(\w+) ([0-9.e+-]+)$", text, re.M))


def drive(fleet):
    """Robots send to their sites, and these to the centre, until all is there."""
    http = ("--http", "127.0.0.1:0")
    fleet.start_servers()
    fleet.start_centre(*http)
    for site in range(SITES):
        fleet.start_site(site, fleet.url, *http)
    for site in range(SITES):
        fleet.start(f"robot-{site}", [fleet.tool, "onboard", f"{OUT}/data/robot-{site}", "--out",
                                      f"{OUT}/runs/robot-{site}", "--publish", lcm_url(site)])
    for site in range(SITES):
        if fleet.wait(f"robot-{site}") != 0:
            raise RuntimeError(f"robot-{site} has failed: {OUT}/robot-{site}.log")
    drained_s = fleet.drain(SITES, 120)
    time.sleep(1.5)  # counters are told once a second
    say(f"the centre had everything {drained_s:.1f} s after the last robot arrived")
    print(tool(fleet, "fleet", "status", "--nats", fleet.url))
    columns = {"stored": "keyframes_stored_total", "missing": "keyframes_missing",
               "damaged": "keyframes_damaged_total", "refused": "refused_total",
               "waiting for the stream": "uplink_waiting", "longest commit, s": "commit_seconds_max"}
    rows = [["/metrics of", *columns]]
    for name in [f"site-{site}" for site in range(SITES)] + ["centre"]:
        found = metrics(fleet, name)
        rows.append([name] + [found.get(key, "-")[:6] for key in columns.values()])
    table(rows)


def merge(fleet):
    """The centre's map, with workers and without: whether both are the same, and its sessions."""
    shutil.copytree(f"{OUT}/centre", f"{OUT}/alone")
    for worker in range(WORKERS):
        fleet.start(f"worker-{worker}", [fleet.tool, "worker", "--nats", fleet.url, "--threads", "1",
                                         "--http", "127.0.0.1:0"])
        fleet.await_text(f"worker-{worker}", "waits for jobs")
    tool(fleet, "map", "merge", "--store", f"{OUT}/centre", "--workers", fleet.url)
    rows = [["/metrics of", "jobs", "loops", "keyframes fetched"]]
    for worker in range(WORKERS):
        found = metrics(fleet, f"worker-{worker}")
        rows.append([f"worker-{worker}"] + [found[f"worker_{key}_total"] for key in ("jobs", "loops", "keyframes")])
    table(rows)
    say("merging once more without workers")
    tool(fleet, "map", "merge", "--store", f"{OUT}/alone")
    for store, folder in ("centre", "map"), ("alone", "map_alone"):
        tool(fleet, "map", "export", "--store", f"{OUT}/{store}", "--out", f"{OUT}/{folder}")
    return contents(f"{OUT}/map") == contents(f"{OUT}/map_alone")


def states(fleet):
    """What became of each session in the map."""
    project = json.loads(tool(fleet, "map", "show", "--store", f"{OUT}/centre", "--json"))
    return [(session["name"], session["state"]) for session in project["sessions"]]


def main():
    fleet = Fleet(BIN, OUT, SERVERS)
    say(f"simulating {SITES} robots, {SCANS} scans each")
    simulate(fleet)
    say(f"{SERVERS} server{'s' if SERVERS > 1 else ''}, {SITES} sites with a robot each, a centre")
    drive(fleet)
    for name in ["centre"] + [f"site-{site}" for site in range(SITES)]:
        fleet.end(name)
    sent, lost, twice = fleet.compare(SITES)
    say(f"merging at the centre with {WORKERS} workers")
    is_same = merge(fleet)
    sessions = states(fleet)
    fleet.end_all()
    rows = [["part", "processor time, s", "ms a keyframe"]]
    rows += [[part, f"{spent:.1f}", f"{1000 * spent / sent:.1f}"] for part, spent in fleet.spent_s.items()]
    table(rows)
    table([["keyframes", "lost", "twice", "map with and without workers"],
           [sent, lost, twice, "the same" if is_same else "DIFFERENT"]])
    table([["session", "in the map"], *sessions])
    say(f"one map: {OUT}/map/report.html")
    is_one = all(state in ("central", "merged") for _, state in sessions)
    return 0 if is_one and is_same and not lost and not twice else 1


sys.exit(main())
