#!/usr/bin/env python3
"""layering_test.py SOURCE_ROOT: the rules of src/README.md that can be held against the text.

The table "Who may include whom" against every #include, every name of another module and the
DEPENDS of src/CMakeLists.txt; who reads a clock; how long files and functions are, and that a header
has a reason to be a file. First it plants violations in a small tree and sees that each is found.
"""
import pathlib
import re
import sys
import tempfile

from function_lengths import cpp_functions, python_functions

# What the third column calls a library -> the headers it means.
LIBRARIES = {
    "result": ("boost/system/result.hpp",),
    "Asio": ("boost/asio/", "boost/system/"),
    "Beast": ("boost/beast/", "boost/optional"),
    "Boost.JSON": ("boost/json",),
    "Boost.Multiprecision": ("boost/multiprecision/",),
    "CLI11": ("CLI/",),
    "libmosquitto": ("mosquitto.h",),
    "OpenSSL": ("openssl/",),
    "prometheus-cpp": ("prometheus/",),
    "spdlog": ("spdlog/", "fmt/"),
    "yaml-cpp": ("yaml-cpp/",),
    "zlib": ("zlib.h",),
}
THIRD_PARTY = re.compile(r"^((boost|openssl|yaml-cpp|prometheus|spdlog|fmt|CLI|gtest|gmock)/|(zlib|mosquitto)\.h$)")
INCLUDE = re.compile(r'^\s*#\s*include\s*([<"])([^>"]+)[>"]')
CLOCK = re.compile(r"::now\s*\(")
DETACHED = re.compile(r"\bdetached\b")
STRING = re.compile(r'"(?:\\.|[^"\\])*"')
MAX_LINES = 500
MIN_ROOM = 120  # lines of header and source together: below, one user is no reason for a file
MAX_FUNCTION = {"src": 40, "include": 40, "tests": 60}


class Row:
    """A module: what it may include (modules and single headers), and third parties by file."""

    def __init__(self, root, may_include, third_party):
        self.modules, self.headers = set(), set()
        for word in re.findall(r"`[^`]+`|[\w/]+", may_include.replace("any ", "")):
            name = word.strip("`")
            if word == name:
                self.modules.add(name)
            elif "/" in name:
                self.headers.add(name)
            else:  # any module's
                folder = root / "include/panelgate"
                self.headers |= {p.relative_to(folder).as_posix() for p in folder.rglob(name)}
        self.third_party = [  # (headers, "only" or "not" or "", stems of files)
            (LIBRARIES[name], mode, set(re.findall(r"`(\w+)`", stems)))
            for name, mode, stems in re.findall(r"([\w.-]+)(?: \((only|not) ([^)]*)\))?(?:, |$)", third_party)
            if name in LIBRARIES]

    def may_include(self, header, target):
        return "everything" in self.modules or target in self.modules or header in self.headers

    def may_name(self, module):
        named = self.modules | {header.rsplit("/", 1)[0] for header in self.headers}
        return "everything" in named or any(name.split("/")[0] == module for name in named)

    def may_use(self, header, stem):
        return any(header.startswith(headers) and (not mode or (stem in stems) == (mode == "only"))
                   for headers, mode, stems in self.third_party)


def read_table(root):
    section = (root / "src/README.md").read_text().split("## Who may include whom")[1].split("\n## ")[0]
    rows = re.findall(r"^\| ([\w/]+) \| ([^|]*) \| ([^|]*) \|$", section, re.M)
    return {module: Row(root, may, third) for module, may, third in rows if module != "module"}


def read_depends(root):
    text = (root / "src/CMakeLists.txt").read_text()
    found = re.findall(r"^panelgate_module\(([\w/]+)(?: ASIO)?(?: DEPENDS ([\w/\s]*?))?(?: LIBRARIES [^)]*)?\)", text, re.M)
    return {module: set(depends.split()) for module, depends in found}


