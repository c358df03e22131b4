"""The one way to write a program: `cell format`. What lines mean, comments, blank lines and indents stay."""

from robot_agent.language.words import COMMENT, Word, statements_in

_WITH_PARAMETERS = frozenset({"MJ", "ML", "MC", "MS", "HOME", "TANG"})
"""Only on these a word such as F100 is a parameter; elsewhere it is a name."""


def formatted(text: str) -> str:
    """The program with statements in upper case, parameters as NAME=value, LABEL, TRACK and `;` in long form."""
    return "".join(f"{line}\n" for written in text.splitlines() for line in _lines(written))


def _lines(written: str) -> list[str]:
    mark = COMMENT.search(written)
    code, comment = (written, "") if mark is None else (written[: mark.start()], written[mark.end() :].rstrip())
    indent = code[: len(code) - len(code.lstrip())]
    lines = [indent + _statement(words) for words in statements_in(code)]
    if mark is None:
        return lines or [""]
    if not lines:
        return [f"{indent};{comment}"]
    lines[-1] = f"{lines[-1]:<{mark.start() - 1}} ;{comment}"
    return lines


def _statement(words: list[Word]) -> str:
    head, *others = words
    if head.statement.endswith("="):  # T=gripper, Z1: what it names is no word of the language
        return " ".join(
            [head.text.upper() if head.pair is None else "=".join(head.pair), *(each.text for each in others)]
        )
    name = {"TRK": "TRACK"}.get(head.text.upper(), head.text.upper())
    if name == "TRACK" and [each.text for each in others] == ["0"]:
        return "TRACK OFF"
    shown = [_parameter(each) if name in _WITH_PARAMETERS else each.text for each in others]
    return " ".join([name, *shown])


def _parameter(word: Word) -> str:
    return word.text if word.pair is None else "=".join(word.pair)
