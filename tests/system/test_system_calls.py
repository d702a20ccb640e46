"""What the service's unit lets the kernel refuse is nothing that the gateway asks for."""
import json
import os
import pathlib
import re
import shutil
import signal
import subprocess
import tempfile
import unittest

import config
import harness
from harness import ROOT

SERVICE = ROOT / "deploy/systemd/panelgate.service"
PROFILE = ROOT / "deploy/seccomp.json"
BUSY = config.gateway(
    config.line(stations="{id: 31, name: press, profile: autonics-gplp-s, poll: [{read: UW0, count: 5, "
                         "every: 50ms}]}"),
    mqtt="{broker: 'mqtt://127.0.0.1:1', topic: t}")


def members(name, seen):
    """The calls of a set of `systemd-analyze syscall-filter`, those of its sets among them."""
    if name in seen:
        return set()
    seen.add(name)
    told = subprocess.run(["systemd-analyze", "syscall-filter", name], capture_output=True, text=True,
                          timeout=harness.PATIENCE, check=True).stdout
    calls = set()
    for word in re.findall(r"(?m)^    ([@\w-]+)$", told):
        calls |= members(word, seen) if word.startswith("@") else {word}
    return calls


def allowed():
    """Line by line, as systemd.exec(5) says: the first list is what may, `~` takes away."""
    calls = set()
    for line in re.findall(r"(?m)^SystemCallFilter=(.*)$", SERVICE.read_text()):
        takes = line.startswith("~")
        for word in line.lstrip("~").split():
            named = members(word, set()) if word.startswith("@") else {word}
            calls = calls - named if takes else calls | named
    return calls


def can_trace():
    return shutil.which("strace") and subprocess.run(["strace", "-qq", "true"], capture_output=True,
                                                     check=False).returncode == 0


@unittest.skipIf(harness.SANITIZED, "the sanitizers ask for more")
@unittest.skipUnless(shutil.which("systemd-analyze"), "no systemd-analyze here")
class SystemCalls(unittest.TestCase):
    @unittest.skipUnless(can_trace(), "no strace here, or it may not trace")
    def test_the_unit_allows_every_call_of_a_gateway_at_work(self):
        with tempfile.TemporaryDirectory() as folder:
            calls = pathlib.Path(folder) / "calls"
            tracer = ("strace", "-D", "-f", "-qq", "-o", str(calls), "--signal=none")
            with harness.configured(BUSY, under=tracer) as program:
                with program.client() as client:
                    client.send(31, bytes.fromhex("0300000005"))
                    client.receive()
                program.values("/api/v1/stations/press/devices/UW0?count=5")
                program.get("/metrics")
                program.get("/api/v1/lines/floor1/trace?last=5")
                program.process.send_signal(signal.SIGHUP)
                program.log.wait_for("reload")
            asked = set(re.findall(r"(?m)^\d+ +(\w+)\(", calls.read_text()))
        self.assertLessEqual({"execve", "epoll_wait", "sched_setattr"}, asked)
        self.assertEqual(asked - allowed(), set())

    def test_the_profile_for_containers_allows_what_the_unit_does(self):
        wanted = {"defaultAction": "SCMP_ACT_ERRNO",
                  "architectures": ["SCMP_ARCH_X86_64", "SCMP_ARCH_AARCH64"],
                  "syscalls": [{"names": sorted(allowed()), "action": "SCMP_ACT_ALLOW"}]}
        if os.environ.get("PANELGATE_WRITE_GOLDEN") == "1":
            PROFILE.write_text(json.dumps(wanted, indent=1) + "\n")
        self.assertEqual(json.loads(PROFILE.read_text()), wanted)

    def test_the_sets_of_the_unit_are_read_as_systemd_reads_them(self):
        self.assertLessEqual({"read", "execve", "sched_setattr"}, allowed())
        self.assertFalse({"setpriority", "reboot", "chroot", "mount"} & allowed())


@unittest.skipIf(harness.SANITIZED, "the sanitizers have checks of their own")
@unittest.skipUnless(shutil.which("readelf"), "no readelf here")
class Hardening(unittest.TestCase):
    def test_the_program_is_built_with_all_checks(self):
        def told(*options):
            return subprocess.run(["readelf", "-W", *options, harness.PANELGATE], capture_output=True, text=True,
                                  timeout=harness.PATIENCE, check=True).stdout
        self.assertRegex(told("-d"), r"FLAGS_1.*NOW.*PIE")
        self.assertIn("GNU_RELRO", told("-l"))
        self.assertNotRegex(told("-l"), r"GNU_STACK.*E")
        symbols = told("--dyn-syms")
        self.assertIn("__stack_chk_fail", symbols)
        self.assertIn("_chk@", symbols, "fortify")
        self.assertIn("__glibcxx_assert_fail", symbols)


if __name__ == "__main__":
    unittest.main()
