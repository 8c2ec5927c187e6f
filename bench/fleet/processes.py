"""Processes of a fleet on this machine, for the scripts beside it: servers, bases, workers, robots.

All end with the script that starts them. Ports are those of a network namespace of its own.
"""
import ctypes
import json
import os
import shutil
import signal
import socket
import sqlite3
import subprocess
import threading
import time

FIRST_PORT = 4222
LEAF_PORT = 4250
ROUTE_OFFSET, LEAF_OFFSET, RELAY_OFFSET = 2000, 3000, 3100


def die_with_parent():
    ctypes.CDLL(None).prctl(1, signal.SIGKILL)


class Relay:
    """TCP link to a port that can be cut: what is on the way then waits, as packets that are lost do."""

    def __init__(self, port, target):
        self.target = target
        self.is_open = threading.Event()
        self.is_open.set()
        self.listener = socket.create_server(("127.0.0.1", port))
        threading.Thread(target=self.accept, daemon=True).start()

    def accept(self):
        while True:
            near, _ = self.listener.accept()
            try:
                far = socket.create_connection(("127.0.0.1", self.target))
            except OSError:
                near.close()
                continue
            for a, b in (near, far), (far, near):
                threading.Thread(target=self.pump, args=(a, b), daemon=True).start()

    def pump(self, source, sink):
        try:
            while True:
                data = source.recv(1 << 18)
                self.is_open.wait()
                if not data:
                    break
                sink.sendall(data)
        except OSError:
            pass
        for end in source, sink:
            try:
                end.shutdown(socket.SHUT_RDWR)
            except OSError:
                pass


