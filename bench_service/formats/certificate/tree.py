"""Library of XML trees, which has no types: here it gets one name for its elements."""

from importlib import import_module
from typing import Any

etree: Any = import_module("lxml.etree")
Element = Any
"""An element of a tree of lxml."""
