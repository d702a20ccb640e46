"""Reads tests/data/vectors.yaml: a list of flat maps, one `key: value` a line."""
import json
import re

import harness


def load(part):
    vectors = []
    for line in (harness.ROOT / "tests/data/vectors.yaml").read_text().splitlines():
        found = re.match(r"^  (- |  )(\w+): (.*)$", line)
        if not found:
            continue
        if found.group(1) == "- ":
            vectors.append({})
        vectors[-1][found.group(2)] = json.loads(found.group(3))
    return [vector for vector in vectors if vector["part"] == part]


def request(vector):
    """As it must be: with the right CRC where the manual prints a wrong one."""
    return bytes.fromhex(vector.get("request_corrected") or vector["request"])


def response(vector):
    """None when the manual shows none."""
    text = vector.get("response_corrected") or vector["response"]
    return text and bytes.fromhex(text)