class Fleet:
    """One server or a cluster, with a leaf node behind a link if wanted, and whoever uses them."""

    def __init__(self, binaries, out, servers=1, has_leaf=False):
        self.tool = f"{binaries}/unimapper"
        self.binaries, self.out, self.servers = binaries, out, servers
        self.processes, self.spent_s, self.commands = {}, {}, {}
        self.relays = []
        for i in range(servers):
            self.commands[f"server-{i}"] = ["nats-server", "-c", self.server_config(i)]
            if has_leaf:
                port = FIRST_PORT + i
                self.relays.append(Relay(port + RELAY_OFFSET, port + LEAF_OFFSET))
        if has_leaf:
            self.commands["leaf"] = ["nats-server", "-c", self.leaf_config()]

    def write(self, name, text):
        path = f"{self.out}/{name}"
        with open(path, "w") as file:
            file.write(text)
        return path

    def server_config(self, i):
        port = FIRST_PORT + i
        routes = [f"nats://127.0.0.1:{FIRST_PORT + n + ROUTE_OFFSET}" for n in range(self.servers)]
        cluster = (f"cluster {{ name: fleet, listen: 127.0.0.1:{port + ROUTE_OFFSET}, "
                   f"routes: {json.dumps(routes)} }}\n") if self.servers > 1 else ""
        return self.write(f"server-{i}.conf", f"""server_name: server-{i}
listen: 127.0.0.1:{port}
max_payload: 5MB
jetstream {{ store_dir: "{os.path.abspath(self.out)}/stream-{i}", max_file_store: 20GB }}
leafnodes {{ listen: 127.0.0.1:{port + LEAF_OFFSET} }}
ping_interval: "5s"
{cluster}""")

    def leaf_config(self):
        ports = [FIRST_PORT + i + RELAY_OFFSET for i in range(self.servers)]
        urls = json.dumps([f"nats-leaf://127.0.0.1:{port}" for port in ports])
        return self.write("leaf.conf", f"""server_name: leaf
listen: 127.0.0.1:{LEAF_PORT}
max_payload: 5MB
ping_interval: "5s"
leafnodes {{ remotes: [ {{ urls: {urls} }} ] }}
""")

    @property
    def url(self):
        return ",".join(f"nats://127.0.0.1:{FIRST_PORT + i}" for i in range(self.servers))

    @property
    def leaf_url(self):
        return f"nats://127.0.0.1:{LEAF_PORT}"

    def cut_link(self):
        for relay in self.relays:
            relay.is_open.clear()

    def mend_link(self):
        for relay in self.relays:
            relay.is_open.set()

    def start(self, name, command=None, **files):
        """Starts a part for the first time with its command, or once more."""
        if command is not None:
            self.commands[name] = command
        with open(f"{self.out}/{name}.log", "a") as log:
            self.processes[name] = subprocess.Popen(
                self.commands[name], stdin=subprocess.DEVNULL, stdout=log, stderr=log,
                preexec_fn=die_with_parent)

    def end(self, name, number=signal.SIGTERM):
        """Ends one by its number, counts its processor time, and returns its result."""
        self.processes[name].send_signal(number)
        return self.wait(name)

    def wait(self, name, seconds=None):
        child = self.processes[name]
        end = time.monotonic() + (seconds or 1e9)
        while True:
            pid, status, usage = os.wait4(child.pid, os.WNOHANG if seconds else 0)
            if pid:
                break
            if time.monotonic() > end:
                raise RuntimeError(f"{name} does not end")
            time.sleep(0.05)
        child.returncode = os.waitstatus_to_exitcode(status)
        del self.processes[name]
        part = name.split("-")[0]
        self.spent_s[part] = self.spent_s.get(part, 0.0) + usage.ru_utime + usage.ru_stime
        return child.returncode

    def end_all(self):
        """Whoever sends first, servers last."""
        def rank(name):
            return ["robot", "site", "centre", "worker", "leaf", "server"].index(name.split("-")[0])
        for name in sorted(self.processes, key=rank):
            self.end(name, signal.SIGKILL if rank(name) > 3 else signal.SIGTERM)

    def await_text(self, name, text, seconds=30):
        """Returns the first line of a part's log that has the text."""
        end = time.monotonic() + seconds
        while time.monotonic() < end:
            with open(f"{self.out}/{name}.log") as log:
                for line in log:
                    if text in line:
                        return line.strip()
            if self.processes[name].poll() is not None:
                break
            time.sleep(0.05)
        raise RuntimeError(f"{self.out}/{name}.log never said \"{text}\"")

    def start_servers(self):
        for name in list(self.commands):
            self.start(name)
        for name in list(self.commands):
            self.await_text(name, "Server is ready")

    def start_centre(self, *more):
        self.start("centre", [self.tool, "base", "--store", f"{self.out}/centre", "--from", self.url, *more])
        self.await_text("centre", "taking keyframes from", 60)

    def start_site(self, site, url, *more):
        self.start(f"site-{site}", [self.tool, "base", "--store", f"{self.out}/site-{site}", "--listen",
                                    lcm_url(site), "--uplink", url, "--site", f"site-{site}", *more])
        self.await_text(f"site-{site}", "listening on")

    def keyframes(self, store):
        """Every keyframe of a store with its checksum."""
        with sqlite3.connect(f"file:{self.out}/{store}/store.sqlite?mode=ro", uri=True) as database:
            return database.execute("SELECT hex(identity), sequence, crc32 FROM keyframes "
                                    "JOIN sessions ON id = session").fetchall()

    def count(self, store):
        with sqlite3.connect(f"file:{self.out}/{store}/store.sqlite?mode=ro", uri=True) as database:
            return database.execute("SELECT COALESCE(SUM(keyframes), 0) FROM sessions").fetchone()[0]

    def drain(self, sites, seconds):
        """Waits until the centre has what the sites have; returns how long that took."""
        begin = time.monotonic()
        while self.count("centre") < sum(self.count(f"site-{site}") for site in range(sites)):
            if time.monotonic() > begin + seconds:
                break
            time.sleep(0.1)
        return time.monotonic() - begin

    def compare(self, sites):
        """Keyframes of all sites, those of them that the centre lacks, and those it has twice."""
        sent = [row for site in range(sites) for row in self.keyframes(f"site-{site}")]
        taken = self.keyframes("centre")
        twice = len(taken) - len({row[:2] for row in taken})
        return len(sent), len(set(sent) - set(taken)), twice


def lcm_url(site):
    return f"udpm://239.255.76.67:{7667 + site}?ttl=0"


def empty(folder):
    shutil.rmtree(folder, ignore_errors=True)
    os.makedirs(folder)


OWN_FILES = ("report.html", "timing.json", "times.json")


def contents(folder):
    """All files of an exported map but those that tell of its own making."""
    files = {}
    for place, _, names in os.walk(folder):
        for name in set(names) - set(OWN_FILES):
            with open(f"{place}/{name}", "rb") as file:
                files[os.path.relpath(f"{place}/{name}", folder)] = file.read()
    return files
