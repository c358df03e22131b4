"""No test file is imported: what tests share is in modules beside them, which no run of pytest collects."""

import ast

from tests.unit.repository import ROOT


def imported(text: str) -> set[str]:
    """The names of all modules that a file may import, also `module.name` for what may be a module in a package."""
    found: set[str] = set()
    for node in ast.walk(ast.parse(text)):
        if isinstance(node, ast.Import):
            found |= {alias.name for alias in node.names}
        elif isinstance(node, ast.ImportFrom):
            found |= {f"{node.module}.{alias.name}" for alias in node.names} | {str(node.module)}
    return found


def is_test_file(module: str) -> bool:
    path = ROOT / module.replace(".", "/")
    return path.name.startswith("test_") and path.with_suffix(".py").is_file()


def test_no_file_imports_a_test_file() -> None:
    files = sorted((ROOT / "tests").rglob("*.py"))
    found = {
        f"{file.relative_to(ROOT)} imports {module}"
        for file in files
        for module in imported(file.read_text())
        if is_test_file(module)
    }
    assert found == set()


def test_both_forms_of_an_import_of_a_test_file_are_found() -> None:
    module = "tests.unit.project.test_tests_stand_alone"
    package, _, name = module.rpartition(".")
    for text in (f"from {module} import imported", f"from {package} import {name}", f"import {module}"):
        assert any(is_test_file(each) for each in imported(text))
