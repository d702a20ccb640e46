#!/usr/bin/env python3
"""layering_test.py SOURCE_ROOT: the table of src/README.md, held against every #include.

First it plants violations in a copy of a small tree and sees that each is found.
"""
import pathlib
import re
import sys
import tempfile

# module -> (our modules, or single headers, that it may include; third-party prefixes)
ASIO = ("boost/asio/", "boost/system/")
RESULT = ("boost/system/result.hpp",)
COUNTERS = {"arbiter/counters.hpp", "bus/counters.hpp", "line/counters.hpp", "points/counters.hpp",
            "tcp_server/counters.hpp"}
SETTINGS = {"arbiter/settings.hpp", "bus/settings.hpp", "line/settings.hpp", "points/settings.hpp", "rt/settings.hpp",
            "points/point.hpp",
            "sim/settings.hpp", "tcp_server/settings.hpp", "web/http/settings.hpp"}
EVERYTHING = {"base", "yaml", "modbus", "profile", "arbiter", "rt", "line", "bus", "tcp_server", "sim", "doctor",
              "scan", "metrics", "points", "web/http", "web/api", "config", "app"}
TABLE = {
    "base": (set(), RESULT),
    "yaml": ({"base"}, RESULT),
    "modbus": ({"base"}, ()),
    "profile": ({"base", "modbus", "yaml"}, RESULT),
    "arbiter": ({"base", "modbus"}, ()),
    "rt": ({"base"}, ASIO + ("spdlog/", "fmt/")),
    "line": ({"base", "rt"}, ASIO),
    "doctor": ({"base"} | COUNTERS, ()),
    "bus": ({"base", "rt", "modbus", "arbiter", "line", "doctor"}, ASIO),
    "points": ({"base", "rt", "modbus", "profile", "bus", "arbiter"}, RESULT),
    "tcp_server": ({"base", "rt", "modbus", "bus"}, ASIO),
    "sim": ({"base", "rt", "modbus", "profile", "line"}, ASIO),
    "scan": ({"base", "modbus", "profile"}, ()),
    "metrics": ({"base", "modbus"} | COUNTERS, ("prometheus/",)),
    "web/http": ({"base", "rt"}, ASIO + ("boost/beast/", "boost/json")),
    "web/api": ({"base", "modbus", "profile", "bus", "points", "web/http"}, ASIO + ("boost/json",)),
    "config": ({"base", "modbus", "profile", "yaml"} | SETTINGS, RESULT),
    "app": (EVERYTHING, ASIO + ("CLI/", "boost/json")),
}
# Files with a rule of their own: path in the tree -> third-party prefixes instead of the module's.
FILES = {
    "include/panelgate/points/poller.hpp": ASIO,
    "src/points/poller.cpp": ASIO,
    "include/panelgate/points/relays.hpp": ASIO,
    "src/points/relays.cpp": ASIO,
    "src/yaml/document.cpp": ("yaml-cpp/",),
    "src/rt/asio_impl.cpp": ASIO + ("boost/beast/src.hpp",),
    "src/sim/station.cpp": (),
    "include/panelgate/sim/station.hpp": (),
}
THIRD_PARTY = re.compile(r"^(boost|yaml-cpp|prometheus|spdlog|fmt|CLI|gtest|gmock)/")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
CLOCK = re.compile(r"(?<!\brt)::now\s*\(")
DETACHED = re.compile(r"\bdetached\b")
MAX_LINES = 400


def module_of(path):
    """A folder, or a wing of one, with a row of its own."""
    folders = path.split("/")
    wing = "/".join(folders[:2])
    return wing if wing in TABLE else folders[0]


def is_allowed(module, header, allowed):
    target = module_of(header)
    return target == module or target in allowed or header in allowed


