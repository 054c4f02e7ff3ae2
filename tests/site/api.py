"""Writes the reference of a Python package in Markdown, from its source and without importing it.

usage: api.py PACKAGE

The names that the package exports come first, then its modules with adapters. A name that begins with an underscore is left out.
"""

import ast
import re
import sys
from pathlib import Path


INHERITED = "As the base class defines it."


def words(node_or_text):
    """A docstring as Markdown: roles and double backticks become code, indented blocks become blocks of Python."""
    text = node_or_text if isinstance(node_or_text, str) else ast.get_docstring(node_or_text) or ""
    text = re.sub(r":\w+:`([^`]*)`", r"`\1`", text).replace("``", "`")
    return re.sub(r"(?m)(?:^    .*\n?)+", block, text)


def block(lines):
    """An indented block as one between fences: of Python if it begins with an import."""
    text = re.sub("(?m)^    ", "", lines[0]).rstrip()
    return f"```{'python' if text.startswith(('import', 'from')) else 'text'}\n{text}\n```\n"


def apart(arguments):
    """Arguments one by one: a comma within brackets does not part two."""
    parts = [""]
    for word in arguments.split(", "):
        is_whole = all(parts[-1].count(a) == parts[-1].count(b) for a, b in ["[]", "()"])
        if parts[-1] and is_whole:
            parts.append(word)
        else:
            parts[-1] += f", {word}" if parts[-1] else word
    return parts


def signature(function, name, skip_self=False):
    arguments = function.args
    if skip_self and arguments.args:
        arguments.args = arguments.args[1:]
    returns = f" -> {ast.unparse(function.returns)}" if function.returns and name[0] != name[0].upper() else ""
    line = f"{name}({ast.unparse(arguments)}){returns}"
    if len(line) > 80 and ast.unparse(arguments):
        line = f"{name}(\n    " + ",\n    ".join(apart(ast.unparse(arguments))) + f",\n){returns}"
    # Signatures are no programs: blocks of `python` are.
    return f"```py\n{line}\n```\n"


def is_function(node):
    return isinstance(node, ast.FunctionDef | ast.AsyncFunctionDef)


def described(nodes):
    """Pairs of an annotated or assigned name and the docstring after it."""
    for node, after in zip(nodes, [*nodes[1:], None]):
        is_text = isinstance(after, ast.Expr) and isinstance(after.value, ast.Constant) and isinstance(after.value.value, str)
        if isinstance(node, ast.AnnAssign) and isinstance(node.target, ast.Name):
            yield node.target.id, ast.unparse(node.annotation), words(after.value.value) if is_text else ""


def member(node, level):
    """The section of a function or a class."""
    head = "#" * level
    if is_function(node):
        return f"{head} {node.name}\n\n{signature(node, node.name)}\n{words(node)}\n\n"
    text = f"{head} {node.name}\n\n"
    functions = [n for n in node.body if is_function(n)]
    start = next((f for f in functions if f.name == "__init__"), None)
    text += signature(start, node.name, skip_self=True) + "\n" if start else ""
    text += words(node) + "\n\n"
    fields = [(name, kind, said) for name, kind, said in described(node.body) if not name.startswith("_")]
    if fields:
        text += "| key | type | meaning |\n|---|---|---|\n"
        for name, kind, said in fields:
            text += f"| `{name}` | `{kind}` | {said}".replace("\n", " ").replace(" | None", " or None") + " |\n"
        text += "\n"
    for function in functions:
        if function.name.startswith("_"):
            continue
        if any(isinstance(d, ast.Name) and d.id == "property" for d in function.decorator_list):
            text += f"**`{function.name}`**: {words(function)}\n\n"
        else:
            text += f"{head}# {node.name}.{function.name}\n\n{signature(function, function.name, skip_self=True)}\n{words(function) or INHERITED}\n\n"
    return text


def main(folder):
    modules = {path.stem: ast.parse(path.read_text(encoding="utf-8")) for path in sorted(folder.glob("*.py"))}
    package = modules.pop("__init__")
    exported = next(ast.literal_eval(n.value) for n in package.body if isinstance(n, ast.Assign) and n.targets[0].id == "__all__")
    text = "# Python package\n\n" + words(package) + "\n\n[Python](../python.md) explains tasks, observations, actions and rewards.\n\n"
    public = {n.name: n for tree in modules.values() for n in tree.body if hasattr(n, "name")}
    for name in exported:
        if name in public:
            text += member(public[name], 2)
    for stem, tree in modules.items():
        if stem.startswith("_"):
            continue
        text += f"## orchardbench.{stem}\n\n{words(tree)}\n\n"
        for node in tree.body:
            if hasattr(node, "name") and not node.name.startswith("_") and words(node):
                text += member(node, 3)
    sys.stdout.write(text)


main(Path(sys.argv[1]))
