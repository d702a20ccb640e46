"""docs/reference/log.md: the events of the log, from the calls in the sources that write them."""
import pathlib
import re

from tables import page, table

ROOT = pathlib.Path(__file__).resolve().parents[2]
SOURCES = ROOT / "src"
CALL = re.compile(r"(?<![\w:])(rt::log(?:_about|_collapsed|_each)?|shared_->log|log_client|say|warn_once|line_of)\(")
WORDS = re.compile(r'"((?:[^"\\]|\\.)*)"')
FIELD = re.compile(r'\{"(\w+)",')
LEVELS = ("trace", "debug", "info", "warn", "error")
# The functions that write an event: at which level, if it is always one, and with which fields besides.
ADDED = {"log_client": ("info", ["client"]), "shared_->log": ("", ["listener"]), "rt::log_each": ("info", []),
         "rt::log_collapsed": ("info", []), "say": ("", ["line", "station", "hint"]),
         "warn_once": ("warn", ["device", "why"])}
# What is put together elsewhere in the file of the call.
ELSEWHERE = {"write": ("", ["line", "station", "client", "certificate", "at", "pdu", "outcome", "transaction", "rule"]),
             "listening": ("", ["modbus_tcp", "http"]), "listener waits": ("", ["modbus_tcp", "http"]),
             "log lines left out": ("", ["of", "client", "clients", "count"]),
             "log lines dropped": ("", ["count"]), "tls handshake failed": ("info, warn", []),
             "certificate renewed": ("", ["files", "subject", "issuer", "serial", "expires"]),
             "connection closed": ("info, warn", []),
             "connection gives way": ("info, warn", []),
             "datagram refused": ("debug, info, warn", [])}
MEANINGS = {
    "audit anchor": "the audit has come to this record; `panelgate audit verify --log` compares it",
    "audit fails": "the audit's file takes nothing, and what happens to writes meanwhile",
    "audit file": "a file was found that the audit cannot go on with, and is kept; it was removed, moved away or changed by others; or the run before did not end in order",
    "audit records lost": "the run, or the audit, ended while its file took nothing: so many records were never written",
    "standby": "the box's role on a line that another box shares, and why it is so",
    "alarm": "an alarm was raised, has ended or was acknowledged",
    "alarm acknowledged": "a client of REST has acknowledged an alarm",
    "audit recovered": "the audit's file takes records again; what waited is written",
    "bytes behind its replies": "more bytes come after a panel's replies; the line waits for them",
    "cannot accept": "a client could not be let in: usually no descriptor is left",
    "cannot start": "a listener could not be opened; the program ends",
    "certificate": "what `check` would say of a certificate: its end, its names, its purpose",
    "certificate file missing": "a file of a `tls` map is gone or cannot be read; what it held stays in use",
    "certificate not renewed": "new files of a `tls` map cannot be used; the former contents stay in use",
    "certificate renewed": "new files of a `tls` map are in use for new connections; it says which, and whose certificate it is",
    "certificate without a role": "the role in a client's certificate does not count, so it only reads",
    "client without a unit id": "a client asks unit 0 or 255, where nothing is: none may be set in it; once a client",
    "collision": "another unit sent at the same time, or an echo is missing",
    "configuration": "what `check` would say of the file that is served",
    "configuration changed": "a reload took this change over",
    "configuration weaker": "a rollback protects less than what ran before",
    "connection closed": "a Modbus/TCP client was closed, and why",
    "connection gives way": "a client was closed to make room for a newer one",
    "connection refused": "a client is not in `allow`",
    "connections accepted again": "there is room for clients again",
    "connections refused": "no room for another client; once until one goes",
    "dashboard": "where the dashboard is",
    "datagram refused": "a datagram of a client was not served",
    "decision": "why the gateway did what it did next",
    "device server hangs up on requests": "three connections in a row of a `tcp://` line ended behind a request, without an answer",
    "device server speaks telnet": "a connection of a `tcp://` line began with telnet's negotiation: other bytes are mixed in",
    "device settings differ": "the serial port did not take a setting",
    "discovery begins": "the search for unlisted panels begins",
    "discovery ends": "the search for unlisted panels is over, with what it found",
    "discovery started": "a client asked for a search",
    "discovery stopped": "a client ended a search",
    "frame": "one frame on the line, in or out",
    "gateway finding": "what is not well with the gateway itself, see [Findings](findings.md)",
    "gateway finding gone": "that has ended",
    "http handler failed": "a defect of the program: please report it",
    "http request refused": "a client's role is not enough",
    "http requests refused": "all HTTP connections are busy",
    "http session failed": "a defect of the program: please report it",
    "late reply": "a reply came after it had been given up; `hint` has the timeout that would do",
    "line down": "the device is not open, and why",
    "write answered by another address": "a write had no answer of its station, and the station whose number was written confirmed it: the write has changed a panel's address",
    "line finding": "a likely cause of errors, see [Findings](findings.md)",
    "line finding gone": "that cause has ended",
    "line hears itself": "the adapter hears what it sends",
    "line up": "the device is open",
    "listener waits": "an address is not there yet; it is tried again",
    "listening": "an address is open",
    "log lines dropped": "lines were lost: stderr was not read",
    "log lines left out": "lines that were not written because there were too many of them",
    "login failed": "a client came with a token that is not known",
    "max_connections lowered": "the process may open too few files for that many connections",
    "mqtt connected": "the broker has accepted the gateway",
    "mqtt messages left out": "messages for writes came faster than they are taken",
    "mqtt messages of any size": "an old broker cannot be told how long a message may be",
    "mqtt not connected": "the broker is away, or refuses",
    "mqtt subscription refused": "the broker lets the gateway read no writes",
    "mqtt sessions end at once": "the broker has closed three connections in a row soon after it took them: another client may have the same `client_id`",
    "mqtt write refused": "a write by the broker was not carried out",
    "no reload": "a reload was asked for and is not possible",
    "not granted": "the system did not grant what `realtime` asks for",
    "planned load": "the polls and relays of a line take too much of it",
    "planned requests": "timeouts or the deadline of a line do not suit what it is asked",
    "relay": "a relay copies again, or fails",
    "reload": "the file was read again, with the outcome",
    "restart needed": "only the next start takes this over",
    "retransmission joined": "a client sent a request again before its answer",
    "serial master down": "the port of a serial master is not open",
    "serial master up": "the port of a serial master is open",
    "simulating": "a line is simulated",
    "simulator faults set": "a client changed the faults of a simulated panel",
    "slow adapter": "the adapter's latency timer makes each reply late",
    "history is full": "so many points have a history of days that none is kept of further points",
    "second device": "the first device of a line cannot be opened, and the second one is used",
    "first device again": "the first device of a line is there again, and is used",
    "store fails": "the file of events and history takes nothing: what comes is lost until `store writes`",
    "store file": "the file of events and history was damaged and is kept, and a new one begins",
    "store writes": "the file of events and history takes events and values again",
    "webhook answers": "the webhook of alarms takes them again",
    "webhook fails": "the webhook of alarms took nothing; it is asked again, up to once a minute",
    "station has become slow": "a panel thinks nearly as long as its timeout",
    "station offline": "a panel is silent; it is probed now and then",
    "station online": "a panel answers again",
    "stopped at once": "a second signal ended the program before all was answered",
    "stopped without waiting": "the program ended though a disk or a share did not answer",
    "stopping": "the program ends: nothing more is accepted",
    "tls handshake failed": "a client did not get in by TLS, and why",
    "write": "a write, by whom, where, its frame and its outcome",
    "write refused": "a write by REST that was not allowed, and why",
}


