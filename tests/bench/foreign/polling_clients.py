"""Foreign clients that are configured and then read and write by themselves, again and again. A read shows
what they have; what they write goes on being written. The words are those of plain_clients.py."""
import contextlib
import pathlib
import re
import shutil
import subprocess

from harness import Helper
from plain_clients import BITS, Client, packaged, quietly, refusal, told


class Collectd(Client):
    """Its Modbus plugin reads a register, or two as one value, and has neither bits nor writes."""
    polls = True
    MOST = 10

    def missing(self):
        return None if shutil.which("collectd") else "there is no collectd"

    def can(self, call):
        return (call.verb == "read" and call.table not in BITS and call.values[0] <= self.MOST
                and call.expected is not None)

    @staticmethod
    def items(unit, table, address, count):
        """(name, address, type) of what this call is made of."""
        kind, step = ("uint16", 1) if count == 1 else ("uint32", 2)
        return [(f"{table}_{unit}_{address + i}_{kind}", address + i, kind) for i in range(0, count, step)]

    def settings(self, port, folder, calls):
        data, hosts = [], []
        for call in calls:
            command = "ReadHolding" if call.table == "holding" else "ReadInput"
            for name, address, kind in self.items(call.unit, call.table, call.address, call.values[0]):
                data.append(f'<Data "{name}">\nRegisterBase {address}\nRegisterType {kind}\n'
                            f'RegisterCmd {command}\nType gauge\nInstance "{name}"\n</Data>\n')
                hosts.append((call.unit, f'Collect "{name}"\n'))
        slaves = "".join(f'<Slave {unit}>\nInstance "{unit}"\n'
                         + "".join(line for of, line in hosts if of == unit) + "</Slave>\n"
                         for unit in sorted({unit for unit, _ in hosts}))
        return (f'Hostname "matrix"\nFQDNLookup false\nBaseDir "{folder}"\nPluginDir "/usr/lib/collectd"\n'
                f'TypesDB "/usr/share/collectd/types.db"\nInterval 1\nLoadPlugin csv\nLoadPlugin modbus\n'
                f'<Plugin csv>\nDataDir "{folder}/csv"\n</Plugin>\n<Plugin modbus>\n{"".join(data)}'
                f'<Host "gateway">\nAddress "127.0.0.1"\nPort "{port}"\nInterval 1\n{slaves}</Host>\n</Plugin>\n')

    @contextlib.contextmanager
    def running(self, port, folder, calls):
        self.version = re.search(r"collectd (\d\S*),", quietly("collectd", "-h").stdout).group(1)
        settings = pathlib.Path(folder) / "collectd.conf"
        settings.write_text(self.settings(port, folder, calls))

        def last(name):
            """The last value of this item; 0 while there is none, which nothing has."""
            found = sorted(pathlib.Path(folder).glob(f"csv/gateway/modbus-*/gauge-{name}-*"))
            lines = found[-1].read_text().splitlines() if found else []
            return int(float(lines[-1].split(",")[1])) if len(lines) > 1 else 0

        def ask(verb, table, unit, address, values):
            came = [last(name) for name, _, _ in self.items(unit, table, address, values[0])]
            return told(came if values[0] == 1 else [w for v in came for w in (v >> 16, v & 0xFFFF)])
        with Helper(["collectd", "-f", "-C", settings, "-P", f"{folder}/collectd.pid"], stderr=subprocess.DEVNULL):
            yield ask


class Nmap(Client):
    """Its script asks each unit who it is, by 17 and 43/14, on a connection each."""
    ADDRESSES_PATIENCE = 900  # seconds: nmap asks 246 addresses, and the gateway waits a timeout for each

    def __init__(self, name):
        super().__init__(name)
        self._text = ""

    def missing(self):
        return None if shutil.which("nmap") else "there is no nmap"

    def can(self, call):
        return False

    @contextlib.contextmanager
    def running(self, port, folder, calls):
        self.version = re.search(r"version (\S+)", quietly("nmap", "--version").stdout).group(1)
        self._text = quietly("nmap", "-n", "-Pn", "-sT", "-p", port, "--script", "+modbus-discover",
                             "--script-args", "modbus-discover.aggressive=true", "127.0.0.1",
                             timeout=self.ADDRESSES_PATIENCE).stdout
        yield None

    def survey(self, unit):
        found = re.search(rf"sid 0x{unit:x}: *\n\|[ _]+(.*)", self._text)
        words = found.group(1) if found else "nothing"
        return ["" if words == "error: ILLEGAL FUNCTION" else f"nmap found {words}"]


