"""Pictures of the page, in Bokeh: made once, filled again. Units on every axis, colours that everybody can tell apart."""
