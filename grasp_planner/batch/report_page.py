"""The frame of a report's page: style, and the script that filters rows and points links at the viewer."""

from __future__ import annotations

PAGE = """<!doctype html>
<html lang="en"><head><meta charset="utf-8"><title>{title}</title>
<meta http-equiv="Content-Security-Policy"
 content="default-src 'none'; img-src data:; style-src 'unsafe-inline'; script-src 'unsafe-inline'">
<meta name="viewport" content="width=device-width">
<style>
body {{ font: 15px/1.45 system-ui, sans-serif; margin: 2rem auto; max-width: 75rem; padding: 0 1rem; color: #222; }}
table {{ border-collapse: collapse; margin: .6rem 0 1.2rem; }}
th, td {{ border-bottom: 1px solid #ddd; padding: .2rem .7rem; text-align: left; vertical-align: top; }}
th {{ background: #f3f4f6; }} td {{ font-variant-numeric: tabular-nums; }}
code {{ background: #f3f4f6; padding: 0 .25rem; white-space: nowrap; }}
.plots {{ display: flex; flex-wrap: wrap; gap: 1rem; }} figure {{ margin: 0 0 1rem; }}
img {{ max-width: 100%; border: 1px solid #ddd; }} input {{ font: inherit; width: 24rem; max-width: 100%; }}
#port, #row {{ width: 6rem; }} .note {{ background: #eef3ff; padding: .5rem .8rem; border-radius: .4rem; }}
.rows {{ overflow-x: auto; font-size: .85rem; }}
</style></head><body>
{body}
<script>
const box = document.getElementById("filter"), lines = [...document.querySelectorAll(".rows tbody tr")];
box.addEventListener("input", () => {{
  const words = box.value.toLowerCase().split(/\\s+/);
  for (const line of lines) {{
    const text = line.textContent.toLowerCase();
    line.hidden = !words.every(word => text.includes(word));
  }}
}});
const links = [...document.querySelectorAll("a[data-row]")];
const [port, row, any] = ["port", "row", "any"].map(name => document.getElementById(name));
const address = number => `http://127.0.0.1:${{port.value}}/?run={run}&row=${{number}}`;
const point = () => {{
  any.dataset.row = row.value;
  for (const link of links) link.href = address(link.dataset.row);
}};
port.addEventListener("input", point);
row.addEventListener("input", point);
document.addEventListener("click", event => {{
  if (event.target.matches("code")) getSelection().selectAllChildren(event.target);
}});
</script></body></html>
"""
"""The page; ``{title}``, ``{body}`` and ``{run}`` (hash in its links) are to be filled in."""
