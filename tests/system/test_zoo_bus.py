"""The zoo is what its names say: asked directly, byte for byte."""
import os
import select
import struct
import tempfile
import time
import unittest

import harness
from harness import read_registers, rtu, write_register
from zoo_line import WRITABLE, Zoo, holding

QUIET = 0.15  # s without a byte: what was said is said


def hear(descriptor, first=harness.PATIENCE):
    """[(moment, bytes)] until it is quiet."""
    heard = []
    while select.select([descriptor], [], [], QUIET if heard else first)[0]:
        heard.append((time.monotonic(), os.read(descriptor, 1024)))
    return heard


def ask(descriptor, unit, pdu, first=harness.PATIENCE):
    os.write(descriptor, rtu(unit, pdu))
    return b"".join(data for _, data in hear(descriptor, first))


class ZooBus(unittest.TestCase):
    def setUp(self):
        folder = self.enterContext(tempfile.TemporaryDirectory())
        self.zoo = self.enterContext(Zoo("--baud", 38400, "--bus", f"{folder}/tty=1-3"))
        self.device = os.open(self.zoo.names[0], os.O_RDWR | os.O_NOCTTY)
        self.addCleanup(os.close, self.device)

    def ask(self, habits, pdu=read_registers(5, 2), unit=2):
        self.zoo.set("all", habits)
        return ask(self.device, unit, pdu)

    def test_values_tell_whose_they_are_and_writes_can_be_read_back(self):
        good = rtu(2, struct.pack(">BBHH", 3, 4, holding(2, 5), holding(2, 6)))
        self.assertEqual(self.ask("-"), good)
        self.assertEqual(self.ask("-", write_register(WRITABLE, 77)),
                         rtu(2, write_register(WRITABLE, 77)))
        self.assertEqual(self.ask("-", read_registers(WRITABLE)), rtu(2, b"\x03\x02\x00\x4d"))
        coils = b"\x0f" + struct.pack(">HHB", WRITABLE, 3, 1) + b"\x05"
        self.assertEqual(self.ask("-", coils), rtu(2, coils[:5]))
        self.assertEqual(self.ask("-", b"\x01" + struct.pack(">HH", WRITABLE, 3)),
                         rtu(2, b"\x01\x01\x05"))
        self.assertEqual(self.ask("-", read_registers(0xF000)), rtu(2, b"\x83\x02"))
        self.assertEqual([w.pdu for w in self.zoo.writes()], [write_register(WRITABLE, 77), coils])

    def test_each_habit_is_heard(self):
        request = rtu(2, read_registers(5, 2))
        data = struct.pack(">BBHH", 3, 4, holding(2, 5), holding(2, 6))
        good = rtu(2, data)
        expected = {
            "pre-00": b"\0" + good, "post-FF": good + b"\xff", "pregap-00": b"\0" + good,
            "crcswap": good[:-2] + good[:-3:-1], "pad2": good + b"  ", "padin2": rtu(2, data + b"  "),
            "excfn-84": rtu(2, b"\x84\x02"), "dup-5ms": 2 * good, "dup-30ms": 2 * good,
            "echo-full": request + good, "echo-first": request[:1] + good,
            "echo-last": request[-1:] + good, "echo-cutlast": request[:-1] + good,
            "echo-partial-4": request[:4] + good, "twin-1-30": 2 * good, "usb16": good,
            "holes-0-18": good, "split-20-40": good, "think-20ms": good, "rate+2": good,
            "think-rand-0.1-40": good, "every5-20x3": good, "slow-then-quick": good,
            "maxregs-1-4": rtu(2, b"\x83\x04"),
        }
        for habits, heard in expected.items():
            with self.subTest(habits):
                self.assertEqual(self.ask(habits).hex(" "), heard.hex(" "))
        with self.subTest("tail"):
            heard = self.ask("tail")
            self.assertTrue(heard.startswith(good) and 1 <= len(heard) - len(good) <= 3, heard)
        with self.subTest("what is unknown is not taken"):
            self.assertEqual(self.zoo.ask("set 2 toothache"), "what?")

    def test_a_choice_is_for_some_replies_only(self):
        self.zoo.set(2, "mute@=1,post-00@3")
        good = rtu(2, read_registers(5, 2))
        self.assertEqual(ask(self.device, 2, read_registers(5, 2), QUIET), b"")
        lengths = [len(ask(self.device, 2, read_registers(5, 2))) for _ in range(5)]
        self.assertEqual(lengths, [9, 10, 9, 9, 10], good)

    def test_a_request_while_it_thinks_is_served_afterwards(self):
        self.zoo.set(2, "think-100ms")
        for address in (5, 6):
            os.write(self.device, rtu(2, read_registers(address)))
            time.sleep(0.03)  # two frames, not one
        replies = b"".join(data for _, data in hear(self.device))
        values = [rtu(2, struct.pack(">BBH", 3, 2, holding(2, a))) for a in (5, 6)]
        self.assertEqual(replies, b"".join(values))
        self.zoo.set(2, "think-100ms,noring")
        for address in (5, 6):
            os.write(self.device, rtu(2, read_registers(address)))
            time.sleep(0.03)
        self.assertEqual(b"".join(data for _, data in hear(self.device)), values[0])

    def test_who_speaks_at_the_same_time_damages_both(self):
        self.zoo.set(2, "think-2ms")
        os.write(self.device, rtu(2, read_registers(5, 100)))
        first = os.read(self.device, 1)  # it speaks
        os.write(self.device, rtu(1, read_registers(5)))
        heard = first + b"".join(data for _, data in hear(self.device))
        self.assertEqual(len(heard), 205)
        self.assertNotEqual(harness.crc(heard[:-2]), heard[-2:])
        stats = self.zoo.stats()
        self.assertGreater(stats["collisions"], 8)
        self.assertEqual(stats["units"]["1"]["asked"], 0)

    def test_the_wire_takes_its_time(self):
        self.zoo.set(2, "think-0.5ms")
        start = time.monotonic()
        os.write(self.device, rtu(2, read_registers(0, 100)))
        took = hear(self.device)[-1][0] - start
        nominal = (8 + 205) * 10 / 38400 + 0.0005
        self.assertGreater(took, nominal * 0.99)
        self.assertLess(took, nominal * 1.5)


if __name__ == "__main__":
    unittest.main()
