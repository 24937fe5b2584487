"""Bar charts as SVG, legible on light and on dark pages: nothing but text, lines and rectangles."""

import math
from xml.sax.saxutils import escape

STYLE = """
text { font: 13px system-ui, sans-serif; fill: #24292f }
.title { font-size: 16px; font-weight: 600 }
.small { font-size: 11px; fill: #57606a }
.grid { stroke: #d0d7de } .one { stroke: #57606a; stroke-width: 1.5 }
.a { fill: #0969da } .b { fill: #bc4c00 } .c { fill: #8c959f }
@media (prefers-color-scheme: dark) {
text { fill: #e6edf3 } .small { fill: #9da7b3 } .grid { stroke: #30363d } .one { stroke: #9da7b3 }
.a { fill: #58a6ff } .b { fill: #f0883e } .c { fill: #6e7681 }
}
"""
WIDTH, LEFT, RIGHT, BAR = 820, 250, 90, 16


def bars(title, note, series, rows, log=False):
    """A chart of `rows`, each a label and a value for each of `series`: a number, or words why there is none.

    A line marks 1, since all values are ratios. With `log`, bars start at the least power of ten below all.
    """
    values = [v for _, row in rows for v in row if isinstance(v, (int, float))]
    most, least = max(values + [1.0]), min(values + [1.0])
    low = 10 ** math.floor(math.log10(least) - 1e-9) if log else 0.0
    high = 10 ** math.ceil(math.log10(most)) if log else math.ceil(most * 5 + 0.2) / 5
    room = WIDTH - LEFT - RIGHT
    if log:
        place = lambda v: LEFT + room * math.log(v / low) / math.log(high / low)
        ticks = [10.0**k for k in range(round(math.log10(low)), round(math.log10(high)) + 1)]
    else:
        place = lambda v: LEFT + room * v / high
        ticks = [k / 5 for k in range(round(high * 5) + 1)]
    step = BAR * len(series) + 12
    top, height = 84, 84 + step * len(rows) + 36
    out = [f'<svg xmlns="http://www.w3.org/2000/svg" viewBox="0 0 {WIDTH} {height}" role="img" aria-label="{escape(title)}">']
    out.append(f"<style>{STYLE}</style>")
    out.append(f'<text class="title" x="12" y="24">{escape(title)}</text><text class="small" x="12" y="44">{escape(note)}</text>')
    at = 12
    for kind, name in zip("abc", series):
        out.append(f'<rect class="{kind}" x="{at}" y="56" width="12" height="12" rx="2"/><text x="{at + 18}" y="67">{escape(name)}</text>')
        at += 48 + 7.5 * len(name)
    for tick in ticks:
        x = place(tick)
        out.append(f'<line class="{"one" if tick == 1 else "grid"}" x1="{x:.1f}" x2="{x:.1f}" y1="{top - 6}" y2="{height - 30}"/>')
        out.append(f'<text class="small" x="{x:.1f}" y="{height - 14}" text-anchor="middle">{tick:g}</text>')
    for number, (label, row) in enumerate(rows):
        y = top + step * number
        out.append(f'<text x="{LEFT - 10}" y="{y + BAR * len(series) / 2 + 4:.0f}" text-anchor="end">{escape(label)}</text>')
        for kind, value in zip("abc", row):
            if isinstance(value, (int, float)):
                end = place(value)
                out.append(f'<rect class="{kind}" x="{LEFT}" y="{y + 2}" width="{max(end - LEFT, 1):.1f}" height="{BAR - 3}" rx="2"/>')
                text = f"{value:.2f}" if value < 10 else f"{value:.0f}"
            else:
                end, text = LEFT, str(value)
            out.append(f'<text class="small" x="{end + 5:.1f}" y="{y + BAR - 3}">{escape(text)}</text>')
            y += BAR
    return "\n".join(out) + "\n</svg>\n"
