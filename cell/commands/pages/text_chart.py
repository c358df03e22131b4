"""Curves as text, for terminals and files alike."""

from collections.abc import Sequence

WIDTH, HEIGHT = 64, 13


def chart(title: str, curves: Sequence[tuple[str, Sequence[float]]], left: str, right: str, unit: str) -> list[str]:
    """Lines of text: each curve with its own mark, its values evenly spaced from the left to the right edge.

    Args:
        title: what is shown.
        curves: mark (one character) and values; later curves are drawn over earlier ones.
        left: where the horizontal axis begins.
        right: where it ends.
        unit: of the values.
    """
    values = [value for _, curve in curves for value in curve]
    low, high = min(values), max(values)
    span = high - low or 1.0
    rows = [[" "] * WIDTH for _ in range(HEIGHT)]
    for mark, curve in curves:
        for column in range(WIDTH):
            at = column * (len(curve) - 1) / (WIDTH - 1)
            before = min(int(at), max(0, len(curve) - 2))
            after = min(before + 1, len(curve) - 1)
            value = curve[before] + (at - before) * (curve[after] - curve[before])
            rows[HEIGHT - 1 - round((value - low) / span * (HEIGHT - 1))][column] = mark
    labels = [f"{high:8.3g}", *[" " * 8] * (HEIGHT - 2), f"{low:8.3g}"]
    lines = [f"{title} [{unit}]"]
    lines += [f"{label} |{''.join(row).rstrip()}" for label, row in zip(labels, rows, strict=True)]
    return [*lines, f"{'':8} +{'-' * WIDTH}", f"{'':10}{left}{right:>{WIDTH - len(left)}}"]
