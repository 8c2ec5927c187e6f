#!/usr/bin/env python3
"""Tests of the relay's faults, and of what counts as lost, duplicated and caught up."""
import os
import sqlite3
import struct
import sys
import tempfile
import unittest
import zlib

sys.dont_write_bytecode = True
sys.path.insert(0, os.path.join(os.path.dirname(os.path.abspath(__file__)), "../../bench/faults"))
import outcome
import relay

DATAGRAMS = 20000


def fates(faults, size, now_s=1.0, seed=7, count=DATAGRAMS):
    direction = relay.Direction(faults, seed)
    return [direction.fate(size, now_s) for _ in range(count)]


def share(faults, size, holds):
    return sum(holds(*fate) for fate in fates(faults, size)) / DATAGRAMS


def is_lost(copies, bit):
    return not copies


class Relay(unittest.TestCase):
    def test_each_fault_befalls_the_share_of_datagrams_that_it_is_given(self):
        self.assertAlmostEqual(share("drop=0.3", 1000, is_lost), 0.3, delta=0.02)
        self.assertAlmostEqual(share("duplicate=0.5", 1000, lambda c, b: len(c) == 2), 0.5, delta=0.02)
        self.assertAlmostEqual(share("reorder=0.2", 1000, lambda c, b: c[0] == 0.03), 0.2, delta=0.02)
        self.assertAlmostEqual(share("flip=0.04", 1000, lambda c, b: b is not None), 0.04, delta=0.01)
        self.assertEqual(share("", 1000, lambda c, b: (c, b) != ([0.0], None)), 0.0)

    def test_a_datagram_is_lost_with_any_of_its_ethernet_fragments(self):
        self.assertEqual([relay.fragments_of(size) for size in (1472, 1473, 60000)], [1, 2, 41])
        self.assertAlmostEqual(share("fragments=0.05", 1300, is_lost), 0.05, delta=0.01)
        self.assertAlmostEqual(share("fragments=0.05", 60000, is_lost), 1 - 0.95**41, delta=0.02)

    def test_the_fate_of_a_datagram_follows_from_the_seed_and_its_number_alone(self):
        lost = [is_lost(*fate) for fate in fates("drop=0.5", 1000, 0.0, 3, 1000)]
        more = "drop=0.5,flip=0.5,duplicate=0.5,reorder=0.5"
        self.assertEqual(lost, [is_lost(*fate) for fate in fates(more, 50000, 9.0, 3, 1000)])
        other = [is_lost(*fate) for fate in fates("drop=0.5", 1000, 0.0, 4, 1000)]
        self.assertLess(sum(a == b for a, b in zip(lost, other)), 600)

    def test_a_direction_is_down_from_the_first_moment_of_its_interval_to_the_last(self):
        direction = relay.Direction("down=3+1.5", 1)
        lost = [is_lost(*direction.fate(100, now_s)) for now_s in (2.999, 3.0, 4.499, 4.5)]
        self.assertEqual(lost, [False, True, True, False])

    def test_a_bottleneck_lets_its_rate_pass_and_loses_what_its_queue_cannot_hold(self):
        direction = relay.Direction("rate=10000,queue=5500,delay=10", 1)
        # 972 bytes and the headers of IP and UDP take a tenth of a second.
        copies = [direction.fate(972, 1.0)[0] for _ in range(8)]
        self.assertEqual(copies[5:], [[], [], []])
        for i, [delay_s] in enumerate(copies[:5]):
            self.assertAlmostEqual(delay_s, 0.01 + 0.1 * (i + 1))
        # What waited is through; a datagram larger than the queue passes an idle link all the same.
        self.assertAlmostEqual(direction.fate(9972, 2.0)[0][0], 1.01)
        self.assertEqual(direction.fate(972, 2.5)[0], [])
        self.assertAlmostEqual(direction.fate(972, 3.0)[0][0], 0.11)

    def test_a_flipped_datagram_differs_in_one_bit(self):
        self.assertEqual(relay.flipped(b"\x00\xff", 9), b"\x00\xfd")

    def test_what_is_no_fault_is_refused(self):
        for text in ("drop", "drop=", "drop=1.1", "drop=-0.1", "drop=nan", "dorp=0.1", "down=3",
                     "down=3+x", "delay=1ms", "delay=1+2", ",", "drop=0.1;delay=1"):
            with self.subTest(text), self.assertRaises(ValueError):
                relay.parse_faults(text)


class Outcome(unittest.TestCase):
    def test_time_to_catch_up_counts_from_the_last_time_that_most_keyframes_waited(self):
        self.assertEqual(outcome.catch_up_s([(0.0, 0)]), 0.0)
        samples = [(0.0, 0), (1.0, 10), (2.0, 10), (2.5, 3)]
        self.assertIsNone(outcome.catch_up_s(samples))
        self.assertEqual(outcome.catch_up_s(samples + [(3.0, 2), (9.0, 0)]), 1.0)

    def test_keyframes_are_lost_duplicated_or_falsely_reported_by_their_bytes(self):
        first, second, other = (0, 80, 1), (1, 80, 2), (1, 80, 3)
        at_base = {first: 2, other: 1}
        robots = [([first, second], 2, [(0.0, 1), (1.5, 3), (2.0, 0)])]
        self.assertEqual(outcome.outcome(at_base, robots), (2, 1, 1, 1, 1, "0.5"))
        self.assertEqual(outcome.outcome(at_base, [([first], 1, [(0.0, 5)])])[5], "never")
        self.assertEqual(outcome.outcome(at_base, [([first], 1, [])])[5], "–")

    def test_what_a_robot_printed_is_read(self):
        with tempfile.NamedTemporaryFile("w") as file:
            file.write("waiting 0.01 1\npublished 0 4 0000000a\nacknowledged 1\n")
            file.flush()
            self.assertEqual(outcome.read_robot(file.name), ([(0, 4, 10)], 1, [(0.01, 1)]))

    def test_keyframes_of_a_store_have_the_names_of_those_in_a_log_and_torn_ones_none(self):
        keyframe = b"keyframe"

        def event(index, channel=b"UNIMAPPER_KEYFRAME"):
            piece = keyframe[4 * index:4 * index + 4]
            data = outcome.CHUNK.pack(1, 2, 5, 0, 17, 3, index, 2, 8, zlib.crc32(keyframe), 4) + piece
            return struct.pack(">IqqII", 0xEDA1DA01, 0, 0, len(channel), len(data)) + channel + data

        with tempfile.TemporaryDirectory() as folder:
            with sqlite3.connect(f"{folder}/store.sqlite") as database:
                database.execute("CREATE TABLE keyframes (sequence, bytes)")
                database.execute("INSERT INTO keyframes VALUES (3, ?)", [keyframe])
            self.assertEqual(outcome.stored(folder), {(3, 8, zlib.crc32(keyframe)): 1})
            log = f"{folder}/keyframes.lcmlog"
            for events, whole in ((event(0) + event(1, b"OTHER") + event(1), 1), (event(0), 0),
                                  (event(0) + event(1)[:-1], 0)):
                with open(log, "wb") as file:
                    file.write(events)
                self.assertEqual(outcome.in_log(log), [(3, 8, zlib.crc32(keyframe))] * whole)


if __name__ == "__main__":
    unittest.main()
