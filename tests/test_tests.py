"""The tests themselves: each can fail."""

from __future__ import annotations

import ast
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from tests.data import ROOT
from tests.some import some

_OF_THEIR_ARGUMENTS = {
    "enumerate",
    "sorted",
    "reversed",
    "items",
    "keys",
    "values",
    "list",
    "tuple",
    "product",
    "cycle",
}
"""Calls that give something where what they are given has something; methods as of what they are called on."""


def surely_some(node: ast.expr, known: frozenset[str]) -> bool:
    """Whether what a loop goes through is seen to hold something: written out, a constant by its name, or `some`."""
    match node:
        case ast.List(elts=parts) | ast.Tuple(elts=parts) | ast.Set(elts=parts):
            return any(not isinstance(part, ast.Starred) for part in parts)
        case ast.Dict(keys=parts):
            return bool(parts)
        case ast.Constant(value=value):
            return bool(value)
        case ast.Name(id=name):
            return name.isupper() or name in known
        case ast.Attribute(attr=name):
            return name.isupper()
        case ast.Call(func=ast.Name(id="some")):
            return True
        case ast.Call(func=ast.Name(id="range"), args=bounds):
            return all(isinstance(one, ast.Constant | ast.UnaryOp) or surely_some(one, known) for one in bounds)
        case ast.Call(func=ast.Name(id="zip"), args=parts):
            return (any if _strict(node) else all)(surely_some(part, known) for part in parts)
        case ast.Call(func=ast.Attribute(value=owner, attr=name), args=[]) if name in _OF_THEIR_ARGUMENTS:
            return surely_some(owner, known)
        case ast.Call(func=ast.Name(id=name), args=[first, *_]) if name in _OF_THEIR_ARGUMENTS:
            return surely_some(first, known)
    return False


def _strict(call: ast.Call) -> bool:
    return any(word.arg == "strict" and getattr(word.value, "value", False) is True for word in call.keywords)


def checks(node: ast.AST) -> bool:
    """Whether a statement can make a test fail: an assertion, an error that must come, a call of such a name."""
    match node:
        case ast.Assert():
            return True
        case ast.With(items=items):
            return any("raises" in ast.unparse(item.context_expr) for item in items)
        case ast.Expr(value=ast.Call(func=called)):
            return ast.unparse(called).rpartition(".")[2].startswith(("assert", "check", "fail"))
    return False


def holds_of_nothing(node: ast.AST) -> bool:
    """`assert all(... for ... in things)`, which holds where there is no thing."""
    if not isinstance(node, ast.Assert):
        return False
    parts = node.test.values if isinstance(node.test, ast.BoolOp) else [node.test]
    return all(
        isinstance(part, ast.Call)
        and getattr(part.func, "id", "") == "all"
        and isinstance(part.args[0], ast.GeneratorExp | ast.ListComp)
        and not all(surely_some(each.iter, frozenset()) for each in part.args[0].generators)
        for part in parts
    )


def within(body: Sequence[ast.AST], known: frozenset[str] = frozenset(), empty: bool = False) -> Iterator[bool]:
    """Of each check in these statements: whether it may never come about, for it is in a loop that may have nothing."""
    for node in body:
        if checks(node):
            yield empty or holds_of_nothing(node)
            continue
        if isinstance(node, ast.Assign) and isinstance(node.targets[0], ast.Name) and surely_some(node.value, known):
            known |= {node.targets[0].id}
        is_loop = isinstance(node, ast.For) and not surely_some(node.iter, known)
        yield from within(
            [child for child in ast.iter_child_nodes(node) if isinstance(child, ast.stmt | ast.ExceptHandler)],
            known,
            empty or is_loop,
        )


def each_test(path: Path) -> Iterator[ast.FunctionDef]:
    for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
        if isinstance(node, ast.FunctionDef) and node.name.startswith("test"):
            yield node


def test_no_test_checks_only_in_loops_that_may_be_empty() -> None:
    """Where this fails: go through `some(things)` (tests/some.py), or assert first how many there are."""
    may_check_nothing = [
        f"{path.relative_to(ROOT)}:{test.lineno} {test.name}"
        for path in some(sorted((ROOT / "tests").rglob("test_*.py")))
        for test in each_test(path)
        if (found := list(within(test.body))) and all(found)
    ]
    assert may_check_nothing == []


@pytest.mark.parametrize(
    ("body", "expected"),
    [
        ("for a in things:\n    assert a", True),
        ("for a in things:\n    for b in (1, 2):\n        if a:\n            assert b", True),
        ("assert all(a for a in things)", True),
        ("for a, b in zip(things, others, strict=True):\n    assert a == b", True),
        ("assert things\nfor a in things:\n    assert a", False),
        ("for a in (1, 2):\n    assert a", False),
        ("for a in some(things):\n    assert a", False),
        ("for a, b in zip(things, (1, 2), strict=True):\n    assert a == b", False),
        ("for a in FORMATS.items():\n    assert a", False),
        ("few = [1, 2]\nfor i, a in enumerate(few):\n    assert a", False),
        ("for a in range(3):\n    with pytest.raises(ValueError):\n        f(a)", False),
        ("assert all(a for a in some(things))", False),
    ],
)
def test_such_a_loop_is_seen(body: str, expected: bool) -> None:
    found = list(within(ast.parse(body).body))
    assert found and all(found) is expected


def test_a_loop_over_nothing_fails() -> None:
    assert list(some([0, 1])) == [0, 1]
    with pytest.raises(AssertionError, match="nothing was checked"):
        list(some([]))
