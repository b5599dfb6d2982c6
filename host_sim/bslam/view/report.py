"""One HTML page with tables and pictures in it, that needs no other file and no network."""

from __future__ import annotations

import base64
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Final

from jinja2 import Environment, StrictUndefined


@dataclass(frozen=True)
class Table:
    """Text in rows; the first one holds the headings, the first column says what a row is."""

    rows: Sequence[Sequence[str]]
    caption: str = ""


@dataclass(frozen=True)
class Picture:
    """A PNG file's content."""

    png: bytes
    caption: str

    @property
    def url(self) -> str:
        """The picture itself."""
        return f"data:image/png;base64,{base64.b64encode(self.png).decode()}"


@dataclass(frozen=True)
class Section:
    """A part of the page; commands: those that make what is in it; verdict: what came of it, first of all."""

    title: str
    commands: Sequence[str]
    words: str
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()
    verdict: str = ""


_PAGE: Final = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>{{ title }}</title>
<meta name="viewport" content="width=device-width, initial-scale=1">
<style>
  body { font: 16px/1.5 system-ui, sans-serif; color: #222; overflow-wrap: anywhere; }
  body { max-width: 70em; margin: 1.5em auto; padding: 0 1em; }
  h2 { border-bottom: 1px solid #ccc; margin-top: 2.2em; }
  .wide { overflow-x: auto; }
  table { border-collapse: collapse; margin: 1em 0; font-size: 14px; overflow-wrap: normal; }
  caption { text-align: left; color: #555; padding-bottom: 0.3em; }
  th, td { padding: 0.2em 0.8em; border-bottom: 1px solid #e4e4e4; text-align: right; }
  th:first-child, td:first-child { text-align: left; }
  pre { background: #f4f4f4; padding: 0.6em 1em; white-space: pre-wrap; }
  figure { margin: 1.5em 0; }
  img { max-width: 100%; min-width: 640px; }
  figcaption { color: #555; }
  .verdict { border-left: 4px solid #0067a8; padding: 0.1em 0.8em; background: #f2f7fb; }
  ul.verdict { padding-left: 1.8em; }
  @media (max-width: 700px) {
    table { font-size: 13px; }
    th, td { padding: 0.2em 0.35em; }
  }
</style>
</head>
<body>
<h1>{{ title }}</h1>
<ul class="verdict">
{%- for section in sections %}
<li><a href="#part{{ loop.index }}">{{ section.title }}</a>
{%- if section.verdict %}: {{ section.verdict }}{% endif %}</li>
{%- endfor %}
</ul>
<p>{{ words }}</p>
{%- macro grid(table) %}
<div class="wide"><table>
{%- if table.caption %}<caption>{{ table.caption }}</caption>{% endif %}
<tr>{% for cell in table.rows[0] %}<th>{{ cell }}</th>{% endfor %}</tr>
{%- for row in table.rows[1:] %}
<tr>{% for cell in row %}<td>{{ cell }}</td>{% endfor %}</tr>
{%- endfor %}
</table></div>
{%- endmacro %}
{%- for section in sections %}
<h2 id="part{{ loop.index }}">{{ section.title }}</h2>
{%- if section.verdict %}<p class="verdict">{{ section.verdict }}</p>{% endif %}
<p>{{ section.words }}</p>
{%- if section.commands %}
<pre>{{ section.commands | join("\\n") }}</pre>
{%- endif %}
{%- for table in section.tables %}{{ grid(table) }}{% endfor %}
{%- for picture in section.pictures %}
<figure><div class="wide"><img alt="{{ picture.caption }}" src="{{ picture.url }}"></div>
<figcaption>{{ picture.caption }}</figcaption></figure>
{%- endfor %}
{%- endfor %}
{{ grid(about) }}
</body>
</html>
"""


def render(title: str, words: str, about: Table, sections: Sequence[Section]) -> str:
    """The page."""
    template = Environment(autoescape=True, undefined=StrictUndefined).from_string(_PAGE)
    return template.render(title=title, words=words, about=about, sections=sections) + "\n"
