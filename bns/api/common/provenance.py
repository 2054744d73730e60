"""What a result was made from: the same program, model and data give the same result."""

from __future__ import annotations

import hashlib
from typing import Any

from bns import __version__
from bns.diagnose.settings import DEFAULTS, Settings
from bns.diagnose.settings.chosen import changed
from bns.physics.model import Model
from bns.spec import ENGINE_VERSION


def provenance(model: Model, data_sha256: str, settings: Settings = DEFAULTS) -> dict[str, Any]:
    """Versions of package and engine, SHA-256 (64 digits) of the model's canonical JSON and of the data's canonical bytes.

    With them the diagnosis's settings, room -> name -> value, their digest (12 digits), and those that are not the default.
    """
    return {
        "bns_version": __version__,
        "engine_version": ENGINE_VERSION,
        "model": model.name,
        "model_sha256": hashlib.sha256(model.canonical_json().encode()).hexdigest(),
        "data_sha256": data_sha256,
        "settings_digest": settings.digest(),
        "settings": settings.as_json(),
        "settings_changed": changed(settings),
    }
