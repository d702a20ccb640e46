#!/usr/bin/env python3
"""host.py KERNEL INITRAMFS OUTPUT [usb]: the machine around guest.cpp.

Boots it in qemu and plays the other end of its second serial port, or with "usb" of an FTDI adapter
on USB: every byte goes back inverted, and the guest's lines "host: ..." on the console are obeyed, each answered with "done". What drivers answered there goes to
files TABLE.txt in the folder OUTPUT. Exit code 0 only when the guest said that it is done and that nothing failed.
"""
import json
import os
import pathlib
import re
import select
import selectors
import signal
import socket
import subprocess
import sys
import tempfile
import time

DEADLINE = 90.0  # seconds; a boot and all checks take 5 with software emulation on a busy machine


ADAPTER = "usb-serial,id=adapter,chardev=port"


class Connection:
    """A unix socket that qemu connects to."""

    def __init__(self, folder, name):
        self.path = str(folder / name)
        self.listener = socket.socket(socket.AF_UNIX)
        self.listener.bind(self.path)
        self.listener.listen(1)
        self.listener.settimeout(20)

    def accept(self):
        stream, _ = self.listener.accept()
        stream.settimeout(20)
        return stream


class Machine:
    """The emulated machine; ends with the `with` block, whatever happened."""

    def __init__(self, kernel, initramfs, usb):
        self.folder = tempfile.TemporaryDirectory(prefix="panelgate-kernel-")
        folder = pathlib.Path(self.folder.name)
        port, monitor = Connection(folder, "port"), Connection(folder, "monitor")
        self.process = subprocess.Popen(
            ["qemu-system-x86_64", "-accel", "tcg", "-m", "256", "-smp", "1", "-no-reboot",
             "-nodefaults", "-display", "none", "-kernel", kernel, "-initrd", initramfs,
             "-append", "console=ttyS0 quiet loglevel=1 panic=-1 random.trust_cpu=on",
             "-chardev", "stdio,id=console,signal=off", "-serial", "chardev:console",
             "-chardev", f"socket,id=port,path={port.path}",
             *(["-device", "qemu-xhci", "-device", ADAPTER] if usb else ["-serial", "chardev:port"]),
             "-qmp", f"unix:{monitor.path}"],
            stdin=subprocess.PIPE, stdout=subprocess.PIPE, start_new_session=True)
        try:
            self.port, self.monitor = port.accept(), monitor.accept()
            self.replies = self.monitor.makefile("r")
            self.replies.readline()  # the greeting
            self.muted = False
            self.events = []
            self.order("qmp_capabilities")
        except BaseException:
            self.end()
            raise

    def __enter__(self):
        return self

    def __exit__(self, *_):
        self.end()

    def end(self):
        if self.process.poll() is None:
            os.killpg(self.process.pid, signal.SIGKILL)
        self.process.wait()
        self.folder.cleanup()

    def order(self, command, **arguments):
        message = {"execute": command, "arguments": arguments}
        self.monitor.sendall(json.dumps(message).encode() + b"\n")
        while True:
            reply = json.loads(self.replies.readline())
            if "error" in reply:
                raise RuntimeError(f"qemu refuses {command}: {reply['error']['desc']}")
            if "return" in reply:
                return
            self.events.append(reply.get("event"))


    def wait_event(self, event):
        while event not in self.events:
            self.events.append(json.loads(self.replies.readline()).get("event"))
        self.events.remove(event)


def obey(machine, wish):
    word, _, argument = wish.partition(" ")
    if word == "break":
        machine.order("chardev-send-break", id="port")
    elif word in ("mute", "answer"):
        while select.select([machine.port], [], [], 0)[0] and machine.port.recv(4096):
            pass  # from before: not to be answered
        machine.muted = word == "mute"
    elif word == "unplug":
        machine.order("device_del", id="adapter")
        machine.wait_event("DEVICE_DELETED")
    elif word == "plug":
        machine.order("device_add", driver="usb-serial", id="adapter", chardev="port")
    elif word == "send":
        machine.port.sendall(bytes.fromhex(argument))
    else:
        raise RuntimeError(f"the guest asks for {wish!r}")
    machine.process.stdin.write(b"done\n")
    machine.process.stdin.flush()


def console_lines(machine, start):
    """The console's lines as they come; meanwhile the port is answered."""
    selector = selectors.DefaultSelector()
    selector.register(machine.process.stdout, selectors.EVENT_READ)
    selector.register(machine.port, selectors.EVENT_READ)
    pending = b""
    while True:
        left = start + DEADLINE - time.monotonic()
        if left <= 0:
            raise RuntimeError(f"not done after {DEADLINE:.0f} s")
        for key, _ in selector.select(left):
            if key.fileobj is machine.port:
                received = machine.port.recv(4096)
                if not received:
                    selector.unregister(machine.port)
                    continue
                if not machine.muted:
                    machine.port.sendall(bytes(byte ^ 0xFF for byte in received))
                continue
            chunk = os.read(machine.process.stdout.fileno(), 4096)
            if not chunk:
                return
            *lines, pending = (pending + chunk).split(b"\n")
            for line in lines:
                yield line.decode("utf-8", "replace").strip("\r")


TABLES = {
    "8250": "the 8250 driver, a 16550A of qemu-system-x86",
    "absent": "the 8250 driver, a ttyS without a UART",
    "ftdi": "ftdi_sio, the FT232BM of qemu-system-x86",
    "gone": "a descriptor of a 16550A whose driver was unbound meanwhile",
}


def run(machine, output, start):
    """True when every check passed and the guest came to its end."""
    tables, release, verdict = {name: [] for name in TABLES}, "Linux", None
    for line in console_lines(machine, start):
        if wish := re.match(r"host: (.*)", line):
            obey(machine, wish[1])
            continue
        if entry := re.match(r"record (\w+): (.*)", line):
            tables[entry[1]].append(entry[2])
            continue
        if verdict is not None or line == "done":
            continue  # the kernel's last words; the echo of our own
        print(f"{time.monotonic() - start:5.1f} s  {line}", flush=True)
        if found := re.match(r"guest: (Linux .*)", line):
            release = found[1]
        if found := re.match(r"guest: done, (\d+) checks, (\d+) failed", line):
            verdict = int(found[1]) > 0 and int(found[2]) == 0
    for name, lines in tables.items():
        if not lines:
            continue
        head = f"# {release}, {TABLES[name]}"
        (output / f"{name}.txt").write_text("\n".join([head, *lines, ""]))
    if verdict is None:
        print("the guest did not come to its end")
    return bool(verdict)


def main():
    if len(sys.argv) not in (4, 5) or sys.argv[4:] not in ([], ["usb"]):
        sys.exit(__doc__)
    kernel, initramfs, output, *usb = sys.argv[1:]
    start = time.monotonic()
    with Machine(kernel, initramfs, bool(usb)) as machine:
        try:
            good = run(machine, pathlib.Path(output), start)
        except (RuntimeError, OSError) as error:
            sys.exit(f"host.py: {error}")
    sys.exit(0 if good else 1)


if __name__ == "__main__":
    main()
