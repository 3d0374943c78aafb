"""Access to lxml, which has no types: here its elements get one name."""

from importlib import import_module
from typing import Any

etree: Any = import_module("lxml.etree")
Element = Any
"""An element of a tree of lxml."""
