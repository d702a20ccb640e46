"""How long functions are. For C++ by counting braces: strings and comments are taken out, and a
brace at the level of a namespace or class whose head has parameters begins a function.
"""
import ast
import re

NOISE = re.compile(r'R"(\w*)\(.*?\)\1"|"(?:\\.|[^"\\\n])*"|(?<![\w])\'(?:\\.|[^\'\\\n])+\'|//[^\n]*|/\*.*?\*/|^[ \t]*#(?:\\\n|[^\n])*',
                   re.S | re.M)
SCOPE = re.compile(r"\b(?:namespace|class|struct|union|extern)\b[^()=]*$")
INITIALISER = re.compile(r"\)\s*(?:noexcept\s*)?:(?!:)(?:.|\n)*[\w>]\s*$")  # Foo() : member_{
BODY = re.compile(r"(?:\)|\}|\b(?:const|noexcept|override|final|mutable|try)|->[^;=]+|\brequires\b[^;=]+)\s*$")


def blank(text):
    """The same text with strings and comments as blanks, its line breaks kept."""
    return NOISE.sub(lambda found: '""' * (found[0][0] in "\"R'") + "\n" * found[0].count("\n"), text)


def kind_of(head, inside):
    """What a brace behind this head begins: a scope to look into, a function, or neither."""
    if inside in ("function", "other"):
        return "other"
    if INITIALISER.search(head) and not re.search(r"\b(?:const|noexcept|override|final)\s*$", head):
        return "initialiser"
    if "(" in head and BODY.search(head) and not re.search(r"=\s*$", head):
        return "function"
    return "scope" if SCOPE.search(head) or re.search(r"\benum\b", head) else "other"


def cpp_functions(text):
    """(first line, lines, name) of each function, lambdas inside counted with it."""
    code = blank(text)
    stack, head, start = [], "", 0
    for at, char in enumerate(code):
        inside = stack[-1][0] if stack else "scope"
        if char == "{":
            kind = kind_of(head, inside)
            stack.append((kind, start, head))
            if kind != "initialiser":
                head = ""
        elif char == "}" and stack:
            kind, begun, name = stack.pop()
            if kind == "function":
                first = code.count("\n", 0, begun) + 1
                yield first, code.count("\n", 0, at) + 2 - first, name_of(name)
            head = head + "}" if kind == "initialiser" else ""
        elif char == ";" and inside == "scope":
            head = ""
        elif not (head or char.isspace()):
            head, start = char, at
        elif head:
            head += char


def name_of(head):
    found = re.search(r"([~\w:]+|operator[^(]*)\s*\(", head)
    return found[1] if found else head.strip()


def python_functions(text):
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, (ast.FunctionDef, ast.AsyncFunctionDef)):
            yield node.lineno, node.end_lineno - node.lineno + 1, node.name
