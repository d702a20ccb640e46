"""What an OpenAPI 3.1 document says, as far as ours uses it, held against what a program says."""
import re

TYPES = {"object": dict, "array": list, "string": str, "boolean": bool, "null": type(None)}


class Document:
    def __init__(self, document):
        self.all = document
        self.seen_members = set()  # (schema, member) that any checked value has had

    def resolve(self, item):
        while "$ref" in item:
            _, *path = item["$ref"].split("/")
            item = self.all
            for step in path:
                item = item[step]
        return item

    def operations(self):
        """{(verb, path pattern): operation}"""
        return {(verb.upper(), path): operation for path, verbs in self.all["paths"].items()
                for verb, operation in verbs.items()}

    def operation_of(self, verb, path):
        """(pattern, operation) of a request's path; the pattern with the most of its own words."""
        segments = path.split("/")
        best = None
        for (known, pattern), operation in self.operations().items():
            words = pattern.split("/")
            fits = len(words) == len(segments) and all(
                word.startswith("{") or word == segment for word, segment in zip(words, segments))
            score = sum(not word.startswith("{") for word in words)
            if known == verb and fits and (best is None or score > best[0]):
                best = score, pattern, operation
        return best[1:] if best else None

    def response_of(self, operation, status):
        answers = operation["responses"]
        found = answers.get(str(status)) or answers.get(f"{status // 100}XX")
        return self.resolve(found) if found else None

    def parameters_of(self, operation):
        return [self.resolve(entry) for entry in operation.get("parameters", [])]

    def faults(self, value, schema, at="body"):
        """What is wrong with a value, one line each."""
        name = schema.get("$ref", "").rpartition("/")[2]
        schema = self.resolve(schema)
        if "oneOf" in schema:
            tried = [self.faults(value, one, at) for one in schema["oneOf"]]
            return [] if tried.count([]) == 1 else [f"{at}: fits {tried.count([])} of: {tried}"]
        found = []
        if "const" in schema and value != schema["const"]:
            found.append(f"{at}: is {value!r}, not {schema['const']!r}")
        if "enum" in schema and value not in schema["enum"]:
            found.append(f"{at}: {value!r} is none of {schema['enum']}")
        if "type" in schema and not _is_of(value, schema["type"]):
            return found + [f"{at}: {value!r} is no {schema['type']}"]
        if isinstance(value, (int, float)) and not isinstance(value, bool):
            if not schema.get("minimum", value) <= value <= schema.get("maximum", value):
                found.append(f"{at}: {value} is out of its range")
        if isinstance(value, str) and not re.search(schema.get("pattern", ""), value):
            found.append(f"{at}: {value!r} does not match {schema['pattern']}")
        if isinstance(value, list):
            for index, one in enumerate(value):
                found += self.faults(one, schema.get("items", {}), f"{at}[{index}]")
        if isinstance(value, dict):
            found += self._members(value, schema, at, name)
        return found

    def _members(self, value, schema, at, name):
        known = schema.get("properties", {})
        found = [f"{at}: lacks {member}" for member in schema.get("required", [])
                 if member not in value]
        for member, one in value.items():
            if member in known:
                self.seen_members.add((name, member))
                found += self.faults(one, known[member], f"{at}.{member}")
            elif schema.get("additionalProperties") is False:
                found.append(f"{at}: has {member}, which is not described")
        return found


def _is_of(value, types):
    types = [types] if isinstance(types, str) else types
    if isinstance(value, bool):
        return "boolean" in types
    if isinstance(value, int):
        return "integer" in types or "number" in types
    if isinstance(value, float):
        return "number" in types
    return any(isinstance(value, TYPES[one]) for one in types if one in TYPES)
