"""The plant that the examples of tests/golden/rest are asked of: every kind of refusal can be had there."""
import contextlib
import http.client
import json
import pathlib
import tempfile

import config
import harness

FLOOR1 = config.line(retries=0, timing="{response_timeout: 60ms}", stations="""
      {id: 31, name: press, profile: autonics-gplp-s, points: [
        {name: setpoint, at: UW120, scale: 0.1, unit: celsius, writable: true, min: 0, max: 60},
        {name: weight, at: UW130, type: f32, word_order: CDAB, writable: true},
        {name: mode, at: UW140, writable: true, labels: {0: off, 1: manual}},
        {name: serial, at: UW150}]},
      {id: 5, name: meter, profile: autonics-gplp-s, access: read_only},
      {id: 17, name: io, profile: autonics-arm},
      {id: 6, name: spare, profile: autonics-gplp-s}, {id: 7, name: loud, profile: autonics-gplp-s}""")
FLOOR2 = config.line("floor2", stations="{id: 20, name: oven, profile: panasonic-gt, guard: true}")
FLOOR3 = config.line("floor3", device="/dev/null", stations="{id: 8, name: scale}")
FLOOR4 = config.line("floor4", device="/dev/zero", mode="listen", stations="{id: 9, name: heard}")


def tokens(folder, roles):
    """A list of YAML: {name: role}."""
    listed = []
    for name, role in roles.items():
        file = pathlib.Path(folder) / name
        file.write_text(f"token-of-{name}-0123456789")
        file.chmod(0o600)
        listed.append(f"{{name: {name}, role: {role}, file: {file}}}")
    return f"[{', '.join(listed)}]"


def ask(program, method, path, token=None, body=None):
    """(status, text)"""
    connection = http.client.HTTPConnection("127.0.0.1", program.http_port(), timeout=harness.PATIENCE)
    headers = {"Authorization": f"Bearer token-of-{token}-0123456789"} if token else {}
    connection.request(method, path, json.dumps(body) if body is not None else None, headers)
    response = connection.getresponse()
    text = response.read().decode(errors="replace")
    connection.close()
    return response.status, text


@contextlib.contextmanager
def running():
    """The program with that plant, when its points have been read and its relay has written once."""
    with tempfile.TemporaryDirectory() as folder:
        door = config.ADMIN + f", tokens: {tokens(folder, {'panel': 'viewer', 'ops': 'operator'})}"
        text = config.gateway(FLOOR1, FLOOR2, FLOOR3, FLOOR4, http=door,
                              modbus=config.FREE_PORT + ", lines: [floor1]",
                              relays="[{from: press/UW160, to: press/UW170, every: 1s}]")
        text += "alarms: [{name: press-hot, point: press/setpoint, above: 55}]\n"
        text += ("images: [{name: plant, unit: 100, points: [press/setpoint, {skip: 1}, press/weight], "
                 "stale: last, quality: true}]\n")
        with harness.configured(text) as program:
            while not is_settled(program):
                pass  # each look is a request to the program
            yield program


def is_settled(program):
    """All points are known, and the relay has written."""
    points = program.get("/api/v1/stations/press/points")[1]["points"]
    relays = program.get("/api/v1/relays")[1]["relays"]
    return all(point["quality"] == "good" for point in points) and relays[0]["writes"] > 0
