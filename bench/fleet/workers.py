#!/usr/bin/env python3
"""Cells of a row of workers.sh.

  workers.py UNIMAPPER OUT RUNS "WORKERS[, one killed]"
"""
import json
import os
import re
import shutil
import signal
import socket
import subprocess
import sys
import time

from processes import contents, empty

TOOL, OUT, RUNS, WORKERS = sys.argv[1:]
COUNT = int(WORKERS.split(",")[0])
KILLS = "killed" in WORKERS
STORE = f"{OUT}/store"


def quietly(*words):
    subprocess.run([TOOL, *words], check=True, stdout=subprocess.DEVNULL, stderr=subprocess.DEVNULL)


def spent_s(child):
    _, _, usage = os.wait4(child.pid, 0)
    child.returncode = 0
    return usage.ru_utime + usage.ru_stime


shutil.rmtree(STORE, ignore_errors=True)
empty(f"{OUT}/stream")
quietly("map", "create", "--store", STORE)
quietly("map", "add", "--store", STORE, *(f"{OUT}/runs/{RUNS}_{route}" for route in "ABC"))
with socket.socket() as free:
    free.bind(("127.0.0.1", 0))
    port = free.getsockname()[1]
url = f"nats://127.0.0.1:{port}"
log = open(f"{OUT}/log", "w")
server = subprocess.Popen(["nats-server", "-js", "-sd", f"{OUT}/stream", "-a", "127.0.0.1", "-p",
                           str(port)], stdout=log, stderr=log)
try:
    time.sleep(1)
    workers = [subprocess.Popen([TOOL, "worker", "--nats", url, "--threads", "1"], stdout=log,
                                stderr=log) for _ in range(COUNT)]
    time.sleep(1)
    merge = subprocess.Popen([TOOL, "map", "merge", "--store", STORE, "--threads", "1",
                              "--workers", url], stdout=log, stderr=subprocess.PIPE, text=True)
    said = ""
    killed_s = 0.0
    for line in merge.stderr:
        said += line
        if KILLS and "inter-session loops" in line:
            time.sleep(2)
            workers[0].kill()
            killed_s = spent_s(workers.pop(0))
    merge_s = spent_s(merge)
    for worker in workers:
        worker.send_signal(signal.SIGINT)
    workers_s = killed_s + sum(spent_s(worker) for worker in workers)
finally:
    server.send_signal(signal.SIGINT)
    server.wait()
folder = f"{OUT}/map_{COUNT}"
quietly("map", "export", "--store", STORE, "--out", folder, "--replace")
if COUNT == 0:
    with open(f"{OUT}/alone.json", "w") as file:
        json.dump(merge_s, file)
with open(f"{OUT}/alone.json") as file:
    alone_s = json.load(file)
same = contents(folder) == contents(f"{OUT}/map_0")
loops = sum(int(n) for n in re.findall(r"(\d+) loops by", said))
each = f"{loops / workers_s:.1f}" if COUNT > 0 else "–"
print(f"{loops} | {merge_s:.1f} | {workers_s:.1f} | {each} | "
      f"{100 * ((merge_s + workers_s) / alone_s - 1):+.0f} % | {'yes' if same else 'NO'}")
sys.exit(0 if same else 1)