class Tree:
    def __init__(self, root):
        self.root = root
        self.table = read_table(root)
        self.used = {module: set() for module in self.table}  # by includes
        folders = {module.split("/")[0] for module in self.table} - {"base"}
        self.name = re.compile(rf"(?<![\w:])(?:panelgate::)?({'|'.join(sorted(folders))})::\w")

    def module_of(self, path):
        """A folder, or a wing of one, that has a row of its own."""
        folders = path.split("/")
        wing = "/".join(folders[:2])
        return wing if wing in self.table else folders[0]

    def judge_include(self, module, path, mark, header):
        row = self.table[module]
        if header.startswith("panelgate/"):
            header = header.removeprefix("panelgate/")
            target = self.module_of(header)
            if target != module:
                self.used[module].add(target)
                if not row.may_include(header, target):
                    return f"{module} may not include {header}"
        elif header == "boost/asio.hpp":
            return "boost/asio.hpp costs two seconds a file: include the parts"
        elif THIRD_PARTY.match(header):
            if not row.may_use(header, pathlib.Path(path).stem):
                return f"{path} may not include <{header}>"
        elif mark == '"' and not (self.root / "src" / module / header).exists():
            return f'"{header}" is not a file of src/{module}'
        return None

    def judge_line(self, module, path, line):
        if found := INCLUDE.match(line):
            return self.judge_include(module, path, *found.groups())
        code = STRING.sub('""', line).split("//")[0]
        if module != "rt" and CLOCK.search(code):
            return "only rt reads a clock: take the time as an argument, or an rt::Clock"
        if module != "rt" and DETACHED.search(code):
            return "nothing is detached: somebody owns every coroutine"
        for name in self.name.findall(code):
            if name != module.split("/")[0] and not self.table[module].may_name(name):
                return f"{module} may not name {name}::"
        return None

    def judge_file(self, file):
        path = file.relative_to(self.root).as_posix()
        text = file.read_text()
        module = self.module_of(path.removeprefix("src/").removeprefix("include/panelgate/"))
        if module not in self.table:
            yield 1, f"module '{module}' is not in the table"
            return
        for number, line in enumerate(text.splitlines(), 1):
            if problem := self.judge_line(module, path, line):
                yield number, problem

    def judge_depends(self):
        """DEPENDS is what a module's files include, no more and no less."""
        for module, depends in read_depends(self.root).items():
            used = self.used.get(module, set())
            for name in sorted(depends ^ used):
                wrong = "is in DEPENDS, but nothing includes it" if name in depends else "is missing in DEPENDS"
                yield f"src/CMakeLists.txt:1: {module}: {name} {wrong}"


def users_of_headers(root):
    """{header: files that include it}, its own source left out; both as paths below the root."""
    users = {}
    for top in ("src", "include", "tests"):
        for file in sorted((root / top).rglob("*.[ch]pp")):
            path = file.relative_to(root)
            for found in filter(None, map(INCLUDE.match, file.read_text().splitlines())):
                header = found[2]
                if header.startswith("panelgate/"):
                    header = "include/" + header
                elif top == "src":
                    header = (path.parent / header).as_posix()
                elif top == "tests":  # a private header of the module that is tested
                    header = f"src/{path.parent.relative_to('tests/unit').as_posix()}/{header}" \
                        if path.parts[1] == "unit" else header
                if pathlib.Path(header).stem != path.stem or top == "tests":
                    users.setdefault(header, set()).add(path.as_posix())
    return users


def judge_rooms(root):
    """A header has two users, a test, or a room's size with its source: else it lives with its user.
    Settings and counters are for others by their name."""
    users = users_of_headers(root)
    for top in ("src", "include"):
        for file in sorted((root / top).rglob("*.hpp")):
            path = file.relative_to(root).as_posix()
            module = path.removeprefix("src/").removeprefix("include/panelgate/")
            source = root / "src" / pathlib.Path(module).with_suffix(".cpp")
            lines = sum(p.read_text().count("\n") for p in (file, source) if p.exists())
            using = users.get(path, set())
            if file.stem not in ("settings", "counters") and lines < MIN_ROOM and len(using) == 1 \
                    and not any(user.startswith("tests/") for user in using):
                yield f"{path}:1: {lines} lines with one user: they belong in {using.pop()}"


def judge_lengths(file, top):
    text = file.read_text()
    lines = text.count("\n")
    if lines > MAX_LINES:
        yield lines, f"{lines} lines, {MAX_LINES} at most"
    functions = python_functions(text) if file.suffix == ".py" else cpp_functions(text)
    for first, length, name in functions:
        is_table = file.match("src/config/*.cpp") and name.endswith("_keys")  # rows, one below the other
        if length > MAX_FUNCTION[top] and not is_table:
            yield first, f"{name} has {length} lines, {MAX_FUNCTION[top]} at most"


def check(root):
    """FILE:LINE: what is wrong, for src/, include/ and the lengths in tests/."""
    tree = Tree(root)
    problems, count = [], 0
    for top in MAX_FUNCTION:
        for file in sorted((root / top).rglob("*")):
            if file.suffix not in (".cpp", ".hpp", ".py"):
                continue
            count += 1
            path = file.relative_to(root).as_posix()
            found = list(judge_lengths(file, top)) + (list(tree.judge_file(file)) if top != "tests" else [])
            problems += [f"{path}:{number}: {problem}" for number, problem in found]
    return count, problems + list(tree.judge_depends()) + list(judge_rooms(root))


