"""Who may do what, as section 3 of the contract says it: a rule is asked item by item, nothing is remembered and nothing is
clever. What panels show is written from their manuals, not from the gateway's profiles."""
import dataclasses
import ipaddress

COILS, DISCRETE, INPUT, HOLDING = "coils", "discrete-inputs", "input-registers", "holding-registers"
TABLES = (COILS, DISCRETE, INPUT, HOLDING)
# What a function does to which table, and where in the PDU the address and the count stand; no count: one item.
ADDRESSED = {1: (("read", COILS, 1, 3),), 2: (("read", DISCRETE, 1, 3),), 3: (("read", HOLDING, 1, 3),),
             4: (("read", INPUT, 1, 3),), 5: (("write", COILS, 1, None),), 6: (("write", HOLDING, 1, None),),
             15: (("write", COILS, 1, 3),), 16: (("write", HOLDING, 1, 3),), 22: (("write", HOLDING, 1, None),),
             23: (("read", HOLDING, 1, 3), ("write", HOLDING, 5, 7))}
READS = (7, 11, 12, 17, 20, 24, 43)  # of those that name no items
WRITES = (8, 21)  # the rest may do both: only their vendors know


@dataclasses.dataclass(frozen=True)
class Panel:
    """same: (table, table) that show one memory up to an address; words: how far coils show the bits of the holding registers."""
    functions: frozenset
    letters: dict  # of the notation: (table, first address, last address, text of an address)
    same: tuple = ()
    words: int = 0

    def memory(self, table, address):
        """The bits of the panel's memory that an item shows; of what its manual does not list, a memory of its own."""
        for one, other, last in self.same:
            if table == other and address <= last:
                table = one
        if self.words and table == COILS and address < 16 * self.words:
            return frozenset({(HOLDING, address // 16, address % 16)})
        if self.words and table == HOLDING and address < self.words:
            return frozenset((HOLDING, address, bit) for bit in range(16))
        return frozenset({(table, address, None)})

    def sent(self, pdu):
        """With functions that the panel lacks replaced by those that do the same."""
        function = pdu[0]
        if function in self.functions:
            return pdu
        if function == 4 and 3 in self.functions:
            first, count = int.from_bytes(pdu[1:3], "big"), int.from_bytes(pdu[3:5], "big")
            is_same = any((one, other) == (HOLDING, INPUT) and first + count - 1 <= last for one, other, last in self.same)
            return b"\x03" + pdu[1:] if is_same else pdu
        if function == 5 and 15 in self.functions:
            return b"\x0f" + pdu[1:3] + b"\0\x01\x01" + (b"\x01" if pdu[3] else b"\0")
        if function == 6 and 16 in self.functions:
            return b"\x10" + pdu[1:3] + b"\0\x01\x02" + pdu[3:5]
        return pdu


@dataclasses.dataclass(frozen=True)
class Station:
    line: str
    id: int
    panel: Panel
    name: str = ""
    translates: bool = True

    @property
    def place(self):
        return self.line, self.id


@dataclasses.dataclass(frozen=True)
class Who:
    face: str
    role: str
    listener: str
    address: str = ""
    token: str = ""


@dataclasses.dataclass(frozen=True)
class Range:
    """By notation (letter) or by table."""
    table: str
    first: int
    last: int
    letter: str = ""

    def items_at(self, station):
        if not self.letter:
            return range(self.first, self.last + 1)
        known = station.panel.letters.get(self.letter)
        return range(self.first, self.last + 1) if known and known[1] <= self.first and self.last <= known[2] else ()


@dataclasses.dataclass(frozen=True)
class Rule:
    name: str
    allow: bool
    acts: tuple
    sources: tuple = ()
    roles: tuple = ()
    tokens: tuple = ()
    faces: tuple = ()
    listeners: tuple = ()
    places: tuple = ()
    functions: tuple = ()
    range: Range = None

    def is_about(self, who, station):
        face = "modbus_tcp" if who.face == "udp" else who.face
        near = who.address and any(ipaddress.ip_address(who.address) in ipaddress.ip_network(one) for one in self.sources)
        return ((not self.sources or near) and (not self.roles or who.role in self.roles)
                and (not self.tokens or who.token in self.tokens) and (not self.faces or face in self.faces)
                and (not self.listeners or who.listener in self.listeners) and (not self.places or station.place in self.places))

    def matches(self, station, act, function, item):
        """item: (table, address), None: the function names none."""
        if act not in self.acts or (self.functions and function not in self.functions):
            return False
        if self.range is None:
            return True
        if item is None:
            return function in self.functions
        asked = station.panel.memory(*item)
        named = frozenset().union(*(station.panel.memory(self.range.table, one) for one in self.range.items_at(station)))
        # A bit that a range allows is not the whole word; a word that it denies is each of its bits.
        return asked <= named if self.allow else bool(asked & named)


def touches(pdu):
    """[(act, item)] of a request; an item is (table, address) or None."""
    word = lambda at: int.from_bytes(pdu[at:at + 2], "big")
    done = [(act, (table, word(at) + i)) for act, table, at, count in ADDRESSED.get(pdu[0], ())
            for i in range(max(1, word(count) if count else 1))]
    acts = ("read",) if pdu[0] in READS else ("write",) if pdu[0] in WRITES else ("read", "write")
    return done or [(act, None) for act in acts]


def denying(rules, default, who, stations, pdu, besides=()):
    """The rules that deny some part of it, by name; empty: it is allowed. stations: more than one for a broadcast, which
    `besides` names; what a raw request is besides, too."""
    names = set()
    for station in stations:
        about = [rule for rule in rules if rule.is_about(who, station)]
        forms = {pdu} if "broadcast" in besides or not station.translates else {pdu, station.panel.sent(pdu)}
        for form in forms:
            for act, item in touches(form):
                for each in (act, *besides):
                    rule = next((one for one in about if one.matches(station, each, form[0], item)), None)
                    if not (rule.allow if rule else default):
                        names.add(rule.name if rule else "default")
    return names
