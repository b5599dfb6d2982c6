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
    """A part of the page; commands: those that make what is in it."""

    title: str
    commands: Sequence[str]
    words: str
    tables: Sequence[Table] = ()
    pictures: Sequence[Picture] = ()


_PAGE: Final = """<!DOCTYPE html>
<html lang="en">
<head>
<meta charset="utf-8">
<title>{{ title }}</title>
<style>
  body { font: 15px/1.45 sans-serif; color: #222; max-width: 75em; margin: 2em auto; padding: 0 1em; }
  h2 { border-bottom: 1px solid #ccc; margin-top: 2.2em; }
  table { border-collapse: collapse; margin: 1em 0; font-size: 14px; }
  caption { text-align: left; color: #555; padding-bottom: 0.3em; }
  th, td { padding: 0.2em 0.8em; border-bottom: 1px solid #e4e4e4; text-align: right; }
  th:first-child, td:first-child { text-align: left; }
  pre { background: #f4f4f4; padding: 0.6em 1em; overflow-x: auto; }
  figure { margin: 1.5em 0; }
  img { max-width: min(100%, 60em); }
  figcaption { color: #555; }
</style>
</head>
<body>
<h1>{{ title }}</h1>
<p>{{ words }}</p>
{%- macro grid(table) %}
<table>
{%- if table.caption %}<caption>{{ table.caption }}</caption>{% endif %}
<tr>{% for cell in table.rows[0] %}<th>{{ cell }}</th>{% endfor %}</tr>
{%- for row in table.rows[1:] %}
<tr>{% for cell in row %}<td>{{ cell }}</td>{% endfor %}</tr>
{%- endfor %}
</table>
{%- endmacro %}
{{ grid(about) }}
<ul>
{%- for section in sections %}
<li><a href="#part{{ loop.index }}">{{ section.title }}</a></li>
{%- endfor %}
</ul>
{%- for section in sections %}
<h2 id="part{{ loop.index }}">{{ section.title }}</h2>
<p>{{ section.words }}</p>
{%- if section.commands %}
<pre>{{ section.commands | join("\\n") }}</pre>
{%- endif %}
{%- for table in section.tables %}{{ grid(table) }}{% endfor %}
{%- for picture in section.pictures %}
<figure><img alt="{{ picture.caption }}" src="{{ picture.url }}">
<figcaption>{{ picture.caption }}</figcaption></figure>
{%- endfor %}
{%- endfor %}
</body>
</html>
"""


def render(title: str, words: str, about: Table, sections: Sequence[Section]) -> str:
    """The page."""
    template = Environment(autoescape=True, undefined=StrictUndefined).from_string(_PAGE)
    return template.render(title=title, words=words, about=about, sections=sections) + "\n"
