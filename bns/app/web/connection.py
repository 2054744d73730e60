"""A lost connection is said, and the page comes back by itself: the server keeps what a tab is about."""

from __future__ import annotations

from typing import Any

from bokeh.models import CustomJS

_LOST = """
if (document.getElementById("bns-lost") !== null) return
const said = document.createElement("p")
said.id = "bns-lost"
said.setAttribute("role", "alert")
said.textContent = "The connection to bns explore is lost. Clicks have no effect until it is back: the page looks for it and "
  + "loads again, as you left it. If bns explore was ended, start it again and open the address that it prints."
document.body.prepend(said)
const file = new URL("static/js/bokeh.min.js", location.href.split("?")[0])
const look = async () => {
  try {
    if ((await fetch(file, {method: "HEAD", cache: "no-store"})).ok) return location.reload()
  } catch {}
  setTimeout(look, 2000)
}
setTimeout(look, 500)
"""


def watch_connection(document: Any) -> None:
    """Of a page in the browser."""
    document.js_on_event("connection_lost", CustomJS(code=_LOST))
