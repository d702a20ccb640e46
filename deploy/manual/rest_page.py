"""The page of REST: every call and every member of src/web/api/openapi, with a line of curl for each call."""
import html
import json
import pathlib

import rest

OPENAPI = pathlib.Path(__file__).resolve().parents[2] / "src/web/api/openapi"


def document():
    """As /openapi.json has it."""
    head, paths, components = (json.loads((OPENAPI / f"{name}.json").read_text())
                               for name in ("head", "paths", "components"))
    return rest.Document(json.dumps({**head, "paths": paths, "components": components}))


def code(text):
    return f"<code>{html.escape(str(text))}</code>"


def spoken(value):
    return json.dumps(value, ensure_ascii=False)


def name_of(reference):
    return reference["$ref"].rsplit("/", 1)[1] if "$ref" in reference else ""


def kind(schema):
    """A short text for a type: "array of Register", "integer or null", "one of a, b"."""
    if name := name_of(schema):
        return f'<a href="#{name}">{name}</a>'
    parts = [kind(one) for one in schema.get("oneOf", [])]
    if parts:
        return " or ".join(parts)
    if "enum" in schema:
        return ", ".join(code(one if isinstance(one, str) else spoken(one)) for one in schema["enum"])
    if "const" in schema:
        return code(spoken(schema["const"]))
    types = schema.get("type", "")
    text = html.escape(" or ".join(types) if isinstance(types, list) else types)
    return f"{text} of {kind(schema['items'])}" if schema.get("items") else text


def table(titles, rows):
    rows = list(rows)
    if not rows:
        return ""
    head = "".join(f'<th scope="col">{title}</th>' for title in titles)
    body = "".join("<tr>" + "".join(f"<td>{cell}</td>" for cell in row) + "</tr>\n" for row in rows)
    return f'<div class="scroll"><table>\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody></table></div>\n'


class RestPage:
    path = None
    name = "rest.html"
    title = "REST, every member"

    def __init__(self):
        self.document = document()
        self.calls = [(tag, list(self.document.calls(tag["name"]))) for tag in self.document.all["tags"]]
        self.parts = [["", self.title, [self.document.all["info"]["description"]]]]
        for _, calls in self.calls:
            self.parts += [[call["operationId"], f"{method} {path}",
                            [call["summary"], call.get("description", ""), self.curl(path, method, call)]]
                           for path, method, call in calls]
        self.parts += [[name, name, [schema.get("description", ""), *schema.get("properties", {})]]
                       for name, schema in self.schemas()]

    def schemas(self):
        return self.document.all["components"]["schemas"].items()

    def curl(self, path, method, call):
        return rest.command(self.document, path, method, call, False)

    def parameters(self, call):
        for one in map(self.document.at, call.get("parameters", [])):
            example = code(spoken(one["example"])) if "example" in one else ""
            yield code(one["name"]), one["in"], kind(one["schema"]), html.escape(one["description"]), example

    def contents(self, with_content):
        text = ""
        for media, content in with_content.get("content", {}).items():
            text += f"{code(media)} {kind(content.get('schema', {}))}"
            if "example" in content:
                text += f"<pre>{html.escape(spoken(content['example']))}</pre>"
        return text

    def answers(self, call):
        for status, answer in call["responses"].items():
            answer = self.document.at(answer)
            yield code(status), html.escape(answer["description"]), self.contents(answer)

    def operation(self, path, method, call):
        name = call["operationId"]
        lines = [f'<h3 id="{name}"><code>{method} {html.escape(path)}</code> <small>{call["x-role"]}</small></h3>',
                 f"<p>{html.escape(call['summary'])}</p>"]
        if call.get("description"):
            lines.append(f"<p>{html.escape(call['description'])}</p>")
        lines.append(f"<pre><code>{html.escape(self.curl(path, method, call))}</code></pre>")
        lines.append(table(("parameter", "in", "values", "what it is", "such as"), self.parameters(call)))
        if "requestBody" in call:
            lines.append(f"<p>Body: {self.contents(call['requestBody'])}</p>".replace("<pre>", "</p><pre>")
                         .replace("</pre></p>", "</pre>"))
        lines.append(table(("answer", "meaning", "body"), self.answers(call)))
        return "\n".join(filter(None, lines))

    def schema(self, name, schema):
        members = [(code(member), kind(one), html.escape(one.get("description", "")))
                   for member, one in schema.get("properties", {}).items()]
        return "\n".join([f'<h3 id="{name}">{name}</h3>', f"<p>{html.escape(schema.get('description', ''))}</p>",
                          table(("member", "values", "what it is"), members) if members else f"<p>{kind(schema)}</p>"])

    def listed(self):
        """The contents of the page: calls by what they are for."""
        rows = []
        for tag, calls in self.calls:
            links = "".join(f'<li><a href="#{call["operationId"]}"><code>{method} {html.escape(path)}</code></a> '
                            f'{html.escape(call["summary"])}</li>' for path, method, call in calls)
            rows.append(f"<p><b>{rest.HEADING[tag['name']]}</b>: {html.escape(tag['description'])}</p>\n<ul>{links}</ul>")
        links = ", ".join(f'<a href="#{name}">{name}</a>' for name, _ in self.schemas())
        return "\n".join([*rows, f"<p><b>What bodies have</b>: {links}</p>"])

    def body(self, openapi):
        info = self.document.all["info"]
        lines = [f"<h1>{self.title}</h1>", f"<p>{html.escape(info['description'])}</p>",
                 f'<p>For programs: <a href="{openapi}">openapi.json</a>. The lines of curl ask '
                 "<code>panelgate demo</code>; with tokens a call wants "
                 "<code>-H 'Authorization: Bearer TOKEN'</code> of a token with the role beside its name; "
                 "<em>none</em> is free for all.</p>",
                 '<h2 id="contents">Contents</h2>', self.listed()]
        for tag, calls in self.calls:
            lines += [f'<h2 id="{tag["name"]}">{rest.HEADING[tag["name"]]}</h2>', f"<p>{html.escape(tag['description'])}</p>"]
            lines += [self.operation(*call) for call in calls]
        lines.append('<h2 id="bodies">What bodies have</h2>')
        lines += [self.schema(name, schema) for name, schema in self.schemas()]
        return "\n".join(lines) + "\n"
