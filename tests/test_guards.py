"""The table of guards is about the code and the tests as they are."""

from __future__ import annotations

import ast
import re
import shlex

import pytest
from guards import GUARDS, TESTS, Guard, source


@pytest.mark.parametrize("guard", GUARDS, ids=[guard.name for guard in GUARDS])
def test_the_guard_stands_once_and_its_tests_exist(guard: Guard) -> None:
    text = source(guard.file).read_text()
    assert text.count(guard.text) == 1
    assert guard.text != guard.without
    if guard.file.endswith(".py"):  # without it is Python still, so that not just anything fails
        ast.parse(text.replace(guard.text, guard.without))
    module, _, wanted = shlex.split(guard.tests)
    found = [n.name for n in ast.walk(ast.parse((TESTS / module).read_text()))
             if isinstance(n, ast.FunctionDef) and n.name.startswith("test_")]  # fmt: skip
    words = [word for word in re.findall(r"\w+", wanted) if word not in ("and", "or", "not")]
    assert any(word in name for name in found for word in words)


def test_names_are_not_given_twice() -> None:
    names = [guard.name for guard in GUARDS]
    assert len(set(names)) == len(names)