TABLE = """## Who may include whom
| module | may include | third party |
|---|---|---|
| base | — | result |
| yaml | base | yaml-cpp (only `document`) |
| modbus | base | — |
| arbiter | base, modbus | — |
| rt | base | Asio, spdlog |
| line | base, rt | Asio, termios |
| bus | base, rt, arbiter, line | Asio |
| tcp_server | base, bus | Asio |
| sim | base | Asio (not `station`) |
| metrics | any `counters.hpp` | — |
| web/http | base, rt | Asio, Beast |
| web/api | base, web/http | — |
| config | any `settings.hpp`, `bus/point.hpp` | — |
| app | everything | CLI11 |

## Next
"""
LONG = "int f() {\n" + "    ++i;\n" * 39 + "}"
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
    "src/web/http/j.cpp": '#include "panelgate/web/api/api.hpp"',
    "src/web/http/k.cpp": '#include "panelgate/bus/bus.hpp"',
    "src/tcp_server/l.cpp": "void f(arbiter::Host host);",
    "src/base/m.cpp": '#include "closet.hpp"\n' "namespace panelgate {\n" + LONG + "\n}",
    "include/panelgate/base/n.hpp": "class A {\n  public:\n    explicit A(int x) : x_{x}, y_(x) {\n"
                                    + "        ++x_;\n" * 40 + "    }\n};",
    "tests/unit/o_test.cpp": "TEST(Thing, IsLong) {\n" + "    ++i;  // }\n" * 60 + "}",
    "tests/unit/p_test.cpp": "\n" * MAX_LINES + "int x;",
    "tests/q.py": "def f():\n" + "    pass\n" * 60,
    "src/base/closet.hpp": "int r();",
}
HARMLESS = {
    "src/README.md": TABLE,
    "src/CMakeLists.txt": "panelgate_module(base)\npanelgate_module(bus DEPENDS rt LIBRARIES Boost::headers)\n"
                          "panelgate_module(config DEPENDS web/http bus)",
    "include/panelgate/web/http/settings.hpp": "",
    "src/bus/fine.cpp": '#include "panelgate/rt/clock.hpp"\nauto t = clock.now();  // not ::now(), web::now\narbiter::Job j;',
    "src/config/fine.cpp": '#include "panelgate/web/http/settings.hpp"\n#include "panelgate/bus/point.hpp"\n'
                           "#include <vector>\nweb::Settings s; std::string_view t = \"sim::x\";",
    "src/base/tested.hpp": "int r();",
    "src/base/uses_tested.cpp": '#include "tested.hpp"',
    "tests/unit/base/tested_test.cpp": '#include "tested.hpp"',
    "src/base/room.hpp": "int r();",
    "src/base/room.cpp": '#include "room.hpp"\n' + "int x;\n" * MIN_ROOM,
    "src/base/uses_room.cpp": '#include "room.hpp"',
    "src/rt/fine.cpp": "auto t = std::chrono::steady_clock::now();",
    "src/yaml/document.cpp": "#include <yaml-cpp/yaml.h>",
    "src/base/fine.cpp": "struct T {\n" + "    int x = '{';\n" * 60 + "};\n" + LONG.replace("    ++i;\n", "", 1)
                         + "constexpr int k[] = {\n" + "    f(1),\n" * 60 + "};",
}


def found_in(files):
    """Which files of a tree like this have a problem."""
    with tempfile.TemporaryDirectory() as name:
        root = pathlib.Path(name)
        for path, text in files.items():
            (root / path).parent.mkdir(parents=True, exist_ok=True)
            (root / path).write_text(text + "\n")
        return sorted(problem.split(":")[0] for problem in check(root)[1])


def self_test():
    found = found_in({**PLANTED, **HARMLESS})
    assert found == sorted(PLANTED), f"planted {sorted(PLANTED)}, found {found}"
    fine = HARMLESS["src/CMakeLists.txt"]
    for wrong in (fine.replace("DEPENDS rt", "DEPENDS rt line"), fine.replace(" bus)", ")")):
        assert found_in({**HARMLESS, "src/CMakeLists.txt": wrong}) == ["src/CMakeLists.txt"], wrong
    no_row = HARMLESS["src/README.md"].replace("| rt |", "| clocks |")
    assert "src/rt/fine.cpp" in found_in({**HARMLESS, "src/README.md": no_row}), "a module without a row"


def main():
    if len(sys.argv) != 2:
        sys.exit(__doc__)
    self_test()
    count, problems = check(pathlib.Path(sys.argv[1]))
    print("\n".join(problems) or f"{count} files, no violation")
    sys.exit(bool(problems) or count == 0)


if __name__ == "__main__":
    main()