class Mb2hal(Client):
    """LinuxCNC's: pins for each item; the transactions go round and round."""
    polls = True
    MOST = 100
    CODES = {("read", "coils"): "fnct_01_read_coils", ("read", "discrete"): "fnct_02_read_discrete_inputs",
             ("read", "holding"): "fnct_03_read_holding_registers",
             ("read", "inputs"): "fnct_04_read_input_registers", ("set", "coils"): "fnct_05_write_single_coil",
             ("set", "holding"): "fnct_06_write_single_register",
             ("write", "coils"): "fnct_15_write_multiple_coils",
             ("write", "holding"): "fnct_16_write_multiple_registers"}

    def missing(self):
        return None if shutil.which("mb2hal") else "there is no mb2hal"

    def can(self, call):
        return call.expected is not None and not (call.verb == "read" and call.values[0] > self.MOST)

    @staticmethod
    def pins(verb, table, unit, address, values):
        """The transaction's name and its pins."""
        count = values[0] if verb == "read" else len(values)
        name = f"{verb}-{table}-{unit}-{address}-{count}"
        kind = "bit" if table in BITS else "int"
        return name, [f"mb2hal.{name}.{i:02d}.{kind}" for i in range(count)]

    def settings(self, port, calls):
        every = {self.pins(*call[:5])[0]: call for call in calls}  # what is written twice has its pins once
        text = (f"[MB2HAL_INIT]\nINIT_DEBUG=1\nVERSION=1.1\nHAL_MODULE_NAME=mb2hal\nSLOWDOWN=0.0\n"
                f"TOTAL_TRANSACTIONS={len(every)}\n")
        for number, (name, call) in enumerate(every.items()):
            text += (f"[TRANSACTION_{number:02d}]\nLINK_TYPE=tcp\nTCP_IP=127.0.0.1\nTCP_PORT={port}\n"
                     f"MB_SLAVE_ID={call.unit}\nFIRST_ELEMENT={call.address}\n"
                     f"NELEMENTS={len(self.pins(*call[:5])[1])}\nMB_TX_CODE={self.CODES[call.verb, call.table]}\n"
                     f"HAL_TX_NAME={name}\nMAX_UPDATE_RATE=0.0\nDEBUG=1\n")
        return text

    @contextlib.contextmanager
    def running(self, port, folder, calls):
        self.version = packaged("linuxcnc-uspace")
        settings = pathlib.Path(folder) / "mb2hal.ini"
        settings.write_text(self.settings(port, calls))
        start = pathlib.Path(folder) / "start.hal"
        start.write_text(f"loadusr -W mb2hal config={settings}\n")

        def ask(verb, table, unit, address, values):
            pins = self.pins(verb, table, unit, address, values)[1]
            if verb == "read":
                seen = [quietly("halcmd", "-s", "getp", pin).stdout.strip() for pin in pins]
                return told(s == "TRUE" if table in BITS else int(s) for s in seen) if all(seen) else "error no pin"
            for pin, value in zip(pins, values):
                done = quietly("halcmd", "setp", pin, value)
                if done.returncode != 0:
                    return refusal(done.stderr)
            return "ok"
        with Helper(["halrun", "-I", "-f", start], stderr=subprocess.DEVNULL):
            yield ask
            quietly("halcmd", "unload", "mb2hal")


def everyone():
    return [Collectd("collectd"), Nmap("nmap modbus-discover"), Mb2hal("mb2hal")]
