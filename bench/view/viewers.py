#!/usr/bin/env python3
"""Viewers of a page: many clients that ask for what the page asks for.

  viewers.py HOST:PORT COUNT   until SIGTERM; then prints "ANSWERS FAILED EVENTS MEGABYTES", and why
                               requests failed

Each opens the page and the map, follows the events, asks for health every five seconds, for points of
every keyframe and of the coarsest nodes of each map, once for each address as a browser's cache does.
"""
import collections
import http.client
import json
import signal
import sys
import threading
import time

TIMEOUT_S = 20
HEALTH_PERIOD_S = 5
NODES = 40
NEWEST_KEYFRAMES = 30

reasons = collections.Counter()
stopping = threading.Event()


class Viewer(threading.Thread):
    def __init__(self, host, port):
        super().__init__(daemon=True)
        self.host, self.port = host, port
        self.answers = self.failed = self.events = self.bytes = 0
        self.cached = set()
        self.version = ""
        self.next_health = 0.0

    def connection(self):
        return http.client.HTTPConnection(self.host, self.port, timeout=TIMEOUT_S)

    def fail(self, reason):
        # A base that has ended listens no more; how it ended, whoever started it knows.
        if stopping.is_set() or reason == "ConnectionRefusedError":
            return
        self.failed += 1
        reasons[reason] += 1

    def get(self, path):
        """The body; None where there is none (404), which the page passes over, or where it failed."""
        try:
            connection = self.connection()
            connection.request("GET", path)
            answer = connection.getresponse()
            body = answer.read()
            connection.close()
        except (OSError, http.client.HTTPException) as error:
            self.fail(type(error).__name__)
            return None
        self.answers += 1
        self.bytes += len(body)
        if answer.status not in (200, 404):
            self.fail(answer.status)
        return body if answer.status == 200 else None

    def get_once(self, path):
        if path not in self.cached:
            self.cached.add(path)
            self.get(path)

    def load_map(self):
        body = self.get("/api/map")
        if body is None:
            return
        shown = json.loads(body)
        self.version = shown["version"]
        for name, layer in shown["layers"].items():
            for node in layer["nodes"][:NODES]:
                self.get_once(f"/api/tiles/{self.version}/{name}/{node[0]}")
        for number, session in enumerate(shown["sessions"]):
            made = len(session["poses"])
            for keyframe in range(max(0, made - NEWEST_KEYFRAMES), made):
                self.load_keyframe(number, keyframe)

    def load_keyframe(self, session, keyframe):
        # The page keeps what it has drawn, whatever the version.
        if (session, keyframe) not in self.cached:
            self.cached.add((session, keyframe))
            self.get(f"/api/keyframes/{self.version}/{session}/{keyframe}")

    def take(self, event, data):
        self.events += 1
        if event == "map":
            self.load_map()
        elif event == "keyframe":
            self.load_keyframe(data["session"], data["keyframe"])

    def follow(self):
        connection = self.connection()
        connection.request("GET", "/api/events")
        answer = connection.getresponse()
        event = ""
        for line in answer:
            if stopping.is_set():
                return
            if time.monotonic() > self.next_health:
                self.get("/api/health")
                self.next_health = time.monotonic() + HEALTH_PERIOD_S
            name, _, value = line.decode().strip().partition(": ")
            if name == "event":
                event = value
            elif name == "data":
                self.take(event, json.loads(value))

    def run(self):
        self.get("/")
        self.load_map()
        while not stopping.is_set():
            try:
                self.follow()
            except (OSError, http.client.HTTPException) as error:
                self.fail(type(error).__name__)
            stopping.wait(0.5)


def main():
    host, port = sys.argv[1].split(":")
    viewers = [Viewer(host, int(port)) for _ in range(int(sys.argv[2]))]
    signal.signal(signal.SIGTERM, lambda *_: stopping.set())
    for viewer in viewers:
        viewer.start()
    stopping.wait()
    totals = [sum(getattr(v, what) for v in viewers) for what in ("answers", "failed", "events", "bytes")]
    print(totals[0], totals[1], totals[2], f"{totals[3] / 1e6:.0f}", dict(reasons))


main()
