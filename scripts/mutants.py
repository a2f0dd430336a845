"""Small changes to a Python file, one at a time. A mutant's key names place and change without a
line number.
"""

import ast
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass

_COMPARE = {
    ast.Lt: (ast.LtE, ast.GtE),
    ast.LtE: (ast.Lt, ast.Gt),
    ast.Gt: (ast.GtE, ast.LtE),
    ast.GtE: (ast.Gt, ast.Lt),
    ast.Eq: (ast.NotEq,),
    ast.NotEq: (ast.Eq,),
    ast.Is: (ast.IsNot,),
    ast.IsNot: (ast.Is,),
    ast.In: (ast.NotIn,),
    ast.NotIn: (ast.In,),
}
_ARITHMETIC = {
    ast.Add: ast.Sub,
    ast.Sub: ast.Add,
    ast.Mult: ast.Div,
    ast.Div: ast.Mult,
    ast.BitAnd: ast.BitOr,
    ast.BitOr: ast.BitAnd,
    ast.LShift: ast.RShift,
    ast.RShift: ast.LShift,
    ast.BitXor: ast.BitOr,
}


@dataclass(frozen=True)
class Mutant:
    """A changed file: its path and what was changed.

    ``function`` is the function whose body has the change, as in ``Class.name``; empty where it is
    elsewhere. ``lines`` are the first and last line of the changed statement, of a compound one
    those of its head. ``part`` is the text of the changed function or top-level statement.
    """

    path: str
    key: str
    function: str
    lines: tuple[int, int]
    part: str
    tree: ast.Module
    steps: tuple
    replacement: ast.AST

    @property
    def text(self) -> str:
        """The whole new text of the file."""
        return _with(self.tree, self.steps, self.replacement, self.tree)


def mutants_of(path: str, source: str) -> list[Mutant]:
    """Every mutant of a file, in the order of the file, each with a key of its own."""
    tree = ast.parse(source)
    count, found = Counter(), []
    wholes: dict[tuple, str] = {}
    texts = set()
    for name, steps, replacement in list(_changes(tree)):
        unit_steps, unit, function = _unit(tree, steps)
        if unit_steps not in wholes:
            wholes[unit_steps] = ast.unparse(unit)
        parent, last = _walk(tree, steps)
        before = parent[last] if isinstance(parent, list) else getattr(parent, last)
        said = f"{_short(before)} -> {_short(replacement)}"
        if unit_steps == steps:
            text = ast.unparse(replacement)
        else:
            text = _with(tree, steps, replacement, unit)
        if text == wholes[unit_steps] or (unit_steps, text) in texts:
            continue
        texts.add((unit_steps, text))
        key = f"{path}: {name}: {said}"
        count[key] += 1
        key = key if count[key] == 1 else f"{key} ({count[key]})"
        lines = _lines(tree, steps)
        found.append(Mutant(path, key, function, lines, text, tree, steps, replacement))
    return found


def _with(tree: ast.Module, steps: tuple, replacement: ast.AST, shown: ast.AST) -> str:
    """The text of a part of the tree while something else stands at one place."""
    parent, last = _walk(tree, steps)
    if isinstance(parent, list):
        before, parent[last] = parent[last], replacement
        text = ast.unparse(shown)
        parent[last] = before
        return text
    before = getattr(parent, last)
    setattr(parent, last, replacement)
    text = ast.unparse(shown)
    setattr(parent, last, before)
    return text


def _unit(tree: ast.Module, steps: tuple) -> tuple[tuple, ast.AST, str]:
    """The statement of the module, or of a class of it, that holds a place: steps to it, itself,
    and its name where the place is in a function's body.
    """
    unit, taken, names = tree.body[steps[1]], 2, []
    while isinstance(unit, ast.ClassDef) and len(steps) > taken + 1 and steps[taken] == "body":
        names.append(unit.name)
        unit = unit.body[steps[taken + 1]]
        taken += 2
    inside = isinstance(unit, ast.FunctionDef) and steps[taken : taken + 1] == ("body",)
    return steps[:taken], unit, ".".join([*names, unit.name]) if inside else ""


def _lines(tree: ast.Module, steps: tuple) -> tuple[int, int]:
    node: object = tree
    statement: ast.stmt | None = None
    for step in steps:
        node = node[step] if isinstance(step, int) else getattr(node, step)
        if isinstance(node, ast.stmt):
            statement = node
    if statement is None:
        return 0, 0
    body = getattr(statement, "body", None)
    is_head = isinstance(body, list) and not isinstance(statement, ast.Try)
    last = max(body[0].lineno - 1, statement.lineno) if is_head else statement.end_lineno
    return statement.lineno, last