def arguments(text, start):
    """The arguments of the call whose parenthesis opens before `start`."""
    found, depth, quoted = [""], 1, False
    for place in range(start, len(text)):
        char = text[place]
        if char == '"' and text[place - 1] != "\\":
            quoted = not quoted
        if not quoted:
            depth += {"(": 1, "{": 1, "[": 1, ")": -1, "}": -1, "]": -1}.get(char, 0)
        if not depth:
            break
        if char == "," and depth == 1 and not quoted:
            found.append("")
        else:
            found[-1] += char
    return [" ".join(one.split()) for one in found]


class Events:
    def __init__(self):
        self.levels, self.fields = {}, {}
        for file in sorted([*SOURCES.rglob("*.cpp"), *SOURCES.rglob("*.hpp")]):
            text = file.read_text()
            for call in CALL.finditer(text):
                self.look_at(call[1], arguments(text, call.end()), text)
            for event in re.findall(r'messages\.push_back\(\{"([^"]+)",', text):
                self.add(event, ["warn"], ["warning"])

    def look_at(self, function, given, text):
        """A call whose event is a variable passes on what the callers of its function name."""
        event = next((found[1] for one in given[:4] if (found := WORDS.fullmatch(one))), None)
        if event is None:
            return
        level, added = ADDED.get(function, ("", []))
        of_file, elsewhere = ELSEWHERE.get(event, ("", []))
        for name in elsewhere:
            if f'"{name}"' not in "".join(path.read_text() for path in SOURCES.rglob("*.cpp")):
                raise SystemExit(f"no field '{name}' for '{event}'")
        place = next(number for number, one in enumerate(given) if one == f'"{event}"')
        levels = re.findall(r"LogLevel::(\w+)", " ".join(given[:place])) or [level or of_file]
        fields = [] if function in ("say", "warn_once") else FIELD.findall(" ".join(given[place + 1:]))
        self.add(event, [one for level in levels for one in level.split(", ")], [*added, *fields, *elsewhere])

    def add(self, event, levels, fields):
        if event not in MEANINGS or not all(level in LEVELS for level in levels):
            raise SystemExit(f"log: what does '{event}' ({levels}) mean?")
        self.levels.setdefault(event, set()).update(levels)
        known = self.fields.setdefault(event, [])
        known += [field for field in dict.fromkeys(fields) if field not in known]

    def rows(self):
        if missing := set(MEANINGS) - set(self.levels):
            raise SystemExit(f"log: nothing writes {missing}")
        for event, meaning in sorted(MEANINGS.items()):
            levels = [level for level in LEVELS if level in self.levels[event]]
            yield (f"`{event}`", ", ".join(levels), meaning,
                   ", ".join(f"`{field}`" for field in self.fields[event]))


def text():
    return page([
        "# Events of the log", "",
        "Made from the sources by `deploy/manual/reference.py`. How to read and search the log is in",
        "[Logs](../operate/logs.md).", "",
        "A line has its time in UTC, the level, the event and the fields. Not each line has each field. In",
        "JSON the fields are members, in the journal `PANELGATE_FIELD`.", "",
        *table(("event", "level", "meaning", "fields"), Events().rows()),
        "Further fields are of the log itself:", "",
        *table(("field", "meaning"),
               [("`left_out`", "so many lines of the same event and subject were left out before this one"),
                ("`repeated`, `first`, `last`", "the same write again and again: how often, and when")])])
