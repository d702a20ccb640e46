"""docs/reference/rest.md: the calls of /openapi.json, each with a line of curl for the demo."""
import json
import textwrap

import running
from tables import anchor, page, table

DEMO = "http://127.0.0.1:8080"
# Of calls that only read: why a page cannot run them beside a demo.
NOT_RUN = {"/api/v1/events": "it goes on for as long as the client listens",
           "/api/v1/lines/{line}/incidents/{incident}": "it wants an incident",
           "/page/{file}": "a browser asks for it"}
LONG = ("text/html", "x-pcapng", "/openapi.json")  # only their length is shown, and curl fails at a problem
HEADING = {"reads": "Read", "writes": "Write", "points": "Points", "status": "Status",
           "configuration": "Configuration", "probes": "Probes", "pages": "Pages", "simulator": "Simulator"}


def wrapped(text):
    """A paragraph and the empty line behind it; nothing of nothing."""
    lines = textwrap.wrap(text, 100, break_on_hyphens=False, break_long_words=False)
    return [*lines, ""] if lines else []


class Document:
    def __init__(self, text):
        self.all = json.loads(text)

    def at(self, thing):
        """What a reference names, or the thing itself."""
        while "$ref" in thing:
            place = self.all
            for step in thing["$ref"].split("/")[1:]:
                place = place[step]
            thing = place
        return thing

    def calls(self, tag):
        for path, methods in self.all["paths"].items():
            for method, call in methods.items():
                if call["tags"] == [tag]:
                    yield path, method.upper(), call

    def kind(self, schema):
        schema = self.at(schema)
        if "enum" in schema:
            return ", ".join(str(word) for word in schema["enum"] if word is not None)
        kind = schema.get("type", "")
        words = [" or ".join(one for one in kind if one != "null") if isinstance(kind, list) else kind]
        if "minimum" in schema and "maximum" in schema:
            words.append(f"{schema['minimum']} to {schema['maximum']}")
        if "default" in schema:
            words.append(f"default {json.dumps(schema['default'])}")
        return ", ".join(filter(None, words))

    def parameters(self, call):
        for one in map(self.at, call.get("parameters", [])):
            yield (f"`{one['name']}`", one["in"], self.kind(one["schema"]), one["description"])

    def members(self, schema):
        """Of a body: [(name, values, what it is)]."""
        schema = self.at(schema)
        for name, one in schema.get("properties", {}).items():
            what = one.get("description") or self.at(one).get("description", "")
            if self.at(one).get("type") == "array" and "oneOf" in self.at(self.at(one)["items"]):
                yield f"`{name}`", "a list", what
                for kind in self.at(self.at(one)["items"])["oneOf"]:
                    yield f"`{name}[]`", "an entry", "one with " + ", ".join(
                        f"`{member}`" for member in self.at(kind)["properties"])
            else:
                yield f"`{name}`", self.kind(one), what


def example_of(content):
    return content.get("example", next((one["value"] for one in content.get("examples", {}).values()), None))


def command(document, path, method, call, shortened):
    for one in map(document.at, call.get("parameters", [])):
        if one["in"] == "path":
            path = path.replace("{" + one["name"] + "}", str(one["example"]))
    words = ["curl -sf" if shortened else "curl -s", *([f"-X {method}"] if method != "GET" else [])]
    words += [f"-H '{one['name']}: {one['example']}'" for one in map(document.at, call.get("parameters", []))
              if one["in"] == "header" and one.get("required")]
    if "requestBody" in call:
        [(kind, content)] = call["requestBody"]["content"].items()
        words.append(f"-d '{json.dumps(content['example'])}'" if "example" in content
                     else f"-H 'Content-Type: {kind}' --data-binary @panelgate.yaml")
    return " ".join([*words, DEMO + path])


