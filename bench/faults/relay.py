#!/usr/bin/env python3
"""Relay between the robots' multicast group and the base's, with seeded faults in each direction.

  relay.py ROBOTS BASE SEED TO_BASE TO_ROBOTS    groups as GROUP:PORT; until it is ended

Faults are such as drop=0.05,delay=10,down=4+45: the shares drop, fragments (of Ethernet), duplicate
(the second up to 20 ms later), reorder (held for `hold` ms) and flip (of one bit); delay and hold, ms;
down, seconds FROM+FOR after the first datagram; rate, bytes per second that pass, and queue, the bytes
that may wait for it.
"""
import heapq
import itertools
import random
import select
import socket
import sys
import time

SHARES = ("drop", "fragments", "duplicate", "reorder", "flip")
NONE = {**dict.fromkeys(SHARES, [0.0]), "delay": [0.0], "hold": [30.0], "down": [0.0, 0.0],
        "rate": [0.0], "queue": [16000.0]}
FRAGMENT_BYTES = 1480
UDP_HEADER_BYTES = 8
HEADER_BYTES = 28  # of IP and UDP
COPY_DELAY_S = 0.02
RECEIVE_BUFFER_BYTES = 32 << 20
SO_RCVBUFFORCE = 33
MOST_DRAINED = 64


def parse_faults(text):
    """Values by name. Raises ValueError."""
    faults = dict(NONE)
    for one in text.split(",") if text else []:
        name, _, value = one.partition("=")
        if name not in faults:
            raise ValueError(f'{text}: unknown fault "{name}"')
        faults[name] = [float(number) for number in value.split("+")]
        largest = 1.0 if name in SHARES else sys.float_info.max
        if (len(faults[name]) != len(NONE[name]) or
                not all(0.0 <= number <= largest for number in faults[name])):
            raise ValueError(f"{text}: {name} cannot be {value}")
    return {name: values if name == "down" else values[0] for name, values in faults.items()}


def fragments_of(size):
    """Ethernet fragments of a UDP datagram with so many bytes of content."""
    return -(-(size + UDP_HEADER_BYTES) // FRAGMENT_BYTES)


class Direction:
    """Fates of a direction's datagrams. A datagram's draws follow from the seed and its number alone."""

    def __init__(self, faults, seed):
        self.faults, self.seed = parse_faults(faults), seed
        self.number = 0
        self.free_at_s = 0.0  # when the bottleneck has sent all that waits

    def fate(self, size, now_s):
        """Seconds until each copy goes on (none: lost), and the bit that is flipped or None."""
        draw = random.Random(self.seed << 32 | self.number)
        self.number += 1
        # Every datagram draws the same numbers, so that one fault does not shift the others.
        drop, fragment, duplicate, reorder, flip, copy = (draw.random() for _ in range(6))
        bit = draw.randrange(8 * max(size, 1))
        faults = self.faults
        down_s, down_for_s = faults["down"]
        all_fragments_arrive = (1.0 - faults["fragments"]) ** fragments_of(size)
        if (down_s <= now_s < down_s + down_for_s or drop < faults["drop"] or
                fragment >= all_fragments_arrive):
            return [], None
        held_ms = faults["hold"] if reorder < faults["reorder"] else 0.0
        delay_s = self.through_bottleneck(size, now_s)
        if delay_s is None:
            return [], None
        delay_s += (faults["delay"] + held_ms) / 1000
        copies = [delay_s]
        if duplicate < faults["duplicate"]:
            copies.append(delay_s + COPY_DELAY_S * copy)
        return copies, bit if flip < faults["flip"] else None

    def through_bottleneck(self, size, now_s):
        """Seconds until the datagram is through; None if the queue has no room."""
        rate = self.faults["rate"]
        if rate == 0.0:
            return 0.0
        waiting_s = max(0.0, self.free_at_s - now_s)
        size += HEADER_BYTES
        if waiting_s > 0.0 and waiting_s * rate + size > self.faults["queue"]:
            return None
        self.free_at_s = now_s + waiting_s + size / rate
        return self.free_at_s - now_s


class End:
    """One end of a relay: hears a group on this machine and sends to it, but does not hear itself."""

    def __init__(self, address):
        group, port = address.split(":")
        self.group = group, int(port)
        self.listening = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.listening.setblocking(False)
        self.listening.setsockopt(socket.SOL_SOCKET, socket.SO_REUSEADDR, 1)
        # The relay must not lose what it was not told to lose.
        try:
            self.listening.setsockopt(socket.SOL_SOCKET, SO_RCVBUFFORCE, RECEIVE_BUFFER_BYTES)
        except PermissionError:
            self.listening.setsockopt(socket.SOL_SOCKET, socket.SO_RCVBUF, RECEIVE_BUFFER_BYTES)
        self.listening.bind(("", self.group[1]))
        self.listening.setsockopt(socket.IPPROTO_IP, socket.IP_ADD_MEMBERSHIP,
                                  socket.inet_aton(group) + bytes(4))
        self.sending = socket.socket(socket.AF_INET, socket.SOCK_DGRAM)
        self.sending.setsockopt(socket.IPPROTO_IP, socket.IP_MULTICAST_TTL, 0)
        self.sending.bind(("", 0))

    def waiting(self):
        """Datagrams that wait."""
        own_port = self.sending.getsockname()[1]
        while True:
            try:
                datagram, source = self.listening.recvfrom(65536)
            except BlockingIOError:
                return
            if source[1] != own_port:
                yield datagram

    def send(self, datagram):
        self.sending.sendto(datagram, self.group)


def flipped(datagram, bit):
    changed = bytearray(datagram)
    changed[bit // 8] ^= 1 << bit % 8
    return bytes(changed)


def main():
    robots, base = End(sys.argv[1]), End(sys.argv[2])
    seed = int(sys.argv[3])
    directions = [(robots, base, Direction(sys.argv[4], seed)),
                  (base, robots, Direction(sys.argv[5], seed + 1))]
    held, count, start_s = [], 0, None
    print("relaying", flush=True)
    while True:
        patience_s = max(0.0, held[0][0] - time.monotonic()) if held else None
        select.select([robots.listening, base.listening], [], [], patience_s)
        for source, target, direction in directions:
            for datagram in itertools.islice(source.waiting(), MOST_DRAINED):
                now_s = time.monotonic()
                start_s = start_s or now_s
                copies, bit = direction.fate(len(datagram), now_s - start_s)
                if bit is not None:
                    datagram = flipped(datagram, bit)
                for delay_s in copies:
                    count += 1
                    heapq.heappush(held, (now_s + delay_s, count, target, datagram))
        while held and held[0][0] <= time.monotonic():
            _, _, target, datagram = heapq.heappop(held)
            target.send(datagram)


if __name__ == "__main__":
    main()