def judge_include(module, path, root, mark, header):
    allowed, third_party = TABLE[module]
    third_party = FILES.get(path, third_party)
    if header.startswith("panelgate/"):
        if not is_allowed(module, header.removeprefix("panelgate/"), allowed):
            return f"{module} may not include {header}"
    elif header == "boost/asio.hpp":
        return "boost/asio.hpp costs two seconds a file: include the parts"
    elif THIRD_PARTY.match(header):
        if not header.startswith(tuple(third_party)):
            return f"{path} may not include <{header}>"
    elif mark == '"' and not (root / "src" / module / header).exists():
        return f'"{header}" is not a file of src/{module}'
    return None


def judge_line(module, path, root, line):
    found = INCLUDE.match(line)
    if found:
        return judge_include(module, path, root, *found.groups())
    code = line.split("//")[0]
    if module != "rt" and CLOCK.search(code):
        return "only rt reads a clock: take the time as an argument or call rt::now()"
    if module != "rt" and DETACHED.search(code):
        return "nothing is detached: somebody owns every coroutine"
    return None


def check(root):
    """FILE:LINE: what is wrong, for all of src/ and include/."""
    problems = []
    files = [p for top in ("src", "include/panelgate") for p in sorted((root / top).rglob("*.[ch]pp"))]
    for file in files:
        path = file.relative_to(root).as_posix()
        module = module_of(path.removeprefix("src/").removeprefix("include/panelgate/"))
        lines = file.read_text().splitlines()
        if module not in TABLE:
            problems.append(f"{path}:1: module '{module}' is not in the table")
            continue
        if len(lines) > MAX_LINES:
            problems.append(f"{path}:{len(lines)}: {len(lines)} lines, {MAX_LINES} at most")
        for number, line in enumerate(lines, 1):
            problem = judge_line(module, path, root, line)
            if problem:
                problems.append(f"{path}:{number}: {problem}")
    return len(files), problems


PLANTED = {
    "src/modbus/a.cpp": '#include "panelgate/bus/bus.hpp"',
    "src/metrics/b.cpp": '#include "panelgate/bus/bus.hpp"',
    "src/arbiter/c.cpp": "#include <boost/asio/steady_timer.hpp>",
    "src/yaml/map_reader.cpp": "#include <yaml-cpp/yaml.h>",
    "src/sim/station.cpp": "#include <boost/asio/steady_timer.hpp>",
    "src/bus/d.cpp": "#include <boost/asio.hpp>",
    "src/web/http/e.cpp": "auto t = std::chrono::steady_clock::now();",
    "src/tcp_server/f.cpp": "asio::co_spawn(ex, serve(), asio::detached);",
    "src/line/g.cpp": '#include "../bus/bus.hpp"',
    "include/panelgate/base/h.hpp": "\n" * MAX_LINES + "int x;",
    "src/newcomer/i.cpp": "int x;",
    "src/web/http/j.cpp": '#include "panelgate/bus/bus_client.hpp"',
    "src/web/http/k.cpp": '#include "panelgate/web/api/directory.hpp"',
    "src/web/l.cpp": "int x;",
}
HARMLESS = {
    "src/bus/fine.cpp": '#include "panelgate/rt/asio_clock.hpp"\nauto t = rt::now();  // not ::now()',
    "src/config/fine.cpp": '#include "panelgate/web/http/settings.hpp"\n#include <vector>',
    "src/rt/fine.cpp": "auto t = std::chrono::steady_clock::now();",
    "src/yaml/document.cpp": "#include <yaml-cpp/yaml.h>",
}


def self_test():
    with tempfile.TemporaryDirectory() as name:
        root = pathlib.Path(name)
        for path, text in {**PLANTED, **HARMLESS}.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text + "\n")
        found = sorted(problem.split(":")[0] for problem in check(root)[1])
        assert found == sorted(PLANTED), f"planted {sorted(PLANTED)}, found {found}"


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    self_test()
    count, problems = check(pathlib.Path(sys.argv[1]))
    print("\n".join(problems) or f"{count} files, no violation")
    sys.exit(bool(problems) or count == 0)


if __name__ == "__main__":
    main()
