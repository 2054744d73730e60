"""How the page looks: Panel's Bootstrap, without a copy of it in every component."""

from __future__ import annotations

from typing import Any, ClassVar

import panel as pn
from panel.io.resources import parse_template
from panel.theme.base import Inherit
from panel.theme.bootstrap import Bootstrap

from bns.app.parts import CSS
from bns.app.sliders import NAMES
from bns.app.web.dropped import SCRIPT as DROPPED

ICON = (
    "data:image/svg+xml,<svg xmlns='http://www.w3.org/2000/svg' viewBox='0 0 8 8'><circle cx='4' cy='4' r='3' "
    "fill='%230072B2'/></svg>#.svg"
)
"""Panel wants to see an ending."""
_FOCUS = ":focus-visible { outline: 3px solid #e69f00 !important; outline-offset: 1px; }"
"""Bootstrap shows it on its blue buttons only."""
_LISTS = "select[multiple] { background-image: none !important; }"
"""A list that is always open needs no arrow."""


class Lean(Bootstrap):
    """The page itself has Bootstrap's style sheets, whose variables reach into every component.

    Panel hands each component that comes later a copy of all of them (230 kB); two thirds of the browser's work went there.
    """

    modifiers: ClassVar = {pn.widgets.Widget: {"stylesheets": [Inherit, _FOCUS, _LISTS]}}

    def params(self, viewable: Any, doc: Any = None) -> tuple[dict[str, Any], dict[str, Any]]:
        """As Panel's own, for a component that stands in a page which has the style sheets."""
        cache = {} if doc is None else pn.state._stylesheets.setdefault(doc, {})
        modifiers, of_children = self._get_modifiers(viewable, theme=self.theme, isolated=False)
        self._patch_modifiers(doc, modifiers, cache)
        return modifiers, of_children


_PAGE = """{% extends "bootstrap/bootstrap.html" %}
{% block postamble %}{{ super() }}<meta name="viewport" content="width=device-width, initial-scale=1">
<script>SCRIPT</script>{% endblock %}"""


def template(title: str) -> Any:
    """An empty page, all of whose files come from this machine."""
    made: Any = pn.template.BootstrapTemplate(
        title=title, header_background="#23395d", favicon=ICON, raw_css=[CSS], design=Lean, busy_indicator=None
    )
    made.template = parse_template(_PAGE.replace("SCRIPT", NAMES + DROPPED))
    return made