def _walk(node: object, steps: tuple) -> tuple[object, str | int]:
    for step in steps[:-1]:
        node = node[step] if isinstance(step, int) else getattr(node, step)
    return node, steps[-1]


def _short(node: ast.AST) -> str:
    text = "nothing" if isinstance(node, ast.Pass) else " ".join(ast.unparse(node).split())
    return text if len(text) <= 90 else text[:87] + "..."


def _changes(tree: ast.Module) -> Iterator[tuple[str, tuple, ast.AST]]:
    """(function, steps to the place, what to put there)."""
    yield from _visit(tree, (), "module")


def _visit(node: ast.AST, steps: tuple, name: str) -> Iterator[tuple[str, tuple, ast.AST]]:
    if isinstance(node, (ast.FunctionDef, ast.ClassDef)):
        name = node.name if name == "module" else f"{name}.{node.name}"
    for replacement in _replacements(node):
        yield name, steps, replacement
    for field, value in ast.iter_fields(node):
        if field in (
            "annotation",
            "returns",
            "decorator_list",
            "bases",
            "names",
            "ctx",
            "op",
            "ops",
        ):
            continue
        if isinstance(value, ast.AST):
            yield from _visit(value, (*steps, field), name)
        elif isinstance(value, list):
            for i, item in enumerate(value):
                if isinstance(item, ast.AST) and not _is_docstring(item):
                    yield from _visit(item, (*steps, field, i), name)


def _is_docstring(node: ast.AST) -> bool:
    return isinstance(node, ast.Expr) and isinstance(node.value, ast.Constant)


def _replacements(node: ast.AST) -> Iterator[ast.AST]:
    if isinstance(node, ast.Compare):
        for i, op in enumerate(node.ops):
            for other in _COMPARE[type(op)]:
                yield ast.Compare(
                    node.left, [*node.ops[:i], other(), *node.ops[i + 1 :]], node.comparators
                )
    elif isinstance(node, ast.BoolOp):
        yield ast.BoolOp(ast.Or() if isinstance(node.op, ast.And) else ast.And(), node.values)
        for i in range(len(node.values)):
            rest = node.values[:i] + node.values[i + 1 :]
            yield rest[0] if len(rest) == 1 else ast.BoolOp(node.op, rest)
    elif isinstance(node, ast.UnaryOp):
        yield node.operand
    elif isinstance(node, ast.BinOp) and type(node.op) in _ARITHMETIC:
        yield ast.BinOp(node.left, _ARITHMETIC[type(node.op)](), node.right)
    elif isinstance(node, ast.Constant):
        yield from _other_constant(node.value)
    elif isinstance(node, ast.IfExp):
        yield node.body
        yield node.orelse
    elif isinstance(node, ast.stmt):
        yield from _other_statement(node)


def _other_constant(value: object) -> Iterator[ast.AST]:
    if isinstance(value, bool):
        yield ast.Constant(not value)
    elif isinstance(value, int):
        yield ast.Constant(value + 1)
        if value:
            yield ast.Constant(value - 1)
    elif isinstance(value, float):
        yield ast.Constant(value + 1.0)
        yield ast.Constant(value * 0.5)
    elif isinstance(value, str):
        yield ast.Constant("" if value else "other")


def _other_statement(node: ast.stmt) -> Iterator[ast.AST]:
    nothing_anyway = (
        isinstance(node, ast.Return)
        and isinstance(node.value, ast.Constant)
        and node.value.value is None
    )
    if (
        isinstance(
            node,
            (
                ast.Assign,
                ast.AugAssign,
                ast.AnnAssign,
                ast.Expr,
                ast.Return,
                ast.Continue,
                ast.Raise,
            ),
        )
        and not nothing_anyway
    ):
        yield ast.Pass()
    if isinstance(node, ast.AugAssign) and type(node.op) in _ARITHMETIC:
        yield ast.AugAssign(node.target, _ARITHMETIC[type(node.op)](), node.value)
    if isinstance(node, ast.Return) and node.value is not None:
        yield ast.Return(ast.Constant(None))
    if isinstance(node, (ast.If, ast.While)):
        yield type(node)(ast.Constant(True), node.body, node.orelse)
        yield type(node)(ast.Constant(False), node.body, node.orelse)
    if isinstance(node, ast.Try):
        yield ast.If(ast.Constant(True), node.body, [])
