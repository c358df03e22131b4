"""What is wrong with the way through a program, whatever its statements do: found before it runs."""

from collections.abc import Collection, Iterator, Sequence

from robot_agent.language.conditions import Else, EndIf
from robot_agent.language.program import CalledLine, ProgramProblem
from robot_agent.language.sequence import End, Label, Sub
from robot_agent.language.statement import Statement

_Edges = Sequence[Collection[int]]


def mistakes_of_flow(statements: Sequence[Statement], file_ends: Collection[int]) -> Iterator[ProgramProblem]:
    """Code that no line leads to, loops in which no time passes, subroutines without END or that call themselves.

    `file_ends` are the places after the last statement of each file.
    """
    count = len(statements)
    edges = [[to for to in each.leads_to(place) if to < count] for place, each in enumerate(statements)]
    reached = _reached(edges, [0])
    yield from _unreached(statements, reached)
    at_once = _left_at_once(statements)
    idle: list[list[int]] = []
    for place, each in enumerate(statements):
        busy = isinstance(each, Sub) and each.target not in at_once
        after = [each.target] if isinstance(each, Sub) and busy else edges[place]
        idle.append([to for to in after if statements[to].idle] if each.idle and place in reached else [])
    for place in _on_circles(idle):
        if min(idle[place], default=count) <= place:
            allowed = "a motion or a WAIT in it, so that time passes"
            yield _problem(statements[place], "a loop that neither moves nor waits", allowed)
    circles = _circle_of(edges)
    ends = _leads_to_end(statements, file_ends)
    for place, each in enumerate(statements):
        if isinstance(each, Sub) and circles[place] == circles[each.target]:
            yield _problem(each, "a subroutine that comes to its own call again", "END before it calls itself")
        elif isinstance(each, Sub) and not each.file and each.target in ends:
            yield _problem(each, "a subroutine without END: it runs to the end of the file", "END where it is done")


def _left_at_once(statements: Sequence[Statement]) -> set[int]:
    """Places from which an END, or the end of a file, may be reached without any time."""
    back: list[list[int]] = [[] for _ in range(len(statements) + 1)]
    for place, each in enumerate(statements):
        if each.idle:
            for to in each.leads_to(place):
                back[to].append(place)
    left = [len(statements), *(place for place, each in enumerate(statements) if isinstance(each, End))]
    found = set(left)
    while left:
        for place in back[left.pop()]:
            each = statements[place]
            comes_back = not isinstance(each, Sub) or (each.target in found and place + 1 in found)
            if place not in found and comes_back:
                found.add(place)
                left.append(place)
    return found


def _unreached(statements: Sequence[Statement], reached: Collection[int]) -> Iterator[ProgramProblem]:
    """One for each run of them; what only marks a place may stand anywhere."""
    before = True
    for place, each in enumerate(statements):
        if isinstance(each, End | Label | Else | EndIf):
            before = before or place in reached
            continue
        here = place in reached
        if before and not here:
            yield _problem(each, "code that no line leads to", "a GOTO or SUB that leads to a label before it, or none")
        before = here


def _problem(statement: Statement, found: str, allowed: str) -> ProgramProblem:
    line = statement.line
    file, number = (line.file, line.number) if isinstance(line, CalledLine) else ("", line)
    return ProgramProblem(number, 1, found, allowed, file)


def _leads_to_end(statements: Sequence[Statement], file_ends: Collection[int]) -> set[int]:
    """Places from which a file ends without END; a subroutine that is called comes back."""
    back: list[list[int]] = [[] for _ in range(len(statements) + 1)]
    for place, each in enumerate(statements):
        for to in (place + 1,) if isinstance(each, Sub) else each.leads_to(place):
            back[to].append(place)
    return _reached(back, file_ends)


def _reached(edges: _Edges, starts: Collection[int]) -> set[int]:
    reached, left = set(starts), list(starts)
    while left:
        for to in edges[left.pop()]:
            if to not in reached:
                reached.add(to)
                left.append(to)
    return reached


def _on_circles(edges: _Edges) -> list[int]:
    """Places that are on a circle."""
    circle = _circle_of(edges)
    return [place for place, to in enumerate(edges) if any(circle[each] == circle[place] for each in to)]


def _circle_of(edges: _Edges) -> list[int]:
    """For each place a number that it shares with all to which it leads and that lead to it (Tarjan 1972)."""
    found, low, number = [-1] * len(edges), [0] * len(edges), [-1] * len(edges)
    count, open_places = 0, list[int]()
    for root in range(len(edges)):
        ways = [(root, iter(edges[root]))] if number[root] < 0 else []
        while ways:
            place, left = ways[-1]
            if number[place] < 0:
                number[place] = low[place] = count
                count += 1
                open_places.append(place)
            following = next((to for to in left if found[to] < 0), None)
            if following is None:
                ways.pop()
                if ways:
                    low[ways[-1][0]] = min(low[ways[-1][0]], low[place])
                if low[place] == number[place]:
                    while found[place] < 0:
                        found[open_places.pop()] = place
            elif number[following] < 0:
                ways.append((following, iter(edges[following])))
            else:
                low[place] = min(low[place], number[following])
    return found
