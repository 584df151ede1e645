"""The ladder of models, one file each."""

from sweep.models import slip
from sweep.models.model import Model

MODELS: dict[str, Model] = {module.MODEL.name: module.MODEL for module in (slip,)}