def runs(path, method, call):
    """The mark of its block, and what is behind the command."""
    if path in NOT_RUN:
        return f"not run: {NOT_RUN[path]}", ""
    if method != "GET" and path != "/api/v1/read":
        return "not run: it changes something", ""
    shown = json.dumps(call["responses"]["200"]["content"]) + path
    return "test: demo", " | wc -c" if any(word in shown for word in LONG) and "text/plain" not in shown else ""


def answers(document, call):
    for code, answer in call["responses"].items():
        if "$ref" in answer:
            continue
        kinds = ", ".join(f"`{kind}`" for kind in answer.get("content", {}))
        examples = [json.dumps(one) for content in answer.get("content", {}).values()
                    if (one := example_of(content)) is not None]
        yield code, answer["description"], kinds, "; ".join(f"`{one}`" for one in examples if len(one) < 200)


def described(document, path, method, call):
    mark, behind = runs(path, method, call)
    lines = [f"### {method} {path}", "", f"{call['summary']}. Role: {call['x-role']}.".replace("?.", "?"), "",
             *wrapped(call.get("description", "")),
             f"<!-- {mark} -->", "```sh", command(document, path, method, call, bool(behind)) + behind, "```", ""]
    if rows := list(document.parameters(call)):
        lines += table(("parameter", "in", "values", "what it is"), rows)
    if "requestBody" in call:
        [content] = call["requestBody"]["content"].values()
        if rows := list(document.members(content["schema"])):
            lines += table(("member of the body", "values", "what it is"), rows)
    lines += table(("answer", "meaning", "type", "such as"), answers(document, call))
    errors = [code for code, answer in call["responses"].items() if "$ref" in answer]
    return lines + ([f"Errors: {', '.join(f'[{code}](#errors)' for code in errors)}.", ""] if errors else [])


def errors(document):
    for code, answer in sorted(document.all["components"]["responses"].items()):
        examples = [one["value"] for content in answer["content"].values()
                    for one in content.get("examples", {}).values()]
        yield code, answer["description"], "; ".join(f"`{one['type'].rsplit(':', 1)[1]}`: {one['detail']}"
                                                     for one in examples)


def words(document):
    """Of the problem types, without what all begin with."""
    types = document.all["components"]["schemas"]["Problem"]["properties"]["type"]["enum"]
    return [one.rsplit(":", 1)[1] for one in types]


def text(program):
    with running.demo(program) as gateway:
        document = Document(gateway.text("/openapi.json"))
    info = document.all["info"]["description"]
    lines = ["# REST", "", "Made from the program by `deploy/manual/reference.py`. A gateway has the same in full, with",
             "the form of each answer, at `/docs` (this manual: `/docs/`) and as OpenAPI 3.1 at `/openapi.json`.", "",
             *wrapped(info),
             "The lines of curl ask `panelgate demo`. With tokens a call wants `-H \"Authorization: Bearer TOKEN\"`",
             "of a token with its role; *none* is free for all. See [Tokens](../tasks/tokens.md).", "",
             "## Contents", ""]
    for tag in document.all["tags"]:
        rows = [(f"[{method} {path}](#{anchor(f'{method} {path}')})", call["summary"], call["x-role"])
                for path, method, call in document.calls(tag["name"])]
        lines += [f"**{HEADING[tag['name']]}**: {tag['description'][0].lower()}{tag['description'][1:]}", "",
                  *table(("call", "what it does", "role"), rows)]
    for tag in document.all["tags"]:
        lines += [f"## {HEADING[tag['name']]}", ""]
        for path, method, call in document.calls(tag["name"]):
            lines += described(document, path, method, call)
    lines += ["## Errors", "", "Each is `application/problem+json` with `type`, `title`, `status` and `detail`; of what was",
              "asked of a panel, `transmitted` and `modbus_exception` as well. `type` is `urn:panelgate:problem:` and",
              "a word of a list that only grows.", "",
              *table(("status", "meaning", "such as"), errors(document)),
              "All words of `type`:", "", *wrapped(", ".join(f"`{word}`" for word in words(document)))]
    return page(lines)
