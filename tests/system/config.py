"""The configurations of the tests: each test says what is different about its own, all else is said
here. Values are YAML, as in a file: line(retries=1, timing="{response_timeout: 60ms}")."""

PRESS = "{id: 31, name: press, profile: autonics-gplp-s}"
FREE_PORT = 'listen: "127.0.0.1:0"'  # harness.Program tells which one it got
MANY = FREE_PORT + ", max_connections_per_address: 1024"  # a crowd of one address
ADMIN = FREE_PORT + ", anonymous: admin"


def line(name="floor1", device="sim", stations=PRESS, *, baud=38400, parity="none", stop_bits=1,
         **keys):
    """An entry of `lines`. `stations`: all of them, with commas between."""
    serial = f"{{baud: {baud}, data_bits: 8, parity: {parity}, stop_bits: {stop_bits}}}"
    values = {"name": name, "device": device, "serial": serial, **keys,
              "stations": f"[{stations}]"}
    return "  - " + "    ".join(f"{key}: {value}\n" for key, value in values.items())


def station_ids(ids, more=""):
    """Stations without a name; `more`: what each of them has besides."""
    return ", ".join(f"{{id: {i}{more}}}" for i in ids)


def gateway(*lines, modbus=FREE_PORT, http=FREE_PORT, **keys):
    """A whole file. `modbus`, `http`: what their listeners have; None: there is none."""
    text = "lines:\n" + "".join(lines)
    text += "".join(f"{key}: {value}\n" for key, value in keys.items())
    if modbus:
        text += f"modbus_tcp: [{{{modbus}}}]\n"
    if http:
        text += f"http: {{{http}}}\n"
    return text


def wide_lines(lines, stations, points, *, every="10s", device="sim"):
    """Many lines with many stations (s1-1 ...) with many points (p0 ...). `{}` in the device is the
    line's number."""
    def station(n, i):
        listed = ", ".join(f"{{name: p{p}, at: UW{100 + p}, unit: celsius, every: {every}}}"
                           for p in range(points))
        return f"{{id: {i}, name: s{n}-{i}, profile: autonics-gplp-s, points: [{listed}]}}"
    return [line(f"line{n}", device.format(n),
                 ", ".join(station(n, i) for i in range(1, stations + 1)))
            for n in range(1, lines + 1)]


def wide(*shape, **more):
    """A file of wide_lines(), for REST alone."""
    return gateway(*wide_lines(*shape, **more), modbus=None)


# One more line, which nothing disturbs.
STEADY_LINE = line("steady")
